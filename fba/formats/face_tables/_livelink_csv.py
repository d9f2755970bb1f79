"""Read tables (CSV) of blendshapes, of Live Link Face and others with ARKit's names of shapes; write them.

Columns are found by their names, in any order and case. Times are in a column `Timecode`
(HH:MM:SS:FF.fff), in seconds or milliseconds (`time`, `timestamp`), or numbers of frames (`frame`). Live Link
Face's codes count 60 frames a second, but its rows are 1.0016 frames apart: times count, never rows.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64
from fba.atomic import atomic
from fba.capture import ShapeMotion, to_blendshapes
from fba.choices import Swap
from fba.errors import FormatError, Remedy
from fba.face import arkit_names
from fba.formats.face_tables._faces import angle_unit
from fba.formats.face_tables._tables import (
    Table,
    check_order,
    header_names,
    named,
    read_table,
    regular_seconds,
)
from fba.formats.face_tables.livelink_udp import join_values
from fba.formats.face_tables.shape_weights import check_weights, find_lacks, find_swap, shape_of
from fba.formats.text.frame_rates import Rate
from fba.formats.time_codes import DAY, read_time_codes
from fba.limits import DEFAULT_LIMITS, Limits
from fba.name_maps import key_of
from fba.sampling import find_rate
from fba.source import Path, naming_file, stem_of

MIN_SHAPES = 5
"""Smallest number of shapes with ARKit's names or synonyms in a table; beside times, one is enough."""
TIME_CODE = ("timecode",)
SECONDS = ("time", "timestamp", "seconds", "times", "timesec", "timeseconds", "timestampms", "timems", "t")
FRAMES = ("frame", "framenumber", "frameid", "frameidx", "frameindex")
COUNT = ("blendshapecount",)
HEAD_ANGLES = ("headyaw", "headpitch", "headroll")
EYE_ANGLES = ("lefteyeyaw", "righteyeyaw", "lefteyepitch", "righteyepitch")
UNUSED = ("lefteyeroll", "righteyeroll", "neutral")
"""Columns without a FAP."""
MAX_CODE_STEP = 1.2
"""Frames of the time codes from row to row above which the rate is found from the rows instead."""
WRITTEN_ANGLES = (
    "HeadYaw", "HeadPitch", "HeadRoll", "LeftEyeYaw", "LeftEyePitch", "LeftEyeRoll", "RightEyeYaw",
    "RightEyePitch", "RightEyeRoll",
)  # fmt: skip
CODE_RATES = (24, 25, 30, 48, 50, 60, 120)
"""Rates that written time codes count in; for others they count 60 frames a second, and parts of them."""
MIN_RATE = 10
"""Lowest rate, in frames per second, that is written: the time codes of slower animations are ambiguous."""
DEFAULT_RATE = 30
"""Rate, in frames per second, to which slower animations are resampled."""
BATCH_FRAMES = 1024


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first line of a file names shapes of ARKit, as cells of a table."""
    if head[:1] in b"{[\x06" or b"\0" in head[:64]:
        return False
    return _are_enough(header_names(head))


def read_face(
    path: Path, *, source_rate: Rate | None = None, swap: Swap = "auto", limits: Limits = DEFAULT_LIMITS
) -> ShapeMotion:
    """Return weights, head and eyes as they are in a table.

    source_rate: rows per second, for a table without times. swap: whether MouthLeft and MouthRight, JawLeft
    and JawRight change places, as Live Link Face exchanges them: "yes", "no", or "auto", which compares them
    with lop-sided smiles. `ShapeMotion.findings` say what was done. Raises FormatError, LimitError,
    OptionError.
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
        name=stem_of(path), findings=tuple(odd + _findings(table, columns, weights, times, still)),
    )  # fmt: skip
    return find_swap(motion, swap, expected=_is_of_the_app(table.names)) if times.coded else motion


class _Columns(NamedTuple):
    """Numbers of columns: of shapes by name, of angles of head and eyes; strange: names without a meaning."""

    shapes: dict[str, int]
    head: list[int]
    eyes: list[int]
    strange: list[str]


class _Times(NamedTuple):
    """Times (T,) in seconds from the first row; start: time of day of that; coded: whether codes say it."""

    seconds: Float64
    rate: Fraction
    start: float | None
    coded: bool


def _are_enough(names: Sequence[str]) -> bool:
    """Whether these are columns of blendshapes: several shapes, or one of ARKit's own names beside times."""
    if sum(shape_of(name) is not None for name in names) >= MIN_SHAPES:
        return True
    timed = any(key_of(name) in (*TIME_CODE, *SECONDS, *FRAMES, *COUNT) for name in names)
    return timed and any(name[:1].lower() + name[1:] in arkit_names() for name in names)


