"""Loops of the deformer for those that move some vertices, or move them by other means. Compiled."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float32, Float64, Int64
from fba.compiled import compiled
from fba.face.deform._loops import Scratch, add_shifts, cofactors, compose, copy, place
from fba.face.deform.flat_tables import Shifts, Transforms


@compiled
def deform_chosen(
    values: Float64,
    rest: Float32,
    rows: Int64,
    part_start: Int64,
    shifts: Shifts,
    transforms: Transforms,
    scratch: Scratch,
    out: Float32,
) -> None:
    """values (68,) -> rows (N,) of out (V, 3), in the frame of the head; rest (N, 3), part p's from
    part_start[p] on. Number for number as `deform_frames`."""
    copy(rest, scratch.moved)
    add_shifts(values, shifts, scratch.moved, scratch.touched)
    compose(values, transforms, scratch.poses)
    for part in range(len(scratch.poses) - 1):
        start, stop = int(part_start[part]), int(part_start[part + 1])
        if start == stop:
            continue
        scratch.pose[:] = scratch.poses[part]
        place(scratch.pose, scratch.moved[start:stop], scratch.moved[start:stop])
    for k in range(len(rows)):
        i = rows[k]
        out[i, 0], out[i, 1], out[i, 2] = scratch.moved[k, 0], scratch.moved[k, 1], scratch.moved[k, 2]


@compiled
def motion_of_parts(
    values: Float64, shifts: Shifts, transforms: Transforms, tracks: Float32, poses: Float32
) -> None:
    """What FAPs (68,) do, before it comes to the vertices. tracks (M, 4): the interval that each is in,
    counted from its first, -1 where it does nothing; the steps into it; whether it starts elsewhere than
    at rest; 0. poses (P, 6, 4): how each part is placed, then how its normals are turned, a row a line."""
    whole = np.empty((len(transforms.start) - 1, 3, 4))
    turn = np.empty((3, 3), dtype=np.float32)
    for track in range(len(shifts.column)):
        value = values[shifts.column[track]]
        tracks[track, 0], tracks[track, 1], tracks[track, 2], tracks[track, 3] = -1.0, 0.0, 0.0, 0.0
        if value == 0.0:
            continue
        interval, last = int(shifts.first[track]), int(shifts.first[track + 1]) - 1
        while interval < last and value > shifts.upper[interval]:
            interval += 1
        tracks[track, 0] = interval - int(shifts.first[track])
        tracks[track, 1] = value - shifts.anchor[interval]
        tracks[track, 2] = 1.0 if shifts.base[interval] >= 0 else 0.0
    compose(values, transforms, whole)
    for part in range(len(poses)):
        cofactors(whole[part], turn)
        for row in range(3):
            for column in range(4):
                poses[part, row, column] = whole[part, row, column]
                poses[part, 3 + row, column] = turn[row, column] if column < 3 else 0.0
