"""Read tables (CSV) of points that a tracker found on a face: MediaPipe's, OpenFace's, dlib's, py-feat's.

There is no standard. Wide tables have a column for each coordinate: `x_0, y_0, z_0, ...`, `landmark_0_x`,
`0_x`, `x0`. Long tables have a row for each point: `frame, landmark, x, y, z`. OpenFace writes pixels as
`x_0, y_0` and millimetres as `X_0, Y_0, Z_0`, which are preferred.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fba.arrays import Float64, Int64
from fba.capture import PointMotion
from fba.errors import FormatError, ModelError
from fba.formats.face_tables._faces import choose_rows, row_times, tracked_rows
from fba.formats.face_tables._points import build_points
from fba.formats.face_tables._tables import Table, header_names, named, read_table
from fba.formats.text.frame_rates import Rate
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path

AXIS_FIRST = re.compile(r"(?:(.*?)[ _.\-]*)??([xyzXYZ])[ _.\-\[(]*(\d{1,4})[\])]?")
AXIS_LAST = re.compile(r"(.*?)[ _.\-\[(]*(\d{1,4})[\])]?[ _.\-]*([xyzXYZ])")
MIN_POINTS = 5
"""Fewest points in a table of points; fewer are markers."""
TIMES = ("timestamp", "time", "seconds", "time_s", "timestamp_s", "t")
MILLISECONDS = ("timestamp_ms", "time_ms", "timestampms", "milliseconds", "ms")
FRAMES = ("frame", "frame_id", "frame_number", "frame_idx", "frame_index", "framenum", "image_id")
FACES = ("face_id", "face", "Identity", "person_id", "face_idx", "face_index")
POINTS = (
    "landmark", "landmark_id", "landmark_index", "landmark_idx", "point", "point_id", "index", "idx", "id",
)  # fmt: skip
SIZES = (
    ("width", "height"),
    ("framewidth", "frameheight"),
    ("image_width", "image_height"),
    ("frame_width", "frame_height"),
)
WORDS = ("", "landmark", "landmarks", "lm", "lmk", "face", "facelandmark", "point", "points", "p", "pt", "kp",
         "keypoint", "facepoint", "mesh", "facemesh")  # fmt: skip
"""Words that may stand before the numbers of columns, in lower case."""
PLAIN = re.compile(r"-?\d{1,9}(?:\.\d{0,20})?(?:[eE][+-]?\d{1,3})?")
PLAIN_COUNTS = {width * count for count in PointMotion.COUNTS for width in (2, 3)}
"""Counts of columns in tables whose columns are numbered or have no header."""
MILLIMETRE = 0.001
"""Metres."""


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first line of a file names coordinates of numbered points."""
    names = header_names(head)
    if _long_columns(names) is not None or _plain_columns(names) is not None:
        return True
    sets = _find_sets(names)
    return any(len(columns.get("x", columns.get("X", {}))) >= MIN_POINTS for columns in sets.values())


def read_points(
    path: Path,
    *,
    source_rate: Rate | None = None,
    face: str | None = None,
    pixels: bool = False,
    limits: Limits = DEFAULT_LIMITS,
) -> PointMotion:
    """Return the points as they are in a table.

    source_rate: frames per second, for tables without times. face: the name or number of the face to read, if
    there are several. pixels: take these, not millimetres, from a table with both. Raises FormatError,
    LimitError.
    """
    table = _with_header(read_table(path, limits))
    column = table.columns
    by_word = {name.lower(): number for name, number in column.items()}
    long = _long_columns(table.names)
    metric = long is None and _is_metric(table.names, pixels)
    ids = next((table.column(column[name]) for name in FACES if name in column), [""] * len(table.rows))
    rows = choose_rows(table, ids, face)
    if long is not None:
        positions, first = _read_long(table, rows, long)
    else:
        positions, first = _read_wide(table, rows, metric), rows
    seconds = next((by_word[name] for name in (*TIMES, *MILLISECONDS) if name in by_word), None)
    frame = next((by_word[name] for name in FRAMES if name in by_word), None)
    times, rate, odd = row_times(table, first, seconds, frame, source_rate)
    positions[~tracked_rows(table)[first]] = np.nan
    return build_points(
        positions * (MILLIMETRE if metric else 1.0), times, rate, path=path,
        metric=metric, aspect=_read_aspect(table, by_word), findings=odd,
    )  # fmt: skip


def _find_sets(names: Sequence[str]) -> dict[str, dict[str, dict[int, int]]]:
    """Return columns by the word before their number, then by axis, then by number of the point."""
    result: dict[str, dict[str, dict[int, int]]] = {}
    for column, name in enumerate(names):
        if match := AXIS_FIRST.fullmatch(name):
            before, axis, number = match[1] or "", match[2], match[3]
        elif match := AXIS_LAST.fullmatch(name):
            before, number, axis = match[1], match[2], match[3]
        else:
            continue
        word = re.sub(r"[ _.\-]", "", before.lower())
        if word in WORDS:
            result.setdefault(word, {}).setdefault(axis, {}).setdefault(int(number), column)
    return result


def _plain_columns(names: Sequence[str]) -> list[int] | None:
    """Return the columns of coordinates, in order, of a table whose columns are numbered or have no names."""
    numbers = [column for column, name in enumerate(names) if PLAIN.fullmatch(name)]
    for columns in (numbers, numbers[1:]):
        if len(names) - len(columns) <= 3 and len(columns) in PLAIN_COUNTS:
            return columns
    return None


