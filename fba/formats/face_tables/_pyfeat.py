"""Read tables (CSV) of py-feat: blendshapes or action units of tracked faces.

Version 2 and MPDetector write MediaPipe's blendshapes, which say how far a face moves; they are read. Older
versions write only action units, as probabilities from 0 to 1. Up to `MIN_PROBABILITY` a unit is not shown; a
certain unit is shown with its usual strength.

Versions differ in the unit and the signs of the head's pose. Those of version 2's model, which also gives a
mesh, are known. Otherwise the pose is found from the face's points.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise

import numpy as np

from fba.arrays import Float64, Int64
from fba.capture import ActionUnitMotion, PointMotion, ShapeMotion
from fba.capture.points import find_point_face
from fba.errors import FbaWarning, ModelError
from fba.face.points import HEAD_PITCH, HEAD_ROLL, HEAD_YAW
from fba.formats.face_tables._faces import (
    UnitLayout,
    UnitRows,
    choose_rows,
    find_missing,
    read_unit_rows,
    row_times,
)
from fba.formats.face_tables._tables import Table, header_names, read_table
from fba.formats.face_tables.shape_weights import check_weights, find_lacks, shape_of
from fba.formats.text.frame_rates import Rate
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, stem_of

UNIT = re.compile(r"AU(\d\d)")
BOX = ("FaceRectX", "FaceRectY", "FaceRectWidth", "FaceRectHeight")
SCORE = "FaceScore"
POSE = ("Pitch", "Yaw", "Roll")
MESH_POSE = ("mesh_x_0", "gaze_yaw", *POSE)
"""Columns of version 2's model, whose pose is in radians: down, to the right, to the right."""
MIN_UNITS = 5
"""Fewest action units, or blendshapes, in a table of faces."""
POINT_COUNTS = (68, 478)
LAYOUT = UnitLayout("Identity", "approx_time", strongest=1.0, largest=5.0)
MIN_PROBABILITY = 0.5
"""Probability above which an action unit is present."""
USUAL_STRENGTH = 0.6
"""Intensity of a certain action unit: C, the middle of FACS's five grades, as a share of the strongest."""
CLOSING_UNITS = (43, 45)
"""Action units without intensities: eyes are closed or not."""


def sniff(head: bytes, suffix: str) -> bool:
    """Whether the first line of a file names faces as py-feat does, and action units or blendshapes."""
    names = header_names(head)
    if not {BOX[0], SCORE} <= set(names):
        return False
    shown = (UNIT.fullmatch(name) is not None or shape_of(name) is not None for name in names)
    return sum(shown) >= MIN_UNITS


def read_face(
    path: Path, *, source_rate: Rate | None = None, face: str | None = None, limits: Limits = DEFAULT_LIMITS
) -> ShapeMotion | ActionUnitMotion:
    """Return blendshapes as they are in a table, or action units if it has no blendshapes.

    source_rate: frames per second of the film; None for the rate of films that fits the table's whole
    seconds. face: the `Identity` to read, if there are several; without identities, a number from 1 on, in
    the order of their sizes. Raises FormatError, LimitError.
    """
    table = read_table(path, limits)
    column = table.columns
    shapes = {shape: column[name] for name in column if (shape := shape_of(name)) is not None}
    columns = {int(found[1]): column[name] for name in column if (found := UNIT.fullmatch(name))}
    ids = _identities(table)
    if len(shapes) >= MIN_UNITS:
        return _read_shapes(table, shapes, ids, face, source_rate)
    rows = read_unit_rows(table, columns, LAYOUT, face, source_rate, ids)
    head, how = _find_head(table, rows.numbers, rows.times, rows.rate)
    findings = rows.findings + find_missing(rows.intensities, rows.times, rows.rate)
    findings.append(
        "its action units are how likely each is to be there, not how strong it is: up to "
        f"{MIN_PROBABILITY:g} nothing is shown, at 1 what is usual ({USUAL_STRENGTH:g} of the strongest); "
        "if it has points, these tell more: read it as the format 'points'"
    )
    if POSE[0] in column:
        findings.append(how)
    return ActionUnitMotion(
        rows.units, _usual_strengths(rows), rows.times, rows.rate, head=head, name=stem_of(path),
        findings=tuple(findings),
    )  # fmt: skip


def _read_shapes(
    table: Table, shapes: dict[str, int], ids: Sequence[str], face: str | None, source_rate: Rate | None
) -> ShapeMotion:
    """Return the blendshapes of one face. shapes: ARKit's name -> number of its column."""
    column = table.columns
    rows = choose_rows(table, ids, face)
    times, rate, findings = row_times(
        table, rows, column.get(LAYOUT.seconds), column.get("frame"), source_rate
    )
    weights = table.numbers(list(shapes.values()))[rows]
    check_weights(weights, list(shapes), table.path, [table.lines[row] for row in rows.tolist()])
    head, how = _find_head(table, rows, times, rate)
    findings += find_lacks(list(shapes), weights, times, rate)
    if any(UNIT.fullmatch(name) for name in column):
        findings.append(
            "its blendshapes are read, not its action units, which are only how likely each is to be there"
        )
    if POSE[0] in column and not set(MESH_POSE) <= set(column):
        findings.append(how)
    return ShapeMotion(
        tuple(shapes), weights, times, rate, head=head, name=stem_of(table.path),
        findings=tuple(findings),
    )  # fmt: skip


