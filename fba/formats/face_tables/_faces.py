"""What readers of tracked faces share: rows of one face, times, action units, turns of head and eyes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.arrays import Bool, Float64, Int64
from fba.errors import FormatError, Remedy
from fba.formats.face_tables._tables import Table, check_order, named
from fba.formats.text.frame_rates import Rate
from fba.sampling import find_gaps, find_rate
from fba.source import naming_file

MIN_CONFIDENCE = 0.5
"""Confidence below which a row has no face."""
PICTURE_RATE = 30
"""Rate, in frames per second, of a single picture, and of pictures whose rate is unknown."""
FILM_RATES = (24, 25, 30, 48, 50, 60, 120)
"""Rates of films, in frames per second."""
MAX_TURN = 2.0
"""Angle, in radians, that heads and eyes of tracked faces do not reach."""
TURN_PERCENTILE = 99
"""Percentile of the angles that is compared with it."""
MAX_ROWS_A_SECOND = 500
"""Rows per second above which a column does not hold times."""
UPRIGHT = np.diag([1.0, -1.0, -1.0])
"""From axes of a camera (x right, y down, z away) to those of a face that looks into it (left, up, ahead)."""


@dataclass(frozen=True)
class UnitLayout:
    """How a program lays out a table of action units.

    face, seconds: names of the columns with the face and the time of a row. strongest: the highest intensity
    of an action unit. largest: the largest valid number.
    """

    face: str
    seconds: str
    strongest: float
    largest: float


@dataclass(frozen=True, eq=False)
class UnitRows:
    """The rows of one face.

    numbers: int64 (T,), of the table's rows. times: float64 (T,), seconds from the first on. rate: nominal.
    units: N action units. intensities: float64 (T, N), 0 to 1, NaN in rows without a face. findings: oddities
    of the times.
    """

    numbers: Int64
    times: Float64
    rate: Fraction
    units: tuple[int, ...]
    intensities: Float64
    findings: list[str]


def choose_rows(table: Table, ids: Sequence[str], face: str | None) -> Int64:
    """Return the numbers of the rows (R,) of one face. ids: the face of each row, "" where it is unknown.

    Raises FormatError if there are several and `face` names none of them.
    """
    counts = Counter(one for one in ids if one)
    if face is not None:
        if face not in counts:
            raise FormatError(f"has no face {face!r}; there are {named(sorted(counts))}", path=table.path)
    elif len(counts) > 1:
        listed = ", ".join(f"{one} ({count} rows)" for one, count in counts.most_common(5))
        raise FormatError(f"has several faces: {listed}", path=table.path).with_remedies(
            Remedy("face", "choose one with {}", repr(counts.most_common(1)[0][0]))
        )
    return np.flatnonzero([not one or face is None or one == face for one in ids])


def tracked_rows(table: Table) -> Bool:
    """Return whether each row (T,) has a face, with enough confidence."""
    column = table.columns
    seen = np.ones(len(table.rows), dtype=bool)
    if "success" in column:
        seen &= table.numbers([column["success"]])[:, 0] > 0
    if "confidence" in column:
        seen &= table.numbers([column["confidence"]])[:, 0] >= MIN_CONFIDENCE
    return seen


def row_times(
    table: Table, rows: Int64, seconds: int | None, frame: int | None, source_rate: Rate | None
) -> tuple[Float64, Fraction, list[str]]:
    """Return times (R,) of rows from the first on, the nominal rate, and oddities.

    seconds, frame: numbers of columns. source_rate: frames per second, if no column has seconds, or if these
    are those of pictures. Raises FormatError.
    """
    if len(rows) == 1:
        return np.zeros(1), Fraction(source_rate or PICTURE_RATE), []
    findings = []
    if seconds is not None and ":" in table.rows[rows[0]][seconds]:
        if source_rate is None and frame is not None:
            source_rate = _film_rate(table, rows, seconds, frame)
            if source_rate is not None:
                findings.append(
                    f"its whole seconds are those of a film of {float(source_rate):g} frames in a second"
                )
        seconds = None  # py-feat's "00:03" is too coarse to be the time of a frame
    counted = seconds is not None or frame is not None
    if seconds is not None and _are_pictures(table, seconds):
        if source_rate is None:
            source_rate = PICTURE_RATE
            findings.append(
                f"the times are those of pictures whose rate nobody knew; taken as {PICTURE_RATE} in a second"
            )
        seconds = None
    if seconds is not None:
        times = table.numbers([seconds])[rows, 0]
    elif source_rate is not None:
        frames = np.arange(len(table.rows), dtype=np.float64)
        times = (frames if frame is None else table.numbers([frame])[:, 0])[rows] / float(
            Fraction(source_rate)
        )
    else:
        raise FormatError("has no column of times", path=table.path).with_remedies(
            Remedy("source_rate", "give the frame rate of the film with {}", "30")
        )
    lines = [table.lines[row] for row in rows.tolist()]
    if np.isnan(times).any():
        row = int(np.flatnonzero(np.isnan(times))[0])
        raise FormatError("the row has no time", path=table.path, line=lines[row])
    times = times - times[0]
    check_order(times, lines, table.path)
    with naming_file(table.path):
        return times, (find_rate(times) if counted else Fraction(source_rate or PICTURE_RATE)), findings


def _film_rate(table: Table, rows: Int64, seconds: int, frame: int) -> Fraction | None:
    """Return the rate of films that fits whole seconds "00:03" and numbers of frames; None if several fit.

    Where no whole rate fits, television's rates, a thousandth lower, are tried.
    """
    frames = table.numbers([frame])[rows, 0]
    try:
        minute, second = np.array(
            [[int(part) for part in table.rows[row][seconds].split(":")] for row in rows.tolist()]
        ).T
    except ValueError:
        return None
    for slower in (Fraction(1), Fraction(1000, 1001)):
        rates = [rate * slower for rate in FILM_RATES]
        fitting = [rate for rate in rates if (frames // float(rate) == 60 * minute + second).all()]
        if fitting:
            return fitting[0] if len(fitting) == 1 else None
    return None


def read_unit_rows(
    table: Table,
    columns: Mapping[int, int],
    layout: UnitLayout,
    face: str | None,
    source_rate: Rate | None,
    ids: Sequence[str] | None = None,
) -> UnitRows:
    """Return the action units of one face. columns: action unit -> number of its column.

    face: which, if there are several. source_rate: frames per second, for tables without times. ids: the face
    of each row; None for those in the column of faces. Raises FormatError.
    """
    column = table.columns
    if ids is None:
        ids = table.column(column[layout.face]) if layout.face in column else [""] * len(table.rows)
    rows = choose_rows(table, ids, face)
    times, rate, findings = row_times(
        table, rows, column.get(layout.seconds), column.get("frame"), source_rate
    )
    units = sorted(columns)
    strengths = table.numbers([columns[unit] for unit in units])[rows]
    if np.nanmax(np.abs(strengths), initial=0.0) > layout.largest:
        row = int(np.argwhere(np.abs(strengths) > layout.largest)[0][0])
        raise FormatError(
            f"an action unit is stronger than {layout.largest:g}; here they go from 0 to "
            f"{layout.strongest:g}",
            path=table.path, line=table.lines[rows[row]],
        )  # fmt: skip
    seen = tracked_rows(table)[rows]
    shares = np.where(seen[:, None], np.clip(strengths / layout.strongest, 0.0, 1.0), np.nan)
    return UnitRows(rows, times, rate, tuple(units), shares, findings)


def find_missing(intensities: Float64, times: Float64, rate: Fraction) -> list[str]:
    """Return what is missing of action units (T, N) at times (T,), a sentence for each."""
    seen = np.isnan(intensities).sum(axis=1) == 0
    findings = []
    if not seen.all():
        findings.append(f"{int((~seen).sum())} of {len(seen)} rows have no face; they are bridged")
    if gaps := find_gaps(times[seen], rate):
        longest = max(length for _, length in gaps)
        findings.append(f"frames are missing at {len(gaps)} places, {longest:.2f} s at most")
    return findings


def _are_pictures(table: Table, seconds: int) -> bool:
    """Whether times are those of pictures whose times are unknown, a thousand of them in a second."""
    times = table.numbers([seconds])[:, 0]
    return len(times) > 1 and bool(0 < np.median(np.diff(times)) <= 1 / MAX_ROWS_A_SECOND)


def angle_unit(angles: Float64) -> tuple[float, list[str]]:
    """Return the factor from angles (T, N) of heads and eyes to radians, and oddities.

    A tracked face does not look backwards: in radians, it turns by less than `MAX_TURN`.
    """
    known = np.abs(angles[~np.isnan(angles)])
    if not len(known) or np.percentile(known, TURN_PERCENTILE) <= MAX_TURN:
        return 1.0, []
    return float(np.radians(1.0)), [
        "angles of head and eyes are taken as degrees: in radians, it would face away"
    ]


def head_angles(turns: Float64) -> Float64:
    """Return pitch, yaw and roll (T, 3) of heads, as FAPs 48 to 50 turn them.

    turns: rotations (T, 3, 3) in a camera's axes, of which the identity looks into the camera.
    """
    face = UPRIGHT @ turns @ UPRIGHT
    pitch = np.arctan2(-face[:, 1, 2], face[:, 1, 1])
    yaw = np.arctan2(-face[:, 2, 0], face[:, 0, 0])
    roll = np.arcsin(np.clip(face[:, 1, 0], -1.0, 1.0))
    return np.stack([pitch, yaw, roll], axis=1)


def eye_angles(left: Float64, right: Float64, turns: Float64 | None) -> Float64:
    """Return the yaw of the left and the right eye, then their pitch (T, 4).

    left, right: directions (T, 3) of their gaze. turns: (T, 3, 3), of the head. All are in a camera's axes.
    """
    result = []
    for gaze in (left, right):
        seen = gaze if turns is None else np.einsum("tji,tj->ti", turns, gaze)
        x, y, z = (seen @ UPRIGHT).T
        result.append((np.arctan2(x, z), np.arctan2(-y, np.hypot(x, z))))
    (left_yaw, left_pitch), (right_yaw, right_pitch) = result
    return np.stack([left_yaw, right_yaw, left_pitch, right_pitch], axis=1)
