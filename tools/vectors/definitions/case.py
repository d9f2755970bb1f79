"""Definitions of test vectors: `Case` for a valid stream, `Fault` for a damaged one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from fba.parameters import BapTable


@dataclass(frozen=True)
class Case:
    """Definition of a valid stream.

    name: of the file. tests: what it tests, in one line. make: returns its bytes. times: whether the times
    of its planes are beyond doubt. encodes: whether our encoder, given the values and the plane headers,
    makes the same bytes; not where there are start codes and stuffing that it does not write. optional: why a
    decoder may refuse the stream, "" where it must not.
    """

    name: str
    tests: str
    make: Callable[[], bytes]
    bap_steps: BapTable = "iso"
    times: bool = True
    encodes: bool = True
    optional: str = ""


@dataclass(frozen=True)
class Fault:
    """Definition of a damaged stream.

    name, tests, make: as for `Case`. before: number of planes before the damage. after: returns a stream of
    those planes that can be salvaged behind it, None without any. kind: "damaged", or "unsupported" for
    what is no fault, but cannot be decoded. times: whether a salvaging decoder knows the times of all planes.
    """

    name: str
    tests: str
    make: Callable[[], bytes]
    before: int
    after: Callable[[], bytes] | None = None
    kind: str = "damaged"
    times: bool = False
