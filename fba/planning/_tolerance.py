"""`Tolerance`: how far a stream may be from its source; and the errors of streams."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from fba.codec import EncoderStatistics


@dataclass(frozen=True)
class Tolerance:
    """How far a face and a body may be from those of the source, at every frame.

    face: metres by which a vertex of the face may move, in the frame of the head. head: degrees by which each
    of the head's three angles (FAPs 48 to 50) may differ. gaze: degrees for those of the eyes (FAPs 23 to
    26). joint: metres by which a point 3 cm from a joint may move. foot: metres by which a foot may move
    while it stands on the ground.

    ValueError for values that are not positive, finite numbers.
    """

    face: float = 0.0005
    head: float = 0.1
    gaze: float = 1.0
    joint: float = 0.01
    foot: float = 0.005

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (value > 0 and math.isfinite(value)):
                raise ValueError(f"a tolerance is a positive number; {field.name} is {value!r}")


@dataclass(frozen=True)
class FaceErrors:
    """How far a decoded face is from its source, at all frames of the source.

    largest, percentile_99: metres, of a vertex, in the frame of the head; frame, vertex: where the error is
    largest. head, gaze: degrees, the largest error of the head's three angles, and of the eyes'.
    """

    largest: float
    percentile_99: float
    frame: int
    vertex: int
    head: float
    gaze: float

    def is_within(self, tolerance: Tolerance) -> bool:
        """Return whether all errors are within a tolerance."""
        pairs = ((self.largest, tolerance.face), (self.head, tolerance.head), (self.gaze, tolerance.gaze))
        return all(off <= allowed for off, allowed in pairs)


@dataclass(frozen=True)
class BodyErrors:
    """How far a decoded body is from its source, at all frames of the source.

    largest, percentile_99: metres, of a point 3 cm off a joint, in the world; joint, frame: where it is
    largest. share: of all joints in all frames, within the tolerance. foot: metres, of a sole that stands.
    """

    largest: float
    percentile_99: float
    share: float
    joint: str
    frame: int
    foot: float

    def is_within(self, tolerance: Tolerance) -> bool:
        """Return whether joints and feet are within a tolerance."""
        return self.largest <= tolerance.joint and self.foot <= tolerance.foot


@dataclass(frozen=True, eq=False)
class NearLossless:
    """Result of encoding within a tolerance.

    statistics: of the encoder. fap_quant, bap_quant: quantisers. left_out: number of frames that are not
    sent. face, body: errors, None for a part that is absent or does not move. compact: whether no stream was
    smaller than that of the preset "compact", which keeps all that is shown.
    """

    statistics: EncoderStatistics
    fap_quant: int = 1
    left_out: int = 0
    face: FaceErrors | None = None
    compact: bool = False
    bap_quant: int = 1
    body: BodyErrors | None = None
