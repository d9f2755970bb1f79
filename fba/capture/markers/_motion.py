"""`MarkerMotion`: captured motion of named points from a file of any format."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

import numpy as np

from fba.arrays import Bool, Float64
from fba.capture.markers._gaps import find_gaps
from fba.choices import FileUpAxis
from fba.errors import ModelError
from fba.tracks import freeze

MAX_COORDINATE = 1e6
"""Largest coordinate, metres; more is damage."""


@dataclass(frozen=True, eq=False)
class MarkerMotion:
    """Motion of points, in metres, in the axes of the source.

    names: M names, each once. positions: float64 (T, M, 3), metres, NaN where a marker was not seen.
    times: float64 (T,), seconds, rising. rate: nominal frames per second. unit: the unit of length in the
    file; "" if it does not say. up: the axis that the file says is up, such as "+y"; "" if it does not say.
    name: of the performance. start: time of day of the first frame, in seconds; None where the file does not
    say.

    Arrays are read-only copies. Raises ModelError if the parts contradict each other, times do not rise, or
    a coordinate is infinite or beyond a million metres.
    """

    MAX_MARKERS: ClassVar = 2000
    """More markers are damage. Captures of faces have hundreds of them, those of crowds a thousand."""

    names: tuple[str, ...]
    positions: Float64
    times: Float64
    rate: Fraction
    unit: str = ""
    up: FileUpAxis = ""
    name: str = ""
    start: float | None = None

    def __post_init__(self) -> None:
        positions = np.array(self.positions, dtype=np.float64)
        times = np.array(self.times, dtype=np.float64)
        count = len(self.names)
        if positions.ndim != 3 or positions.shape[1:] != (count, 3) or times.shape != positions.shape[:1]:
            raise ModelError(
                f"MarkerMotion: {count} names need positions (T, {count}, 3) and times (T,), not "
                f"{positions.shape} and {times.shape}"
            )
        if not 0 < count <= self.MAX_MARKERS:
            raise ModelError(f"a capture needs 1 to {self.MAX_MARKERS} markers, not {count}")
        if len(set(self.names)) != count:
            twice = next(name for name in self.names if self.names.count(name) > 1)
            raise ModelError(f"two markers are called {twice!r}")
        freeze(self, rate=Fraction(self.rate))
        if self.rate <= 0:
            raise ModelError(f"the frame rate must be positive, not {self.rate}")
        if not np.isfinite(times).all():
            raise ModelError(f"the time of frame {int(np.argmin(np.isfinite(times)))} is not a number")
        steps = np.diff(times)
        if len(steps) and steps.min() <= 0:
            frame = int(np.argmin(steps > 0)) + 1
            raise ModelError(
                f"time runs backwards: frame {frame} is at {times[frame]:g} s, the one before it at "
                f"{times[frame - 1]:g} s"
            )
        # a marker is seen with all three coordinates, or not at all
        positions[np.isnan(positions).any(axis=2)] = np.nan
        beyond = np.abs(positions) > MAX_COORDINATE
        if beyond.any():
            frame, marker, axis = (int(index) for index in np.argwhere(beyond)[0])
            raise ModelError(
                f"marker {self.names[marker]!r} is at {positions[frame, marker, axis]:g} m in frame {frame}"
            )
        freeze(self, positions=positions, times=times)

    def __len__(self) -> int:
        return len(self.positions)

    def describe(self) -> dict[str, Any]:
        """Return what is in the capture, for `fba info`: plain numbers, texts and lists of them.

        unit, up: "" where the file has none. gaps: their number. missing: share of all positions. longest:
        seconds of the longest gap.
        """
        seen = self.seen
        gaps = [
            ((end - start) / float(self.rate), self.names[marker])
            for marker in np.flatnonzero(~seen.all(axis=0))
            for start, end in find_gaps(seen[:, marker])
        ]
        longest, whose = max(gaps, key=lambda gap: gap[0], default=(0.0, ""))
        return {
            "kind": "markers",
            "markers": list(self.names),
            "frames": len(self),
            "rate": str(self.rate),
            "seconds": self.duration,
            "start": self.start,
            "unit": self.unit,
            "up": self.up,
            "gaps": len(gaps),
            "missing": float(1 - seen.mean()) if seen.size else 0.0,
            "longest": longest,
            "longest_marker": whose,
        }

    @property
    def seen(self) -> Bool:
        """Whether each marker was seen in each frame: bool (T, M)."""
        return ~np.isnan(self.positions[..., 0])

    @property
    def duration(self) -> float:
        """Seconds from the first frame to the end of the last."""
        return float(self.times[-1] - self.times[0] + 1 / self.rate) if len(self) else 0.0