def _with_header(table: Table) -> Table:
    """Return the table; if its first line holds numbers instead of names, with a header made for it."""
    plain = _plain_columns(table.names)
    if plain is None or all(name.isdigit() for name in (table.names[column] for column in plain)):
        return table
    names = [str(column) for column in range(len(table.names))]
    if len(plain) < len(names):
        names[0] = "frame"
    rows = [list(table.names), *table.rows]
    return replace(table, names=tuple(names), rows=rows, lines=[table.lines[0] - 1, *table.lines])


def _is_metric(names: Sequence[str], pixels: bool) -> bool:
    """Whether to take OpenFace's points in millimetres, X_0, Y_0, Z_0. pixels: not beside x_0, y_0."""
    axes = set(_find_sets(names).get("", {}))
    return {"X", "Y", "Z"} <= axes and not (pixels and {"x", "y"} <= axes)


def _read_wide(table: Table, rows: Int64, metric: bool) -> Float64:
    """Return points (T, N, 2 or 3) of a table with a column for each coordinate. metric: of `_is_metric`."""
    if (plain := _plain_columns(table.names)) is not None:
        count = len(plain)
        width = 3 if count % 3 == 0 and count // 3 in PointMotion.COUNTS else 2
        return table.numbers(plain)[rows].reshape(len(rows), -1, width)
    sets = _find_sets(table.names)
    if not sets:
        raise FormatError(
            "no columns of points, such as x_0, y_0, z_0, x_1, ...", path=table.path, line=table.lines[0] - 1
        )
    chosen = max(sets.values(), key=lambda axes: max(len(numbers) for numbers in axes.values()))
    axes = "xyz" if {"x", "y"} <= set(chosen) and not metric else "XYZ"
    if not set(axes[:2]) <= set(chosen):
        raise FormatError("has no columns of both x and y of its points", path=table.path, line=1)
    numbers = sorted(chosen[axes[0]])
    axes = axes if axes[2] in chosen else axes[:2]
    for axis in axes:
        lacking = [f"{axis}_{number}" for number in _expected(numbers) if number not in chosen[axis]]
        if lacking:
            raise FormatError(f"columns are missing: {named(lacking)}", path=table.path, line=1)
    if len(numbers) in (*PointMotion.OTHER_TRACKERS, 68, 70, 468, 478):
        _check(len(numbers), table)
    columns = [[chosen[axis][number] for number in _expected(numbers)] for axis in axes]
    return np.stack([table.numbers(each)[rows] for each in columns], axis=2)


def _expected(numbers: list[int]) -> range:
    """Return the numbers that points should have: from 0 or 1 to the last."""
    first = min(numbers[0], 1)
    return range(first, numbers[-1] + 1)


def _check(count: int, table: Table) -> None:
    try:
        PointMotion.check_count(count)
    except ModelError as error:
        raise FormatError(error.finding, path=table.path, line=1) from error


def _long_columns(names: Sequence[str]) -> tuple[int, int, int, int, int | None] | None:
    """Return the columns of frame or time, point, x, y and z of a long table; None for other tables."""
    words = [name.lower() for name in names]
    point = next((words.index(name) for name in POINTS if name in words), None)
    frame = next((words.index(name) for name in (*FRAMES, *TIMES, *MILLISECONDS) if name in words), None)
    if point is None or frame is None or not {"x", "y"} <= set(words):
        return None
    return frame, point, words.index("x"), words.index("y"), words.index("z") if "z" in words else None


def _read_long(
    table: Table, rows: Int64, columns: tuple[int, int, int, int, int | None]
) -> tuple[Float64, Int64]:
    """Return points (T, N, 2 or 3) of a table with a row for each, and the first row of each frame."""
    frame, point, *axes = (number for number in columns if number is not None)
    numbers = table.numbers([frame, point])[rows]
    lost = ~(np.abs(numbers) < 2**53).all(axis=1)  # larger whole numbers are not exact in float64
    if lost.any():
        raise FormatError(
            "the row has no frame, or no number of a point",
            path=table.path, line=table.lines[rows[int(lost.argmax())]],
        )  # fmt: skip
    which = numbers[:, 1].astype(np.int64)
    which -= min(int(which.min()), 1)
    begins = np.concatenate([[True], np.diff(numbers[:, 0]) != 0])
    starts = np.flatnonzero(begins)
    count = int(which.max()) + 1
    _check(count, table)
    if int(which.min()) < 0 or (which != numbers[:, 1] - (numbers[:, 1] - which)).any():
        raise FormatError("numbers of points begin with 0 or 1", path=table.path)
    positions = np.full((len(starts), count, len(axes)), np.nan)
    positions[np.cumsum(begins) - 1, which] = table.numbers(list(axes))[rows]
    return positions, rows[starts]


def _read_aspect(table: Table, by_word: dict[str, int]) -> float | None:
    """Return width / height of the picture, if columns say it."""
    for names in SIZES:
        if set(names) <= set(by_word):
            width, height = table.numbers([by_word[name] for name in names])[0].tolist()
            if width > 0 and height > 0:
                return float(width / height)
    return None
