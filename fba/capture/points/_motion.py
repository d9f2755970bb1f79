"""`PointMotion`: points on a face, as a tracker finds them in the pictures of a film."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np

from fba.arrays import Bool, Float64
from fba.errors import ModelError
from fba.sampling import find_gaps
from fba.tracks import freeze

MAX_COORDINATE = 1e7
"""Largest coordinate; more is damage."""


@dataclass(frozen=True, eq=False)
class PointMotion:
    """Tracked points at the source's own times.

    positions: float64 (T, N, 2) or (T, N, 3), NaN where no face was seen. x points to the right in the
    picture, y down, z away from the camera. N, which must be in `COUNTS`, says what each point is. metric:
    whether positions are metres in the camera's axes; otherwise they are in units of the picture. share:
    whether x and z are shares of the picture's width and y of its height, whose ratio is `aspect`, width /
    height; None where unknown. times: float64 (T,), seconds, increasing. rate: nominal frames per second.
    eyes: float64 (T, 4), radians, as FAPs 23 to 26, or None. start: time of day of the first row, in seconds;
    None where unknown. name: of the performance. findings: what a reader repaired or found odd, a sentence
    each.

    Arrays are read-only copies. Raises ModelError if the parts contradict each other.
    """

    COUNTS: ClassVar = (68, 70, 468, 478)
    """Numbers of points of known trackers: iBUG's 68 (dlib, OpenFace, 300-W), OpenPose's 70, MediaPipe's."""
    OTHER_TRACKERS: ClassVar = {
        5: "RetinaFace and MTCNN", 17: "one half of a face's outline", 21: "AFLW", 29: "COFW", 49: "SDM",
        51: "iBUG's 68 without the outline", 66: "IntraFace and CLM", 98: "WFLW",
        106: "JD-landmark, InsightFace", 194: "HELEN", 543: "MediaPipe Holistic, a face of which is 468",
        553: "MediaPipe Holistic",
    }  # fmt: skip
    """Other numbers of points on a face, and who uses them."""

    positions: Float64
    times: Float64
    rate: Fraction
    metric: bool = False
    share: bool = False
    aspect: float | None = None
    eyes: Float64 | None = None
    start: float | None = None
    name: str = ""
    findings: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        positions = np.array(self.positions, dtype=np.float64)
        times = np.array(self.times, dtype=np.float64)
        if positions.ndim != 3 or positions.shape[2] not in (2, 3) or times.shape != positions.shape[:1]:
            raise ModelError(
                f"PointMotion: positions (T, N, 2 or 3) and times (T,) do not fit: {positions.shape} and "
                f"{times.shape}"
            )
        self.check_count(positions.shape[1])
        freeze(self, rate=Fraction(self.rate))
        if self.rate <= 0:
            raise ModelError(f"PointMotion: the rate must be positive, not {self.rate}")
        if len(times) and not (np.isfinite(times).all() and (np.diff(times) > 0).all()):
            raise ModelError("PointMotion: times must be finite, and each later than the one before")
        if self.aspect is not None and not 0.1 <= self.aspect <= 10:
            raise ModelError(f"a picture {self.aspect:g} times as wide as high is impossible")
        positions[np.isnan(positions).any(axis=2)] = np.nan
        if (np.abs(positions) > MAX_COORDINATE).any():
            frame, point, axis = np.argwhere(np.abs(positions) > MAX_COORDINATE)[0].tolist()
            raise ModelError(f"frame {frame}: point {point} is at {positions[frame, point, axis]:g}")
        eyes = None if self.eyes is None else np.array(self.eyes, dtype=np.float64)
        if eyes is not None and eyes.shape != (len(times), 4):
            raise ModelError(f"PointMotion: eyes have shape {eyes.shape}, not ({len(times)}, 4)")
        freeze(self, positions=positions, times=times, eyes=eyes)

    def __len__(self) -> int:
        return len(self.times)

    @property
    def count(self) -> int:
        """Number of points in a frame."""
        return int(self.positions.shape[1])

    @property
    def flat(self) -> bool:
        """Whether the points have no depth."""
        return bool(self.positions.shape[2] == 2)

    @property
    def seen(self) -> Bool:
        """Frames (T,) in which a face was seen: more than half of its points are there."""
        share: Float64 = np.isnan(self.positions[..., 0]).mean(axis=1)
        return share < 0.5

    def describe(self) -> dict[str, Any]:
        """Return what is in the capture, for `fba info`: plain numbers, texts and lists of them."""
        seen = self.seen
        gaps = find_gaps(self.times[seen], self.rate)
        depth = "none" if self.flat else "metres" if self.metric else "relative"
        return {
            "kind": "points",
            "rows": len(self),
            "unseen": int((~seen).sum()),
            "seconds": round(float(self.times[-1] - self.times[0]), 6) if len(self) else 0.0,
            "rate": str(self.rate),
            "start": self.start,
            "points": self.count,
            "depth": depth,
            "gaps": [[round(start, 3), round(length, 3)] for start, length in gaps],
            "findings": list(self.findings),
        }

    @classmethod
    def check_count(cls, count: int) -> None:
        """Raise ModelError for a number of points that no known tracker finds."""
        if count in cls.COUNTS:
            return
        whose = f", as those of {cls.OTHER_TRACKERS[count]}" if count in cls.OTHER_TRACKERS else ""
        known = ", ".join(map(str, cls.COUNTS[:-1]))
        raise ModelError(
            f"{count} points on a face{whose}: nobody says here what each of them is; sets of {known} and "
            f"{cls.COUNTS[-1]} points are known (iBUG's 68, OpenPose's 70, MediaPipe's)"
        )
