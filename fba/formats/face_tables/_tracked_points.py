"""Read points that a tracker found on a face, in tables, JSON or NumPy's arrays, as the content tells."""

from __future__ import annotations

from fba.capture import PointMotion
from fba.formats.face_tables import _points_arrays as points_arrays
from fba.formats.face_tables import _points_csv as points_csv
from fba.formats.face_tables import _points_json as points_json
from fba.formats.text.frame_rates import Rate
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, read_head

READERS = (points_arrays, points_json, points_csv)


def sniff(head: bytes, suffix: str) -> bool:
    """Whether a file with this beginning holds points of a face."""
    return any(reader.sniff(head, suffix) for reader in READERS)


def read_points(
    path: Path,
    *,
    source_rate: Rate | None = None,
    face: str | None = None,
    pixels: bool = False,
    limits: Limits = DEFAULT_LIMITS,
) -> PointMotion:
    """Return the points as they are in a file.

    source_rate: frames per second, for files without times. face: the name or number of the face to read, if
    there are several. pixels: take these, not millimetres, from a table with both. Raises FormatError,
    LimitError.
    """
    head = read_head(path)
    if points_arrays.sniff(head, ""):
        return points_arrays.read_points(path, source_rate=source_rate, face=face, limits=limits)
    if points_json.sniff(head, ""):
        return points_json.read_points(path, source_rate=source_rate, face=face, limits=limits)
    return points_csv.read_points(path, source_rate=source_rate, face=face, pixels=pixels, limits=limits)
