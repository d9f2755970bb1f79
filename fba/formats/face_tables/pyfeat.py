"""Read tables (CSV) of py-feat: action units of tracked faces.

Action units go from 0 to 1. The head's pose is left out, as versions differ in its unit and its signs.
"""

from __future__ import annotations

import re
from fractions import Fraction
from pathlib import Path as FilePath

from fba.animation import Animation
from fba.capture.action_units import ActionUnitMotion
from fba.formats.face_tables._faces import find_missing, to_animation
from fba.formats.face_tables._tables import header_names, read_table
from fba.formats.face_tables._unit_rows import UnitLayout, number_columns, read_unit_rows
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path

UNIT = re.compile(r"AU(\d\d)")
BOX = ("FaceRectX", "FaceScore")
FEWEST = 5
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
    if "Pitch" in column:
        findings.append("the head's pose is left out: versions of py-feat differ in its unit and its signs")
    return ActionUnitMotion(
        rows.units, rows.intensities, rows.times, rows.rate, name=FilePath(path).stem,
        findings=tuple(findings),
    )  # fmt: skip
