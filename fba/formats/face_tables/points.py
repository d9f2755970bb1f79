"""Read points that a tracker found on a face: tables, JSON, NumPy's arrays. The content tells which it is."""

from __future__ import annotations

from fractions import Fraction

from fba.animation import Animation
from fba.capture.points import PointMotion
from fba.choices import Gaze
from fba.formats.face_tables import points_arrays, points_csv, points_json
from fba.formats.face_tables._points import Neutral, points_to_animation
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, read_head

READERS = (points_arrays, points_json, points_csv)


def sniff(head: bytes, suffix: str) -> bool:
    """Whether a file that begins like this holds points of a face."""
    return any(reader.sniff(head, suffix) for reader in READERS)


def read(
    path: Path,
    *,
    rate: Fraction | int | str | None = None,
    source_rate: Fraction | int | str | None = None,
    face: str | None = None,
    markers: dict[str, str] | None = None,
    neutral: Neutral = "auto",
    gaze: Gaze = "none",
    head_path: bool = True,
    aspect: float | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Return a tracked face as FAPs, at `rate` or at the rate of its own times.

    source_rate, face: as for `read_points`; the others: as for `fba.capture.points.from_points`. Warns
    (FbaWarning) of what is odd. Raises FormatError, LimitError.
    """
    motion = read_points(path, source_rate=source_rate, face=face, limits=limits)
    return points_to_animation(
        motion, rate, path, limits, markers=markers, neutral=neutral, gaze=gaze, head_path=head_path,
        aspect=aspect,
    )  # fmt: skip


def read_points(
    path: Path,
    *,
    source_rate: Fraction | int | str | None = None,
    face: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> PointMotion:
    """Return the points as they are in a file.

    source_rate: frames in a second, for files without times. face: the name or number of the face to read,
    where there are several. Raises FormatError, LimitError.
    """
    head = read_head(path)
    if points_arrays.sniff(head, ""):
        return points_arrays.read_points(path, source_rate=source_rate, face=face, limits=limits)
    if points_json.sniff(head, ""):
        return points_json.read_points(path, source_rate=source_rate, face=face, limits=limits)
    return points_csv.read_points(path, source_rate=source_rate, face=face, limits=limits)