def _usual_strengths(rows: UnitRows) -> Float64:
    """Return intensities (T, N) of action units, 0 to 1, that follow from their probabilities."""
    sure = np.where(np.isnan(rows.intensities), np.nan, np.maximum(rows.intensities - MIN_PROBABILITY, 0.0))
    strongest = [1.0 if unit in CLOSING_UNITS else USUAL_STRENGTH for unit in rows.units]
    return np.asarray(sure / (1 - MIN_PROBABILITY) * strongest)


def _identities(table: Table) -> Sequence[str]:
    """Return the face of each row (T,), "" if there is one face and it has no name.

    If frames have several rows without names, faces are followed: each continues the nearest box of the frame
    before. They are numbered from "1" on, the largest first.
    """
    column = table.columns
    if LAYOUT.face in column:
        ids = table.column(column[LAYOUT.face])
        if any(ids):
            return ids
    unnamed = [""] * len(table.rows)
    if "frame" not in column or not set(BOX) <= set(column):
        return unnamed
    frames = table.numbers([column["frame"]])[:, 0]
    if (np.diff(frames) != 0).all():
        return unnamed
    box = table.numbers([column[name] for name in BOX])
    owners = _follow(frames, box[:, :2] + box[:, 2:] / 2, box[:, 2:].max(axis=1))
    sizes = [np.nansum(box[owners == owner, 2:].prod(axis=1)) for owner in range(owners.max() + 1)]
    ranks = np.argsort(np.argsort(-np.array(sizes), kind="stable"), kind="stable")
    return [str(ranks[owner] + 1) if owner >= 0 else "" for owner in owners.tolist()]


def _follow(frames: Float64, middles: Float64, sizes: Float64) -> Int64:
    """Return numbers (T,) of the faces of rows; -1 for rows without a face.

    frames: (T,), the frame of each row. middles, sizes: (T, 2) and (T,), middle and size of its face. A face
    that is farther than its size from all faces before is a new one.
    """
    owners = np.full(len(frames), -1)
    known: list[Float64] = []
    starts = np.flatnonzero(np.concatenate([[True], np.diff(frames) != 0, [True]]))
    for first, last in pairwise(starts.tolist()):
        seen = [row for row in range(first, last) if not np.isnan(middles[row]).any()]
        apart = np.array([[np.hypot(*(middles[row] - one)) for one in known] for row in seen])
        free = list(range(len(seen)))
        for _ in range(min(len(seen), len(known))):
            row, owner = divmod(int(apart.argmin()), len(known))
            if apart[row, owner] > sizes[seen[row]]:
                break
            owners[seen[row]] = owner
            free.remove(row)
            apart[row], apart[:, owner] = np.inf, np.inf
        for row in free:
            owners[seen[row]] = len(known)
            known.append(middles[seen[row]])
        for row in seen:
            known[owners[row]] = middles[row]
    return owners


def _find_head(table: Table, rows: Int64, times: Float64, rate: Fraction) -> tuple[Float64 | None, str]:
    """Return pitch, yaw and roll of the head (T, 3), radians, None without points; and a finding about them.

    rows: (T,), numbers of the table's rows. Rows without a face are NaN.
    """
    column = table.columns
    if set(MESH_POSE) <= set(column):
        return table.numbers([column[name] for name in POSE])[rows] * [1.0, -1.0, 1.0], ""
    doubt = "versions of py-feat differ in its unit and its signs"
    left_out = f"the head's pose is left out: {doubt}"
    names = [
        [[f"{axis}_{point}" for point in range(count)] for axis in "xy"]
        for count in POINT_COUNTS if f"x_{count - 1}" in column and f"x_{count}" not in column
    ]  # fmt: skip
    if not names or not all(name in column for axis in names[0] for name in axis):
        return None, left_out
    x, y = (table.numbers([column[name] for name in axis])[rows] for axis in names[0])
    try:
        motion = PointMotion(np.stack([x, y], axis=2), times, rate)
        with warnings.catch_warnings(action="ignore", category=FbaWarning):
            face = find_point_face(motion)
    except ModelError:  # the points are no face
        return None, left_out
    angles: Float64 = face.faps[:, [HEAD_PITCH - 1, HEAD_YAW - 1, HEAD_ROLL - 1]] * face.fapu.AU
    angles[~motion.seen] = np.nan
    return angles, f"the head's pose is found from the face's points instead: {doubt}"
