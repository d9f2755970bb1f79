"""Read blendshapes in JSON: recordings of BEAT, and scores that programs save from MediaPipe.

BEAT writes `{"names": [...], "frames": [{"weights": [...], "time": seconds}, ...]}`. Programs save
MediaPipe's results as a list of frames, or an object with such a list. A frame has a time and, anywhere in
it, a list of `{"categoryName": "jawOpen", "score": 0.1}` or an object `{"jawOpen": 0.1, ...}`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from fba.arrays import Float64
from fba.capture import ShapeMotion
from fba.errors import FormatError, Remedy
from fba.face import arkit_names
from fba.formats.face_tables._tables import named, seconds_of
from fba.formats.face_tables.shape_weights import check_weights, find_lacks, shape_of
from fba.formats.text.frame_rates import Rate
from fba.limits import DEFAULT_LIMITS, Limits
from fba.name_maps import key_of
from fba.sampling import find_rate
from fba.source import Path, naming_file, read_whole, stem_of

MIN_SHAPES = 5
"""Fewest synonyms of ARKit's names in a set of blendshapes; one of ARKit's own names is enough."""
CATEGORIES = ("categoryName", "category_name", "displayName", "name")
SCORES = ("score", "value", "weight")
TIMES = ("time", "timestamp", "timestampms", "timems", "timestampseconds", "seconds", "t", "ts")
UNMENTIONED = (*TIMES, "neutral", "frame", "index", "id")
"""Names of numbers beside shapes that no finding mentions, in lower case, without other signs."""
LISTS = ("frames", "results", "data", "records", "samples", "blendshapes")
MAX_DEPTH = 6
"""Levels of lists and objects in a frame that are searched."""
VALUE_BYTES = 60
"""Memory of a value while it is read."""
MAX_PARTS = 64
"""Longest list in a frame that may be a face; longer lists are points."""


def sniff(head: bytes, suffix: str) -> bool:
    """Whether a file begins like JSON and names shapes of ARKit."""
    if head.removeprefix(b"\xef\xbb\xbf").lstrip()[:1] not in (b"{", b"["):
        return False
    small = head.lower()
    return any(f'"{name.lower()}"'.encode() in small for name in arkit_names())


def read_face(path: Path, *, source_rate: Rate | None = None, limits: Limits = DEFAULT_LIMITS) -> ShapeMotion:
    """Return weights as they are in the file.

    source_rate: frames per second, for files without times. A frame without scores has no face. Raises
    FormatError, LimitError.
    """
    document = read_json(path, limits)
    names, weights, stamps, strange = _beat(document, path) or _frames(document, path)
    limits.check_frames(len(weights), f"{path}: the recording")
    check_weights(weights, names, path)
    times, rate = frame_times(stamps, len(weights), source_rate, path)
    odd = [f"names that mean nothing here are left out: {named(strange)}"] if strange else []
    return ShapeMotion(
        tuple(names), weights, times, rate, name=stem_of(path),
        findings=tuple(odd + find_lacks(names, weights, times, rate)),
    )  # fmt: skip


def read_json(path: Path, limits: Limits) -> Any:
    """Return the document in a file of JSON. Raises FormatError, LimitError."""
    data = read_whole(path)
    values = data.count(b",") + data.count(b"[") + data.count(b"{")
    limits.check_bytes(VALUE_BYTES * values, f"{path}: the recording", source=len(data))
    try:
        return json.loads(data)
    except json.JSONDecodeError as error:
        raise FormatError(
            f"is no complete JSON: {error.msg.lower()}", path=path, line=error.lineno
        ) from error
    except (UnicodeDecodeError, RecursionError, ValueError) as error:
        raise FormatError(f"is no JSON that can be read: {error}", path=path) from error


def _beat(document: Any, path: Path) -> tuple[list[str], Float64, list[Any], list[str]] | None:
    """Return names, weights (T, N), times and unknown names of BEAT's layout; None for other layouts."""
    if not (isinstance(document, dict) and isinstance(document.get("names"), list)):
        return None
    frames = document.get("frames")
    if not isinstance(frames, list) or not frames:
        raise FormatError("has names of shapes, but no frames", path=path)
    names = [shape_of(name) if isinstance(name, str) else None for name in document["names"]]
    columns = [column for column, name in enumerate(names) if name is not None]
    known = [name for name in names if name is not None]
    _check_names(known, path)
    rows, stamps = [], []
    for number, frame in enumerate(frames):
        row = frame.get("weights") if isinstance(frame, dict) else None
        if not isinstance(row, list) or len(row) != len(names):
            found = len(row) if isinstance(row, list) else "no"
            raise FormatError(
                f"frame {number} has {found} weights, and there are {len(names)} names", path=path
            )
        rows.append([_number(row[column], number, path) for column in columns])
        stamps.append(frame.get("time"))
    strange = [str(name) for name, shape in zip(document["names"], names, strict=True) if shape is None]
    return known, np.array(rows), stamps, strange


