"""From a reader of markers to a reader of animations."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from fractions import Fraction

from fba.animation import Animation
from fba.capture.markers.faces import from_markers
from fba.capture.markers.motion import MarkerMotion
from fba.choices import Gaze
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, naming_file


def read_face(
    read_markers: Callable[..., MarkerMotion],
    path: Path,
    *,
    source_rate: Fraction | int | str | None = None,
    rate: Fraction | int | str | None = None,
    markers: Mapping[str, str] | None = None,
    neutral: str | int | tuple[float, float] = "auto",
    gaze: Gaze = "none",
    head_path: bool = True,
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Return the FAPs of a face with markers, and its head's path as BAPs; see `fba.capture.from_markers`.

    source_rate: the rate of a file that has none. Raises FormatError for anything that is not what the reader
    reads, or holds no face; LimitError. Warns (FbaWarning) of what was repaired.
    """
    motion = read_markers(
        path, source_rate=None if source_rate is None else Fraction(source_rate), limits=limits
    )
    with naming_file(path):
        return from_markers(
            motion, rate, markers=markers, neutral=neutral, gaze=gaze, head_path=head_path, limits=limits
        )
