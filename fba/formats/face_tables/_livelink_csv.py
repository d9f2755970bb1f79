"""Read tables (CSV) of blendshapes: those of Live Link Face, and any others with ARKit's names of shapes.

Columns are found by their names, in any order and case. Times are in a column `Timecode`
(HH:MM:SS:FF.fff), in seconds or milliseconds (`time`, `timestamp`), or numbers of frames (`frame`). Live Link
Face counts 60 frames a second, while frames come every 1.0016 of these: the times count, never the rows.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path as FilePath
from typing import NamedTuple

import numpy as np

from fba.arrays import Float64
from fba.capture import ShapeMotion
from fba.capture.blendshapes.shape_table import key_of
from fba.capture.sampling import find_rate
from fba.choices import Swap
from fba.errors import FormatError, ModelError, Remedy
from fba.face.shape_names import arkit_names
from fba.formats.face_tables._faces import angle_unit
from fba.formats.face_tables._shape_rows import (
    check_weights,
    find_lacks,
    find_swap,
    shape_of,
)
from fba.formats.face_tables._tables import Table, header_names, named, read_table
from fba.formats.face_tables._times import check_order, seconds_of
from fba.formats.time_codes import read_time_codes
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path

MIN_SHAPES = 5
"""Smallest number of shapes with ARKit's names or synonyms in a table of blendshapes; beside times, one is
enough."""
TIME_CODE = ("timecode",)
SECONDS = ("time", "timestamp", "seconds", "times", "timesec", "timeseconds", "timestampms", "timems", "t")
FRAMES = ("frame", "framenumber", "frameid", "frameidx", "frameindex")
COUNT = ("blendshapecount",)
HEAD = ("headyaw", "headpitch", "headroll")
EYES = ("lefteyeyaw", "righteyeyaw", "lefteyepitch", "righteyepitch")
UNUSED = ("lefteyeroll", "righteyeroll", "neutral")
"""Columns that no FAP stands for."""
SPARSE = 1.2
"""Counts of time codes between frames above which frames are fewer than these count."""


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first line of a file names shapes of ARKit, as cells of a table."""
    if head[:1] in b"{[\x06" or b"\0" in head[:64]:
        return False
    return _are_enough(header_names(head))


def read_face(
    path: Path,
    *,
    source_rate: Fraction | int | str | None = None,
    swap: Swap = "auto",
    limits: Limits = DEFAULT_LIMITS,
) -> ShapeMotion:
    """Return weights, head and eyes as they are in a table.

    source_rate: rows in a second, for a table without times. swap: whether MouthLeft and MouthRight, JawLeft
    and JawRight change places, as Live Link Face writes them the wrong way round: "yes", "no", or "auto",
    which looks at how they go with lop-sided smiles. `ShapeMotion.findings` say what was done. Raises
    FormatError, LimitError, OptionError.
    """
    table = read_table(path, limits)
    columns = _find_columns(table)
    shapes = list(columns.shapes)
    weights = table.numbers(list(columns.shapes.values()))
    check_weights(weights, shapes, path, table.lines)
    times = _read_times(table, source_rate)
    head = eyes = None
    still = []
    unit, odd = angle_unit(table.numbers(columns.head + columns.eyes))
    if columns.head:
        yaw, pitch, roll = table.numbers(columns.head).T * unit
        head = np.stack([-pitch, yaw, roll], axis=1)  # up and left are positive there
        still += ["head"] if not np.nan_to_num(head).any() else []
    if columns.eyes:
        eyes = table.numbers(columns.eyes) * unit * [-1, -1, 1, 1]  # right and down are positive there
        still += ["eyes"] if not np.nan_to_num(eyes).any() else []
    motion = ShapeMotion(
        tuple(shapes), weights, times.seconds, times.rate, head=head, eyes=eyes, start=times.start,
        name=FilePath(path).stem, findings=tuple(odd + _findings(table, columns, weights, times, still)),
    )  # fmt: skip
    return find_swap(motion, swap, expected=_is_of_the_app(table.names)) if times.coded else motion


class _Columns(NamedTuple):
    """Numbers of columns: of shapes by name, of the angles of head and eyes; names that mean nothing here."""

    shapes: dict[str, int]
    head: list[int]
    eyes: list[int]
    strange: list[str]


class _Times(NamedTuple):
    """Times (T,) in seconds from the first row, the nominal rate, the first row's time of day."""

    seconds: Float64
    rate: Fraction
    start: float | None
    coded: bool


def _are_enough(names: Sequence[str]) -> bool:
    """Whether columns with these names are a table of blendshapes: several, or ARKit's own beside times."""
    if sum(shape_of(name) is not None for name in names) >= MIN_SHAPES:
        return True
    timed = any(key_of(name) in (*TIME_CODE, *SECONDS, *FRAMES, *COUNT) for name in names)
    return timed and any(name[:1].lower() + name[1:] in arkit_names() for name in names)