def _frames(document: Any, path: Path) -> tuple[list[str], Float64, list[Any], list[str]]:
    """Return names, weights (T, N), times and unknown names of a list of frames with scores."""
    frames = _list_of_frames(document)
    if frames is None:
        raise FormatError("holds no list of frames with scores of blendshapes", path=path)
    found, others = zip(*(next(_scores(frame, MAX_DEPTH), ({}, [])) for frame in frames), strict=True)
    names = list(dict.fromkeys(name for scores in found for name in scores))
    strange = list(dict.fromkeys(name for each in others for name in each if key_of(name) not in UNMENTIONED))
    _check_names(names, path)
    rows = [
        [_number(scores.get(name, np.nan), number, path) for name in names]
        for number, scores in enumerate(found)
    ]
    return names, np.array(rows), [frame_time(frame) for frame in frames], strange


def _list_of_frames(document: Any) -> list[Any] | None:
    """Return the list of frames that a document is, or that it has as a member; None without one."""
    candidates = [document]
    if isinstance(document, dict):
        candidates = [document[name] for name in LISTS if name in document]
        candidates += [value for value in document.values() if isinstance(value, list)]
    for frames in candidates:
        if isinstance(frames, list) and any(next(_scores(frame, MAX_DEPTH), None) for frame in frames[:100]):
            return frames
    return None


def _scores(value: Any, levels: int) -> Iterator[tuple[dict[str, Any], list[str]]]:
    """Yield all sets of scores in a value, by ARKit's names, with the names of other numbers beside them."""
    if levels < 0:
        return
    if isinstance(value, dict):
        direct = {
            shape: score for name, score in value.items()
            if not isinstance(score, dict | list | str) and (shape := shape_of(name)) is not None
        }  # fmt: skip
        if _are_enough(direct, value):
            yield (
                direct,
                [
                    name
                    for name, score in value.items()
                    if isinstance(score, int | float) and shape_of(name) is None
                ],
            )
            return
        parts = list(value.values())
    elif isinstance(value, list):
        pairs = (_category(entry) for entry in value)
        listed = {pair[0]: pair[1] for pair in pairs if pair is not None}
        if _are_enough(listed, listed):
            yield listed, []
            return
        parts = value if len(value) <= MAX_PARTS else []
    else:
        return
    for part in parts:
        yield from _scores(part, levels - 1)


def _are_enough(shapes: Mapping[str, Any], names: Iterable[str]) -> bool:
    """Whether shapes are those of a face: several, or one with ARKit's own name. names: as in the file."""
    return len(shapes) >= MIN_SHAPES or bool(shapes and set(arkit_names()).intersection(names))


def _category(entry: Any) -> tuple[str, Any] | None:
    """Return ARKit's name and the score of an entry {"categoryName": "jawOpen", "score": 0.1}, or None."""
    if not isinstance(entry, dict):
        return None
    name = next((entry[key] for key in CATEGORIES if isinstance(entry.get(key), str) and entry[key]), None)
    score = next((entry[key] for key in SCORES if key in entry), None)
    shape = None if name is None else shape_of(name)
    return None if shape is None or score is None else (shape, score)


def _check_names(names: list[str], path: Path) -> None:
    """Raise FormatError if there is no shape, or a shape is there twice."""
    if not names:
        raise FormatError("no shape has one of ARKit's names, such as jawOpen or eyeBlinkLeft", path=path)
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise FormatError(f"shapes come twice: {named(twice)}", path=path)


def _number(value: Any, frame: int, path: Path) -> float:
    if value is None:
        return float("nan")
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FormatError(f"frame {frame}: a weight is no number", path=path, token=repr(value))
    number = float(value) if abs(value) < 1e300 else float("nan")
    return number if np.isfinite(number) else float("nan")


def frame_time(frame: Any) -> Any:
    """Return the time of a frame, None if it has none."""
    if not isinstance(frame, dict):
        return None
    by_key = {key_of(name): value for name, value in frame.items()}
    return next((by_key[key] for key in TIMES if key in by_key), None)


def frame_times(
    stamps: list[Any], count: int, source_rate: Rate | None, path: Path
) -> tuple[Float64, Fraction]:
    """Return times (T,) in seconds from the first frame, and the nominal rate."""
    if all(stamp is None for stamp in stamps):
        if source_rate is None:
            raise FormatError("its frames have no times", path=path).with_remedies(
                Remedy("source_rate", "give their rate with {}", "30")
            )
        return np.arange(count) / float(Fraction(source_rate)), Fraction(source_rate)
    times = np.array([_number(stamp, number, path) for number, stamp in enumerate(stamps)])
    if np.isnan(times).any():
        raise FormatError(f"frame {int(np.flatnonzero(np.isnan(times))[0])} has no time", path=path)
    seconds = seconds_of(times)
    early = np.flatnonzero(~(np.diff(seconds) > 0))
    if len(early):
        raise FormatError(f"frame {int(early[0]) + 1} is not later than the one before it", path=path)
    with naming_file(path):
        return seconds, find_rate(seconds)
