"""Read NumPy arrays (.npy, .npz) with the points that a tracker found on a face.

An array is (frames, points, 2 or 3), or (frames, faces, points, 2 or 3), or has a row of coordinates for each
frame. Of several arrays in a file, the first with as many points as a tracker has is read. Times, rate and
size of the picture are further arrays: `times` or `timestamps`, `fps`, `width` and `height`.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from fba.arrays import Float64
from fba.capture import PointMotion
from fba.errors import FormatError, Remedy
from fba.formats.face_tables._points import build_points
from fba.formats.face_tables._tables import regular_seconds
from fba.formats.text.frame_rates import Rate
from fba.formats.zip_files import NPY, ZIP, read_arrays
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, naming_file

NAMES = (
    "landmarks", "landmark", "face_landmarks", "landmarks68", "landmarks_68", "landmarks478", "points", "pts",
    "keypoints", "face", "faces", "lms", "lmks", "lm", "coords", "preds", "positions", "data", "arr_0",
)  # fmt: skip
"""Names under which programs save points."""
TIMES = ("times", "timestamps", "timestamp", "time", "t")
RATES = ("fps", "rate", "frame_rate", "video_fps")
SINGLE = "points"


def sniff(head: bytes, suffix: str) -> bool:
    """Whether a file with this beginning is an array, or an archive of arrays with points among them."""
    in_archive = head.startswith(ZIP) and any(b"%s.npy" % name.encode() in head for name in NAMES)
    return in_archive or head.startswith(NPY)


def read_points(
    path: Path, *, source_rate: Rate | None = None, face: str | None = None, limits: Limits = DEFAULT_LIMITS
) -> PointMotion:
    """Return the points in an array; options and errors as for `_tracked_points.read_points`."""
    arrays = read_arrays(path, limits, single=SINGLE)
    positions = _choose(arrays, path, face)
    limits.check_frames(len(positions), f"{path}: the recording")
    times, rate = _times(arrays, len(positions), source_rate, path)
    width, height = (_number(arrays, name) for name in ("width", "height"))
    return build_points(
        positions, times, rate, path=path,
        aspect=width / height if width and height else None,
    )  # fmt: skip


def _choose(arrays: dict[str, Any], path: Path, face: str | None) -> Float64:
    """Return the points (T, N, 2 or 3) among arrays."""
    shapes = {}
    order = [*(name for name in NAMES if name in arrays), *arrays]
    for name in dict.fromkeys(order):
        points = _as_points(arrays[name])
        if points is not None and points.shape[2] in PointMotion.COUNTS:
            faces = points.shape[1]
            if faces > 1 and face is None:
                raise FormatError(f"has {faces} faces", path=path).with_remedies(
                    Remedy("face", "choose one with {}", "'0'")
                )
            number = int(face) if face is not None and face.isdigit() else 0
            if face is not None and not (face.isdigit() and number < faces):
                raise FormatError(f"has no face {face!r}; there are 0 to {faces - 1}", path=path)
            return points[:, number]
        shapes[name] = arrays[name].shape
        if points is not None and points.shape[2] in PointMotion.OTHER_TRACKERS:
            with naming_file(path):
                PointMotion.check_count(points.shape[2])
    listed = ", ".join(f"{name} {shape}" for name, shape in list(shapes.items())[:6]) or "none of numbers"
    raise FormatError(
        f"no array has points of a face, (frames, {' or '.join(map(str, PointMotion.COUNTS))}, 2 or 3), "
        f"but {listed}",
        path=path,
    )


def _as_points(array: Any) -> Float64 | None:
    """Return an array as points (T, faces, N, 2 or 3); None for other shapes."""
    if array.ndim == 4 and array.shape[3] in (2, 3):
        return np.asarray(array)
    if array.ndim == 3 and array.shape[2] in (2, 3):
        return np.asarray(array[:, None])
    if array.ndim == 3 and array.shape[1] in (2, 3):
        return np.asarray(array.swapaxes(1, 2)[:, None])
    if array.ndim == 2 and array.shape[1] in (2, 3):
        return np.asarray(array[None, None])
    if array.ndim == 2:
        for width in (3, 2):
            if array.shape[1] % width == 0 and array.shape[1] // width in PointMotion.COUNTS:
                return np.asarray(array.reshape(len(array), 1, -1, width))
    return None


def _times(
    arrays: dict[str, Any], count: int, source_rate: Rate | None, path: Path
) -> tuple[Float64, Fraction]:
    """Return times (T,) in seconds from the first frame, and the nominal rate."""
    stored = next(
        (arrays[name].ravel() for name in TIMES if name in arrays and arrays[name].size == count), None
    )
    if stored is not None and count > 1 and np.isfinite(stored).all():
        return regular_seconds(stored, list(range(1, count + 1)), path)
    rate = next((stated for name in RATES if (stated := _number(arrays, name))), None)
    if source_rate is None and rate is None and count > 1:
        raise FormatError("has no times", path=path).with_remedies(
            Remedy("source_rate", "give the frame rate of the film with {}", "30")
        )
    chosen = Fraction(rate or 30).limit_denominator(1001) if source_rate is None else Fraction(source_rate)
    return np.arange(count) / float(chosen), chosen


def _number(arrays: dict[str, Any], name: str) -> float:
    """Return a single positive number of a file; 0 without it."""
    array = arrays.get(name)
    return float(array.ravel()[0]) if array is not None and array.size == 1 and array.ravel()[0] > 0 else 0.0
