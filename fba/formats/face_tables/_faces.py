"""What readers of tracked faces share: rows of one face, turns of head and eyes, times."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from fractions import Fraction

import numpy as np

from fba.arrays import Bool, Float64, Int64
from fba.capture.sampling import find_gaps, find_rate
from fba.errors import FormatError, ModelError, Remedy
from fba.formats.face_tables._tables import Table, named
from fba.formats.face_tables._times import check_order

CONFIDENT = 0.5
"""Confidence below which numbers of a row mean nothing."""
USUAL = 30
"""Rate of a single picture."""
FILMS = (24, 25, 30, 48, 50, 60, 120)
"""Rates of films."""
MAX_TURN = 2.0
"""Angle, in radians, that heads and eyes of tracked faces do not reach."""
TURN_PERCENTILE = 99
"""Percentile of the angles that is compared with it."""
PICTURES = 500
"""Rows a second above which a column does not hold times."""
UPRIGHT = np.diag([1.0, -1.0, -1.0])
"""From axes of a camera (x right, y down, z away) to those of a face that looks into it (left, up, ahead)."""


def choose_rows(table: Table, ids: Sequence[str], face: str | None) -> Int64:
    """Return numbers of the rows (R,) of one face. ids: of the face in each row, "" where none is known.

    Raises FormatError where there are several and `face` names none of them.
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


def tracked_rows(table: Table, column: dict[str, int]) -> Bool:
    """Return whether each row (T,) has a face, and is sure of it. column: names -> numbers of columns."""
    seen = np.ones(len(table.rows), dtype=bool)
    if "success" in column:
        seen &= table.numbers([column["success"]])[:, 0] > 0
    if "confidence" in column:
        seen &= table.numbers([column["confidence"]])[:, 0] >= CONFIDENT
    return seen


def row_times(
    table: Table,
    rows: Int64,
    seconds: int | None,
    frame: int | None,
    source_rate: Fraction | int | str | None,
) -> tuple[Float64, Fraction, list[str]]:
    """Return times (R,) of rows from the first on, the nominal rate, and what was odd about them.

    seconds, frame: numbers of columns. source_rate: frames in a second, where no column has seconds, or where
    these are those of pictures. Raises FormatError.
    """
    if len(rows) == 1:
        return np.zeros(1), Fraction(source_rate or USUAL), []
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
            source_rate = USUAL
            findings.append(
                f"the times are those of pictures whose rate nobody knew; taken as {USUAL} in a second"
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
    try:
        return times, (find_rate(times) if counted else Fraction(source_rate or USUAL)), findings
    except ModelError as error:
        raise FormatError(error.finding, path=table.path) from error


def _film_rate(table: Table, rows: Int64, seconds: int, frame: int) -> Fraction | None:
    """Return the rate of films that fits whole seconds "00:03" at numbers of frames; None where several do.

    A rate a thousandth lower, as television has it, is taken where no whole one fits.
    """
    frames = table.numbers([frame])[rows, 0]
    try:
        minute, second = np.array(
            [[int(part) for part in table.rows[row][seconds].split(":")] for row in rows.tolist()]
        ).T
    except ValueError:
        return None
    for slower in (Fraction(1), Fraction(1000, 1001)):
        rates = [rate * slower for rate in FILMS]
        fitting = [rate for rate in rates if (frames // float(rate) == 60 * minute + second).all()]
        if fitting:
            return fitting[0] if len(fitting) == 1 else None
    return None


def find_missing(intensities: Float64, times: Float64, rate: Fraction) -> list[str]:
    """Return what is missing of action units (T, N) at times (T,), a sentence each."""
    seen = np.isnan(intensities).sum(axis=1) == 0
    findings = []
    if not seen.all():
        findings.append(f"{int((~seen).sum())} of {len(seen)} rows have no face; they are bridged")
    if gaps := find_gaps(times[seen], rate):
        longest = max(length for _, length in gaps)
        findings.append(f"frames are missing at {len(gaps)} places, {longest:.2f} s at most")
    return findings


def _are_pictures(table: Table, seconds: int) -> bool:
    """Whether times are those of pictures whose times are unknown: a thousand of them in a second."""
    times = table.numbers([seconds])[:, 0]
    return len(times) > 1 and bool(0 < np.median(np.diff(times)) * PICTURES <= 1)


def angle_unit(angles: Float64) -> tuple[float, list[str]]:
    """Return what angles (T, N) of heads and eyes must be multiplied by to be radians, and what is odd.

    Faces that are tracked do not look backwards: in radians, they turn less than `MAX_TURN`.
    """
    known = np.abs(angles[~np.isnan(angles)])
    if not len(known) or np.percentile(known, TURN_PERCENTILE) <= MAX_TURN:
        return 1.0, []
    return float(np.radians(1.0)), [
        "angles of head and eyes are taken as degrees: in radians, it would face away"
    ]


def head_angles(turns: Float64) -> Float64:
    """Return pitch, yaw and roll (T, 3) of heads, as FAPs 48 to 50 turn them, of rotations (T, 3, 3).

    Rotations are in a camera's axes; one that is the identity looks into the camera.
    """
    face = UPRIGHT @ turns @ UPRIGHT
    pitch = np.arctan2(-face[:, 1, 2], face[:, 1, 1])
    yaw = np.arctan2(-face[:, 2, 0], face[:, 0, 0])
    roll = np.arcsin(np.clip(face[:, 1, 0], -1.0, 1.0))
    return np.stack([pitch, yaw, roll], axis=1)


def eye_angles(left: Float64, right: Float64, turns: Float64 | None) -> Float64:
    """Return yaw of the left and the right eye, then their pitch (T, 4), of directions (T, 3) of their gaze.

    turns: (T, 3, 3), of the head, which eyes are turned in. Directions and turns are in a camera's axes.
    """
    result = []
    for gaze in (left, right):
        seen = gaze if turns is None else np.einsum("tji,tj->ti", turns, gaze)
        x, y, z = (seen @ UPRIGHT).T
        result.append((np.arctan2(x, z), np.arctan2(-y, np.hypot(x, z))))
    (left_yaw, left_pitch), (right_yaw, right_pitch) = result
    return np.stack([left_yaw, right_yaw, left_pitch, right_pitch], axis=1)