def _find_columns(table: Table) -> _Columns:
    """Return the columns by meaning. Raises FormatError for too few shapes, or two columns of one shape."""
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
    known = {*TIME_CODE, *SECONDS, *FRAMES, *COUNT, *HEAD_ANGLES, *EYE_ANGLES, *UNUSED}
    head, eyes = (
        [by_key[key] for key in keys] if set(keys) <= set(by_key) else []
        for keys in (HEAD_ANGLES, EYE_ANGLES)
    )
    return _Columns(shapes, head, eyes, [name for name in strange if key_of(name) not in known])


def _read_times(table: Table, source_rate: Rate | None) -> _Times:
    keys = [key_of(name) for name in table.names]

    def column(names: tuple[str, ...]) -> int | None:
        return next((keys.index(name) for name in names if name in keys), None)

    coded, timed, counted = column(TIME_CODE), column(SECONDS), column(FRAMES)
    if coded is not None:
        codes = read_time_codes(table.column(coded), table.lines, table.path)
        seconds, rate = codes.seconds, codes.rate
        check_order(seconds, table.lines, table.path)
        if len(seconds) > 1 and float(np.median(np.diff(seconds))) * rate > MAX_CODE_STEP:
            rate = find_rate(seconds)
        return _Times(seconds, rate, codes.start, True)
    if timed is not None:
        read = table.numbers([timed])[:, 0]
        if np.isnan(read).any():
            row = int(np.flatnonzero(np.isnan(read))[0])
            raise FormatError(
                f"column {table.names[timed]!r} has no number; every row needs a time",
                path=table.path, line=table.lines[row],
            )  # fmt: skip
        return _Times(*regular_seconds(read, table.lines, table.path), None, False)
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
    """Whether columns have the order of the app's tables, where MouthRight and JawRight come before left."""
    keys = [key_of(name) for name in names]
    return all(
        {left, right} <= set(keys) and keys.index(left) == keys.index(right) + 1
        for left, right in (("mouthleft", "mouthright"), ("jawleft", "jawright"))
    )


def _gather(names: list[str]) -> list[str]:
    """Return names; of names that differ only in their numbers, the first and the count of the others."""
    alike: dict[str, list[str]] = {}
    for name in names:
        alike.setdefault(re.sub(r"\d+", "#", name), []).append(name)
    return [
        same[0] if len(same) == 1 else f"{same[0]} and {len(same) - 1} like it" for same in alike.values()
    ]


def _findings(
    table: Table, columns: _Columns, weights: Float64, times: _Times, still: list[str]
) -> list[str]:
    """Return oddities of a table, a sentence for each."""
    findings = []
    if columns.strange:
        findings.append(f"columns that mean nothing here are left out: {named(_gather(columns.strange))}")
    if still:
        findings.append(f"all angles of {' and '.join(still)} are 0, as where the app does not record them")
    if table.cut:
        findings.append("the last row is incomplete, as where a recording was cut off; it is left out")
    return findings + find_lacks(list(columns.shapes), weights, times.seconds, times.rate)


def write(path: Path, animation: Animation) -> None:
    """Write the face as a table of blendshapes, see `fba.capture.to_blendshapes`.

    Columns are in ARKit's order; left is always the performer's left. Time 0 of the animation is midnight in
    the time codes. Raises FormatError without a face.
    """
    if animation.rate < MIN_RATE:
        animation = animation.resample(DEFAULT_RATE)
    with naming_file(path):
        motion = to_blendshapes(animation)
    rows = join_values(motion)
    names = [name[0].upper() + name[1:] for name in motion.names]
    rate = int(animation.rate) if animation.rate in CODE_RATES else 60
    codes = _time_codes(motion.times + (motion.start or 0.0), rate)
    pattern = f",{rows.shape[1]}" + ",%.6f" * rows.shape[1] + "\n"
    with atomic(path) as file:
        file.write(("Timecode,BlendShapeCount," + ",".join([*names, *WRITTEN_ANGLES]) + "\n").encode())
        for start in range(0, len(rows), BATCH_FRAMES):
            part = rows[start : start + BATCH_FRAMES].tolist()
            lines = [code + pattern % tuple(row) for code, row in zip(codes[start:], part, strict=False)]
            file.write("".join(lines).encode())


def _time_codes(times: Float64, rate: int) -> list[str]:
    """Return times, in seconds, as HH:MM:SS:FF.fff. rate: the frames per second that they count."""
    codes = []
    for thousandths in np.rint((times % DAY) * rate * 1000).astype(np.int64).tolist():
        frames, part = divmod(thousandths, 1000)
        seconds, frame = divmod(frames, rate)
        minutes, second = divmod(seconds, 60)
        codes.append(f"{minutes // 60 % 24:02}:{minutes % 60:02}:{second:02}:{frame:02}.{part:03}")
    return codes
