"""Files of tracked points: those that `fba.read` reads, and NumPy archives of a Persona's 64 points."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from fba.arrays import Array, Float64
from fba.atomic import atomic
from fba.capture import PointMotion
from fba.errors import FormatError, ModelError
from fba.formats import format_of
from fba.formats.zip_files import ZIP, read_arrays
from fba.limits import DEFAULT_LIMITS, Limits
from fba.persona.points import TrackedFace, from_point_motion
from fba.persona.points.layout import TRACKED
from fba.source import Path, naming_file, read_head

# Arrays of an archive; all but the points may be missing.
POINTS = "points"  # (T, 64, 2)
ANGLES = "angles"  # (T, 3)
SEEN = "tracked"  # (T,)
RATE = "fps"  # a number
DEFAULT_RATE = 30
MAX_RATE = 10_000


def read_recording(
    path: Path,
    *,
    source_rate: Fraction | None = None,
    face: str | None = None,
    aspect: float | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> TrackedFace:
    """Return the tracked face in a file of points.

    It is any file of 68, 70, 468 or 478 points that `fba.read` reads, or a NumPy archive (.npz) with 64
    `points` and optionally `angles` (radians), `tracked` and `fps`. source_rate: for files without a rate.
    face: which of several faces. Raises FormatError, LimitError.
    """
    if read_head(path).startswith(ZIP):
        arrays = read_arrays(path, limits, single=POINTS)
        points = arrays.get(POINTS)
        if points is not None and points.ndim == 3 and points.shape[1:] == (TRACKED, 2):
            return _tracked(arrays, path, source_rate)
    reader = format_of(path)
    if reader.read_face is None:
        raise FormatError(f"is not a file of tracked points, but {reader.description}", path=path)
    given = {"source_rate": source_rate, "face": face}
    options = {
        name: value for name, value in given.items() if value is not None and name in reader.face_options
    }
    motion = reader.read_face(path, limits=limits, **options)
    if not isinstance(motion, PointMotion):
        raise FormatError(
            "is not a file of tracked points: a Persona is learnt from points of a film", path=path
        )
    with naming_file(path):
        return from_point_motion(motion, aspect=aspect)


def write_recording(path: Path, face: TrackedFace) -> None:
    """Write the 64 points as a NumPy archive, atomically, with the rate in place of times."""
    arrays: dict[str, Array] = {
        POINTS: face.points.astype(np.float32),
        ANGLES: face.angles.astype(np.float32),
        SEEN: face.tracked.astype(np.uint8),
        RATE: np.array(float(face.rate)),
    }
    with atomic(path) as file:
        np.savez_compressed(file, allow_pickle=False, **arrays)


def _tracked(arrays: dict[str, Float64], path: Path, source_rate: Fraction | None) -> TrackedFace:
    count = len(arrays[POINTS])
    rate = source_rate
    if rate is None:
        given = arrays.get(RATE, np.array(float(DEFAULT_RATE)))
        if given.size != 1 or not 0 < float(given.reshape(())) <= MAX_RATE:
            raise FormatError(f"{RATE} must be one number of frames in a second", path=path)
        rate = Fraction(float(given.reshape(()))).limit_denominator(1001)
    angles = arrays.get(ANGLES, np.zeros((count, 3)))
    seen = arrays.get(SEEN, np.ones(count))
    try:
        return TrackedFace(
            arrays[POINTS], angles, np.isfinite(seen) & (seen > 0), np.arange(count) / float(rate), rate
        )
    except ModelError as error:
        raise FormatError(error.finding, path=path) from error
