"""`Sample`: the face and the bones that a sender reports at one moment; `DatagramReader`: reads samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple, Protocol

from fba.arrays import Float64


class BoneTurn(NamedTuple):
    """A bone in its parent's axes, y up, right-handed: position (3,), metres; quaternion (w, x, y, z)."""

    position: Float64
    rotation: Float64


@dataclass(frozen=True, eq=False)
class Sample:
    """A face and bones at one moment.

    seconds: of the sender's clock. subject: name of the person shown; "" where the protocol has none. device:
    distinguishes senders with the same subject. rate: the sender's frames a second, or None.

    names: of shapes. weights: float64 (N,), 0 to 1; None where no face is seen. head (3,), eyes (4,): angles
    as in `fba.capture.ShapeMotion`; None where the protocol has none. bones: all that were sent so far, by
    name of Unity's humanoid bones; "" is the root.
    """

    seconds: float
    names: Sequence[str]
    weights: Float64 | None
    head: Float64 | None = None
    eyes: Float64 | None = None
    subject: str = ""
    device: bytes = b""
    rate: Fraction | None = None
    bones: Mapping[str, BoneTurn] = field(default_factory=dict)


class DatagramError(Exception):
    """A datagram that cannot be used. The text completes "a datagram ...", such as "cut short"."""


class DatagramReader(Protocol):
    """Reads the datagrams of one address, in the order of arrival."""

    def read(self, data: bytes, now: float) -> list[Sample]:
        """Return the samples that this datagram completes, usually one.

        now: arrival time, in seconds of a monotonic clock. Raises DatagramError.
        """

    def newest(self) -> Sample | None:
        """Return the newest sample, complete or not; None before the first datagram."""
