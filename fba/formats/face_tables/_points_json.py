"""Read JSON with the points that a tracker found on a face, as programs save it from MediaPipe and OpenPose.

A file is a list of frames, or an object with such a list, or a frame on each line. The points of a frame are
a list of `{"x": , "y": , "z": }`, of `[x, y, z]`, or of numbers; OpenPose adds a confidence to each x and y.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import numpy as np

from fba.arrays import Float64
from fba.capture import PointMotion
from fba.errors import FormatError, Remedy
from fba.formats.face_tables._points import build_points
from fba.formats.face_tables._shapes_json import frame_time, frame_times, read_json
from fba.formats.text.frame_rates import Rate
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, naming_file, read_whole

OPENPOSE = "face_keypoints_2d"
"""OpenPose's x, y, confidence, x, ...; all 0 without a face."""
WORDS = (
    b'"facelandmarks"', b'"face_landmarks"', b'"facelandmark"', b'"multi_face_landmarks"', b'"landmarks"',
    b'"face_keypoints_2d"', b'"keypoints"', b'"points"', b'"landmark"', b'"scaledmesh"',
)  # fmt: skip
"""Names in files with points, in lower case."""
BEGINNINGS = (b"[[[", b'[[{"x"', b'[{"x"', b'{"0":[')
"""Beginnings of files without such names, apart from blanks."""
LISTS = ("frames", "results", "data", "records", "samples")
MIN_POINTS = 5
"""Smallest number of points in a list of points."""
MAX_DEPTH = 6
"""Levels of lists and objects that are searched."""
VALUE_BYTES = 80
"""Memory of a value while it is read."""


def sniff(head: bytes, suffix: str) -> bool:
    """Whether a file begins like JSON with points."""
    start = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if start[:1] not in (b"{", b"["):
        return False
    small = head.lower()
    packed = b"".join(start[:400].lower().split())
    return any(word in small for word in WORDS) or packed.startswith(BEGINNINGS)


def read_points(
    path: Path, *, source_rate: Rate | None = None, face: str | None = None, limits: Limits = DEFAULT_LIMITS
) -> PointMotion:
    """Return the points in a file; options and errors as for `_tracked_points.read_points`."""
    document = _read(path, limits)
    frames = _frames(document)
    limits.check_frames(len(frames), f"{path}: the recording")
    faces = [list(_point_sets(frame, MAX_DEPTH)) for frame in frames]
    sets = [_choose(found, number, face, path) for number, found in enumerate(faces)]
    known = [one for one in sets if one is not None]
    if not known:
        raise FormatError("holds no frame with points of a face", path=path)
    shape = max((one.shape for one in known), key=lambda each: sum(one.shape == each for one in known))
    with naming_file(path):
        PointMotion.check_count(shape[0])
    positions = np.full((len(frames), *shape), np.nan)
    for number, one in enumerate(sets):
        if one is None:
            continue
        if one.shape[0] != shape[0]:
            raise FormatError(f"frame {number} has {one.shape[0]} points, and others {shape[0]}", path=path)
        positions[number, :, : one.shape[1]] = one[:, : shape[1]]
    stated = document.get("fps") if isinstance(document, dict) else None
    if source_rate is None and isinstance(stated, int | float) and 0 < stated < 10_000:
        source_rate = Fraction(stated).limit_denominator(1001)
    if source_rate is None and len(frames) == 1:
        source_rate = 30
    times, rate = frame_times([frame_time(frame) for frame in frames], len(frames), source_rate, path)
    return build_points(positions, times, rate, path=path, aspect=_aspect(document, frames))


def _read(path: Path, limits: Limits) -> Any:
    """Return the document in a file; of a file with a document on each line, the list of documents."""
    data = read_whole(path)
    first, _, rest = data.lstrip().partition(b"\n")
    if rest.strip()[:1] in (b"{", b"[") and first.rstrip()[-1:] in (b"}", b"]"):
        values = data.count(b",") + data.count(b"[") + data.count(b"{")
        limits.check_bytes(VALUE_BYTES * values, f"{path}: the recording", source=len(data))
        documents = []
        for number, line in enumerate(data.splitlines(), 1):
            if line.strip():
                try:
                    documents.append(json.loads(line))
                except (ValueError, RecursionError) as error:
                    raise FormatError(f"is no complete JSON: {error}", path=path, line=number) from error
        return documents
    return read_json(path, limits)


