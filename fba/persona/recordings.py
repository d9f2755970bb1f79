"""Files of tracked points: those of any tracker that is known, and a tracker's own 64 points in NumPy's
archives."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from fba.arrays import Array, Float64
from fba.atomic import atomic
from fba.capture.points import PointMotion
from fba.errors import FormatError, ModelError
from fba.formats.numpy_archives import ZIP, read_arrays
from fba.formats.registry import format_of
from fba.limits import DEFAULT_LIMITS, Limits
from fba.persona.points import TrackedFace, from_point_motion
from fba.persona.points.layout import TRACKED
from fba.source import Path, naming_file, read_head

POINTS, ANGLES, SEEN, RATE = "points", "angles", "tracked", "fps"
"""Arrays of an archive: (T, 64, 2), (T, 3), (T,), and one number. The last three may be missing."""
USUAL_RATE = 30
MOST_RATE = 10_000


def read_recording(
    path: Path,
    *,
    source_rate: Fraction | None = None,
    face: str | None = None,
    aspect: float | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> TrackedFace:
    """Return what a tracker saw, from a file of points.

    Any file of 68, 70, 468 or 478 points that `fba.read` reads, or an archive of NumPy (.npz) with `points`,
    64 of them, and perhaps `angles`, radians, `tracked` and `fps`. source_rate: for files that do not say it.
    face: which, where there are several. Raises FormatError, LimitError.
    """
    if read_head(path).startswith(ZIP):
        arrays = read_arrays(path, limits, single=POINTS)
        points = arrays.get(POINTS)
        if points is not None and points.ndim == 3 and points.shape[1:] == (TRACKED, 2):
            return _tracked(arrays, path, source_rate)
    reader = format_of(path)
    if reader.read_face is None:
        raise FormatError(f"is no file of tracked points, but {reader.description}", path=path)
    given = {"source_rate": source_rate, "face": face}
    known = {
        name: value for name, value in given.items() if value is not None and name in reader.face_options
    }
    motion = reader.read_face(path, limits=limits, **known)
    if not isinstance(motion, PointMotion):
        raise FormatError(
            "is no file of tracked points: a Persona is learnt from points of a film", path=path
        )
    with naming_file(path):
        return from_point_motion(motion, aspect=aspect)


def write_recording(path: Path, face: TrackedFace) -> None:
    """Write 64 points as an archive of NumPy, atomically. Frames are taken to be evenly spaced."""
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
        told = arrays.get(RATE, np.array(float(USUAL_RATE)))
        if told.size != 1 or not 0 < float(told.reshape(())) <= MOST_RATE:
            raise FormatError(f"{RATE} must be one number of frames in a second", path=path)
        rate = Fraction(float(told.reshape(()))).limit_denominator(1001)
    angles = arrays.get(ANGLES, np.zeros((count, 3)))
    seen = arrays.get(SEEN, np.ones(count))
    try:
        return TrackedFace(
            arrays[POINTS], angles, np.isfinite(seen) & (seen > 0), np.arange(count) / float(rate), rate
        )
    except ModelError as error:
        raise FormatError(error.finding, path=path) from error
