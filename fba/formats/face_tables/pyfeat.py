"""Read tables (CSV) of py-feat: action units of tracked faces.

Action units go from 0 to 1. Versions differ in unit and signs of the head's pose (degrees or radians), so it
is found from the 68 points of the face that tables have, too.
"""

from __future__ import annotations

import re
import warnings
from fractions import Fraction
from pathlib import Path as FilePath

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64
from fba.capture.action_units import ActionUnitMotion
from fba.capture.points import PointMotion
from fba.capture.points.conversion import find_point_face
from fba.errors import FbaWarning, ModelError
from fba.face.points import HEAD_PITCH, HEAD_ROLL, HEAD_YAW
from fba.formats.face_tables._faces import find_missing, to_animation
from fba.formats.face_tables._tables import Table, header_names, read_table
from fba.formats.face_tables._unit_rows import UnitLayout, UnitRows, number_columns, read_unit_rows
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path

UNIT = re.compile(r"AU(\d\d)")
BOX = ("FaceRectX", "FaceScore")
FEWEST = 5
POINTS = 68
LAYOUT = UnitLayout("Identity", "approx_time", strongest=1.0, largest=5.0)


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first line of a file names action units and faces as py-feat does."""
    names = header_names(head)
    return set(BOX) <= set(names) and sum(UNIT.fullmatch(name) is not None for name in names) >= FEWEST


def read(
    path: Path,
    *,
    rate: Fraction | int | str | None = None,
    fps: Fraction | int | str | None = None,
    face: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> Animation:
    """Return a tracked face as FAPs, at `rate` or at the rate of the film.

    The options are those of `read_face`, and `fba.capture.from_action_units` says how it is done. Warns
    (FbaWarning) of what is odd. Raises FormatError, LimitError.
    """
    return to_animation(read_face(path, fps=fps, face=face, limits=limits), rate, path, limits)


def read_face(
    path: Path,
    *,
    fps: Fraction | int | str | None = None,
    face: str | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> ActionUnitMotion:
    """Return action units as they are in a table.

    fps: frames in a second of the film, which most tables do not have. face: the `Identity` of the face to
    read, where there are several. Raises FormatError, LimitError.
    """
    table = read_table(path, limits)
    column = number_columns(table)
    columns = {int(found[1]): column[name] for name in column if (found := UNIT.fullmatch(name))}
    rows = read_unit_rows(table, columns, LAYOUT, face, fps)
    findings = rows.findings + find_missing(rows.intensities, rows.times, rows.rate)
    head = _find_head(table, rows)
    if "Pitch" in column:
        done = "left out" if head is None else "found from the face's points instead"
        findings.append(f"the head's pose is {done}: versions of py-feat differ in its unit and its signs")
    return ActionUnitMotion(
        rows.units, rows.intensities, rows.times, rows.rate, head=head, name=FilePath(path).stem,
        findings=tuple(findings),
    )  # fmt: skip


def _find_head(table: Table, rows: UnitRows) -> Float64 | None:
    """Return pitch, yaw and roll of the head (T, 3), radians, from 68 points; None without them."""
    column = number_columns(table)
    names = [[f"{axis}_{point}" for point in range(POINTS)] for axis in "xy"]
    if not all(name in column for axis in names for name in axis):
        return None
    x, y = (table.numbers([column[name] for name in axis])[rows.numbers] for axis in names)
    try:
        motion = PointMotion(np.stack([x, y], axis=2), rows.times, rows.rate)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FbaWarning)
            face = find_point_face(motion)
    except ModelError:  # the points are no face
        return None
    angles: Float64 = face.faps[:, [HEAD_PITCH - 1, HEAD_YAW - 1, HEAD_ROLL - 1]] * face.fapu.AU
    angles[np.isnan(rows.intensities).any(axis=1)] = np.nan
    return angles
