"""Settings of planes: the content of their headers.

A decoder returns them, an encoder uses them, and an EPF file lists them. Settings of a part stay in force
until the next I plane that carries the part.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from fba.arrays import Bool, UInt8

RANGE_UNIT = 60
"""Range limits are multiples of this."""
RANGE_CODE_MAX = 31
"""Largest 5-bit range code: a limit of 31 x 60 = 1860."""


@dataclass(frozen=True)
class FrameRate:
    """Frame rate: frame_rate (8 bits) + seconds / 16 (4 bits), times 1000/1001 if frequency_offset is set."""

    frame_rate: int
    seconds: int = 0
    frequency_offset: int = 0

    @property
    def fraction(self) -> Fraction:
        """Frames per second, exact; 0 if the header says 0."""
        rate = Fraction(self.frame_rate * 16 + self.seconds, 16)
        return rate * Fraction(1000, 1001) if self.frequency_offset else rate

    @classmethod
    def from_fraction(cls, rate: Fraction) -> FrameRate | None:
        """Return the header fields that carry this rate exactly, or None."""
        for offset in (0, 1):
            sixteenths = rate * 16 * (Fraction(1001, 1000) if offset else 1)
            if sixteenths.denominator == 1 and 0 < sixteenths < 256 * 16:
                return cls(int(sixteenths) // 16, int(sixteenths) % 16, offset)
        return None


@dataclass(frozen=True)
class TimeCode:
    """Time code: hours (5 bits), minutes (6), marker bit, seconds (6)."""

    hours: int
    minutes: int
    seconds: int
    marker: int = 1

    @property
    def total_seconds(self) -> int:
        """Seconds since midnight."""
        return (self.hours * 60 + self.minutes) * 60 + self.seconds

    def __str__(self) -> str:
        return f"{self.hours}:{self.minutes:02}:{self.seconds:02}"


@dataclass(frozen=True)
class RangeLists:
    """The four lists of range limits of a part, as 5-bit codes: limit = 60 x code, minima negated.

    Each is uint8 (68,) for FAPs or (296,) for BAPs, parameter i+1 in element i, or None if it is not sent.
    Only the elements of sent parameters (FAPs: from 3 on) are coded.
    """

    i_max: UInt8 | None = None
    i_min: UInt8 | None = None
    p_max: UInt8 | None = None
    p_min: UInt8 | None = None

    def __iter__(self) -> Iterator[UInt8 | None]:
        """Yield the four lists in coding order."""
        yield from (self.i_max, self.i_min, self.p_max, self.p_min)

    def __bool__(self) -> bool:
        return any(codes is not None for codes in self)


@dataclass(frozen=True, eq=False)
class PartSettings:
    """The FAP or the BAP half of an I plane's header; in force until the next I plane with that part.

    mask_types: per group (10 or 24): 0 none, 1 masked (unsent keep their last value), 2 masked (unsent
        are interpolated; FAPs only), 3 all.
    mask: bool (68,) or (296,), parameters sent, from mask types and group masks.
    quant: fap_quant or bap_quant, 0..31. gender: suggested_gender, 1 male.
    coding_type: 0 predictive, 1 DCT segments. ranges: the lists sent with this plane.
    """

    mask_types: tuple[int, ...]
    mask: Bool
    quant: int = 1
    gender: int = 0
    coding_type: int = 0
    ranges: RangeLists = RangeLists()


@dataclass(frozen=True, eq=False, slots=True)
class PlaneSettings:
    """Settings of one plane: its header, and the frames of the source that it codes.

    face_frame, body_frame: number of the frame of the FAP and BAP file that it codes; None where the
        plane lacks the part.
    face, body: settings in force for the part; on P planes the same object as on the I plane.
    start_code: a plane start code stands before it.
    """

    intra: bool
    face_frame: int | None = None
    body_frame: int | None = None
    face: PartSettings | None = None
    body: PartSettings | None = None
    frame_rate: FrameRate | None = None
    time_code: TimeCode | None = None
    skip: int = 0
    start_code: bool = False


@dataclass(frozen=True, slots=True)
class PlaneInfo:
    """Position and settings of one plane in a stream.

    number: 0-based, in stream order. bit: where it starts, from the start of the stream. bits: its length.
    Both include the alignment and start code before it. doubtful: whether its values may be wrong, because it
    was decoded after damage with ranges that a lost plane may have replaced. For planes before damage, see
    `Damage.doubtful`.
    """

    number: int
    bit: int
    bits: int
    settings: PlaneSettings
    doubtful: bool = False
