"""Read points that a tracker found on a face: tables, JSON, NumPy's arrays. The content tells which it is."""

from __future__ import annotations

from fractions import Fraction

from fba.capture import PointMotion
from fba.formats.face_tables import _points_arrays as points_arrays
from fba.formats.face_tables import _points_csv as points_csv
from fba.formats.face_tables import _points_json as points_json
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, read_head

READERS = (points_arrays, points_json, points_csv)


def sniff(head: bytes, suffix: str) -> bool:
    """Whether a file that begins like this holds points of a face."""
    return any(reader.sniff(head, suffix) for reader in READERS)


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