def _frames(document: Any) -> list[Any]:
    """Return the frames in a document: those of a list in it, else the document as a single frame."""
    if isinstance(document, dict):
        for name in LISTS:
            if isinstance(document.get(name), list):
                return list(document[name])
        if document and all(name.isdigit() for name in document):
            return [document[name] for name in sorted(document, key=int)]
        lists = [value for value in document.values() if isinstance(value, list) and len(value) > 1]
        for value in lists:
            if _as_points(value) is None and any(_has_points(one) for one in value[:100]):
                return value
        return [document]
    if isinstance(document, list) and _as_points(document) is None:
        return document
    return [document]


def _has_points(frame: Any) -> bool:
    return next(_point_sets(frame, MAX_DEPTH), None) is not None


def _point_sets(value: Any, levels: int) -> Iterator[Float64]:
    """Yield all sets of points (N, 2 or 3) in a value."""
    if levels < 0:
        return
    if isinstance(value, dict):
        if isinstance(value.get(OPENPOSE), list):
            flat = np.array(_numbers(value[OPENPOSE]), dtype=np.float64)
            if len(flat) and len(flat) % 3 == 0:
                points = flat.reshape(-1, 3)
                if (points[:, 2] > 0).any():
                    yield np.where(points[:, 2:] > 0, points[:, :2], np.nan)
            return
        parts = list(value.values())
    elif (points := _as_points(value)) is not None:
        yield points
        return
    else:
        parts = value if isinstance(value, list) else []
    for part in parts:
        yield from _point_sets(part, levels - 1)


def _as_points(value: Any) -> Any:
    """Return a list as points (N, 2 or 3); None for other lists."""
    if not isinstance(value, list) or len(value) < MIN_POINTS:
        return None
    first = value[0]
    if isinstance(first, dict) and {"x", "y"} <= set(first):
        axes = ("x", "y", "z") if "z" in first else ("x", "y")
        if all(isinstance(one, dict) for one in value):
            return np.array([_numbers([one.get(axis) for axis in axes]) for one in value])
        return None
    if isinstance(first, list) and len(first) in (2, 3) and _is_number(first[0]):
        if all(isinstance(one, list) and len(one) == len(first) for one in value):
            return np.array([_numbers(one) for one in value])
        return None
    if _is_number(first) and all(map(_is_number, value)):
        for width in (3, 2):
            if len(value) % width == 0 and len(value) // width in PointMotion.COUNTS:
                return np.array(_numbers(value)).reshape(-1, width)
    return None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _numbers(values: list[Any]) -> list[float]:
    """Return numbers; NaN for what is not a number, or too large."""
    return [float(one) if _is_number(one) and abs(one) < 1e300 else float("nan") for one in values]


def _choose(found: list[Float64], number: int, face: str | None, path: Path) -> Float64 | None:
    """Return the points of one face among those of a frame; None if it is absent."""
    known = [one for one in found if len(one) in PointMotion.COUNTS]
    if not known:
        return max(found, key=len) if found else None
    if face is not None:
        if not face.isdigit():
            raise FormatError(f"has no face {face!r}; faces are numbered from 0", path=path)
        return known[int(face)] if int(face) < len(known) else None
    if len(known) > 1:
        raise FormatError(f"frame {number} has {len(known)} faces", path=path).with_remedies(
            Remedy("face", "choose one with {}", "'0'")
        )
    return known[0]


def _aspect(document: Any, frames: list[Any]) -> float | None:
    """Return width / height of the picture, if the file says it."""
    for holder in (document, frames[0]):
        if isinstance(holder, dict):
            width, height = (holder.get(name, holder.get(f"image_{name}")) for name in ("width", "height"))
            if isinstance(width, int | float) and isinstance(height, int | float) and width > 0 < height:
                return float(width / height)
    return None
