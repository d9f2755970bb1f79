"""Read tables (CSV) of OpenFace: action units, pose and gaze of a tracked face.

Columns are found by their names, which begin with a blank in files of some builds. Blocks of columns may be
missing. Rows in which tracking failed have no face. In OpenFace 3, eight columns with the same names mean
other action units; their exact set tells them.
"""

from __future__ import annotations

import re

import numpy as np

from fba import rotations
from fba.arrays import Float64, Int64
from fba.capture import ActionUnitMotion
from fba.errors import FormatError
from fba.formats.face_tables._faces import (
    UnitLayout,
    angle_unit,
    eye_angles,
    find_missing,
    head_angles,
    read_unit_rows,
    tracked_rows,
)
from fba.formats.face_tables._tables import Table, header_names, read_table
from fba.formats.text.frame_rates import Rate
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, stem_of

INTENSITY = re.compile(r"AU(\d\d)_r")
PRESENCE = re.compile(r"AU(\d\d)_c")
LAYOUT = UnitLayout("face_id", "timestamp", strongest=5.0, largest=20.0)
VERSION_3 = {1: 1, 2: 6, 3: 12, 4: 15, 5: 17, 6: 2, 7: 9, 8: 10}
"""Action units that the eight columns of version 3 mean."""
POSE = ("pose_Rx", "pose_Ry", "pose_Rz")
GAZE = {side: tuple(f"gaze_{eye}_{axis}" for axis in "xyz") for side, eye in (("right", 0), ("left", 1))}
"""Directions of the gaze: eye 0 is the left one in the picture, the subject's right."""
ANGLES = ("gaze_angle_x", "gaze_angle_y")


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first line of a file names action units as OpenFace does."""
    return any(INTENSITY.fullmatch(name) or PRESENCE.fullmatch(name) for name in header_names(head))


def read_face(
    path: Path, *, source_rate: Rate | None = None, face: str | None = None, limits: Limits = DEFAULT_LIMITS
) -> ActionUnitMotion:
    """Return action units, head and eyes as they are in a table.

    source_rate: frames per second, for tables without times. face: the `face_id` to read, if there are
    several. Raises FormatError, LimitError.
    """
    table = read_table(path, limits)
    column = table.columns
    columns = {int(found[1]): column[name] for name in column if (found := INTENSITY.fullmatch(name))}
    findings = []
    if not columns:
        raise FormatError(
            "has no intensities of action units (AU01_r, ...), only whether they are there (AU01_c, ...)",
            path=path, line=1,
        )  # fmt: skip
    if set(columns) == set(VERSION_3):
        columns = {VERSION_3[unit]: number for unit, number in columns.items()}
        findings.append("AU01_r to AU08_r are taken as OpenFace 3's: action units 1, 6, 12, 15, 17, 2, 9, 10")
    rows = read_unit_rows(table, columns, LAYOUT, face, source_rate)
    turns, odd = _turns(table)
    turns = None if turns is None else turns[rows.numbers]
    findings += odd + rows.findings + find_missing(rows.intensities, rows.times, rows.rate)
    return ActionUnitMotion(
        rows.units, rows.intensities, rows.times, rows.rate,
        head=None if turns is None else head_angles(turns),
        eyes=_eyes(table, rows.numbers, turns),
        name=stem_of(path), findings=tuple(findings),
    )  # fmt: skip


def _turns(table: Table) -> tuple[Float64 | None, list[str]]:
    """Return rotations (T, 3, 3) of the head in the camera's axes, None without a pose; and oddities."""
    column = table.columns
    if not set(POSE) <= set(column):
        return None, []
    angles = np.nan_to_num(table.numbers([column[name] for name in POSE]))
    unit, odd = angle_unit(angles[tracked_rows(table)])
    angles *= unit
    x, y, z = (rotations.axis_matrices(axis, angles[:, axis]) for axis in range(3))
    return np.asarray(x @ y @ z), odd


def _eyes(table: Table, rows: Int64, turns: Float64 | None) -> Float64 | None:
    """Return turns (T, 4) of the eyes in the head; None without a gaze."""
    column = table.columns
    if {*GAZE["left"], *GAZE["right"]} <= set(column):
        left, right = (
            np.nan_to_num(table.numbers([column[name] for name in GAZE[side]])[rows])
            for side in ("left", "right")
        )
        blind = ~(np.abs(left).sum(axis=1) > 0) | ~(np.abs(right).sum(axis=1) > 0)
        left[blind], right[blind] = (0.0, 0.0, -1.0), (0.0, 0.0, -1.0)
        return eye_angles(left, right, turns)
    if set(ANGLES) <= set(column):
        angles = np.nan_to_num(table.numbers([column[name] for name in ANGLES])[rows])
        angles *= angle_unit(angles)[0]
        ahead = np.stack([np.tan(angles[:, 0]), np.tan(angles[:, 1]), np.full(len(angles), -1.0)], axis=1)
        return eye_angles(ahead, ahead, turns)
    return None
