"""`Sample`: what a sender says of one moment; `DatagramReader`, which finds it in datagrams."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple, Protocol

from fba.arrays import Float64


class BoneTurn(NamedTuple):
    """A bone in its parent's axes, y up, right-handed: position (3,) in metres, quaternion (w, x, y, z)."""

    position: Float64
    rotation: Float64


@dataclass(frozen=True, eq=False)
class Sample:
    """What a sender says of one moment.

    seconds: of the sender's own clock. subject: the name that the sender gives to whom it shows; "" where the
    protocol has none. device: tells senders apart that give the same name. rate: frames in a second that the
    sender counts in; None where it does not say.

    names: of shapes. weights: float64 (N,), 0 to 1; None where no face is seen. head (3,), eyes (4,): angles
    as in `fba.capture.ShapeMotion`; None where the protocol has none. bones: by name of Unity's humanoid
    bones, those that have been sent so far; "" stands for the root of all.
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
    """A datagram that cannot be used; the text says what it is, as "cut short"; datagrams with one fault
    have one text."""


class DatagramReader(Protocol):
    """Reads the datagrams of one address, in the order in which they come."""

    def read(self, data: bytes, now: float) -> list[Sample]:
        """Return the moments that are complete with this datagram, often one.

        now: when it came, in seconds of a clock that never goes back. Raises DatagramError.
        """

    def newest(self) -> Sample | None:
        """Return what the sender says now, complete or not; None before the first datagram."""