def _find_columns(table: Table) -> _Columns:
    """Return which column is what. Raises FormatError for too few shapes, or a name that occurs twice."""
    by_key: dict[str, int] = {}
    shapes: dict[str, int] = {}
    strange = []
    for number, name in enumerate(table.names):
        shape = shape_of(name)
        if shape is not None:
            if shape in shapes:
                raise FormatError(
                    f"columns {table.names[shapes[shape]]!r} and {name!r} are one shape; leave one out",
                    path=table.path, line=1,
                )  # fmt: skip
            shapes[shape] = number
        elif key_of(name):
            by_key.setdefault(key_of(name), number)
            strange.append(name)
    if not _are_enough(table.names):
        raise FormatError(
            f"{len(shapes)} of {len(table.names)} columns are blendshapes; expected at least {MIN_SHAPES} of "
            f"ARKit's, such as EyeBlinkLeft and JawOpen; it has {named(list(table.names))}",
            path=table.path, line=1,
        )  # fmt: skip
    known = {*TIME_CODE, *SECONDS, *FRAMES, *COUNT, *HEAD, *EYES, *UNUSED}
    head, eyes = ([by_key[key] for key in keys if key in by_key] for keys in (HEAD, EYES))
    return _Columns(
        shapes,
        head if len(head) == len(HEAD) else [],
        eyes if len(eyes) == len(EYES) else [],
        [name for name in strange if key_of(name) not in known],
    )


def _read_times(table: Table, source_rate: Fraction | int | str | None) -> _Times:
    keys = [key_of(name) for name in table.names]

    def column(names: tuple[str, ...]) -> int | None:
        return next((keys.index(name) for name in names if name in keys), None)

    coded, timed, counted = column(TIME_CODE), column(SECONDS), column(FRAMES)
    if coded is not None:
        codes = read_time_codes(table.column(coded), table.lines, table.path)
        seconds, rate = codes.seconds, codes.rate
        check_order(seconds, table.lines, table.path)
        if len(seconds) > 1 and float(np.median(np.diff(seconds))) * rate > SPARSE:
            rate = find_rate(seconds)  # fewer frames than the time codes count
        return _Times(seconds, rate, codes.start, True)
    if timed is not None:
        read = table.numbers([timed])[:, 0]
        if np.isnan(read).any():
            row = int(np.flatnonzero(np.isnan(read))[0])
            raise FormatError(
                f"column {table.names[timed]!r} has no number; every row needs a time",
                path=table.path, line=table.lines[row],
            )  # fmt: skip
        seconds = seconds_of(read)
        check_order(seconds, table.lines, table.path)
        try:
            return _Times(seconds, find_rate(seconds), None, False)
        except ModelError as error:
            raise FormatError(error.finding, path=table.path) from error
    if source_rate is None:
        raise FormatError(
            "has no column of times: none is called Timecode, time or timestamp", path=table.path
        ).with_remedies(Remedy("source_rate", "give the rate of its rows with {}", "30"))
    rate = Fraction(source_rate)
    rows = np.arange(len(table.rows), dtype=np.float64)
    if counted is not None:
        rows = table.numbers([counted])[:, 0]
        check_order(rows, table.lines, table.path)
    return _Times((rows - rows[0]) / float(rate), rate, None, False)


def _is_of_the_app(names: tuple[str, ...]) -> bool:
    """Whether columns have the order of the app's own tables, in which right comes before left there."""
    keys = [key_of(name) for name in names]
    return all(
        {left, right} <= set(keys) and keys.index(left) == keys.index(right) + 1
        for left, right in (("mouthleft", "mouthright"), ("jawleft", "jawright"))
    )


def _gather(names: list[str]) -> list[str]:
    """Return names, of those that differ in their numbers alone the first with how many they are."""
    alike: dict[str, list[str]] = {}
    for name in names:
        alike.setdefault(re.sub(r"\d+", "#", name), []).append(name)
    return [
        same[0] if len(same) == 1 else f"{same[0]} and {len(same) - 1} like it" for same in alike.values()
    ]


def _findings(
    table: Table, columns: _Columns, weights: Float64, times: _Times, still: list[str]
) -> list[str]:
    """Return what is odd about a table, a sentence each."""
    findings = []
    if columns.strange:
        findings.append(f"columns that mean nothing here are left out: {named(_gather(columns.strange))}")
    if still:
        findings.append(f"all angles of {' and '.join(still)} are 0, as where the app does not record them")
    if table.cut:
        findings.append("the last row is incomplete, as where a recording was cut off; it is left out")
    return findings + find_lacks(list(columns.shapes), weights, times.seconds, times.rate)
