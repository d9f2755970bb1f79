"""The deformer's loops over vertices and triangles, compiled (see `fba.compiled`).

A frame: the neutral face is copied, every active FAP adds its shifts, normals are summed over the
triangles of the parts that changed, and each part is then turned and placed together with the head.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Array, Float32, Float64, Int64
from fba.compiled import compiled
from fba.face.deform.flat_tables import Shifts, Transforms
from fba.face.deform.normals import Surface

SHORTEST = np.float32(1e-30)
"""Squared length of a sum of normals below which it has no direction."""
LONGEST = np.float32(1e30)
ZERO, ONE = np.float32(0), np.float32(1)


@compiled
def copy(source: Array, target: Array) -> None:
    """Faster than `target[:] = source`, which counts in rows and columns; and sooner compiled: that has words
    for shapes that do not fit."""
    flat, place = source.reshape(-1), target.reshape(-1)
    for k in range(len(flat)):
        place[k] = flat[k]


@compiled
def add_shifts(values: Float64, shifts: Shifts, moved: Array, touched: Int64) -> None:
    """Add to `moved` (V, 3) what the FAPs (68,) do; touched[part] becomes 1 where they do something."""
    for track in range(len(shifts.column)):
        value = values[shifts.column[track]]
        if value == 0.0:
            continue
        interval, last = int(shifts.first[track]), int(shifts.first[track + 1]) - 1
        while interval < last and value > shifts.upper[interval]:
            interval += 1
        touched[shifts.part[track]] = 1
        # Through an array, so that the sum below is one of numbers of the tables' own precision.
        shifts.amount[0] = value - shifts.anchor[interval]
        steps = shifts.amount[0]
        start, stop = int(shifts.start[interval]), int(shifts.start[interval + 1])
        rows, slopes = shifts.rows[start:stop], shifts.slopes[start:stop]
        base = int(shifts.base[interval])
        if base < 0:
            for k in range(len(rows)):
                i = rows[k]
                moved[i, 0] += steps * slopes[k, 0]
                moved[i, 1] += steps * slopes[k, 1]
                moved[i, 2] += steps * slopes[k, 2]
        else:
            bases = shifts.bases[base : base + stop - start]
            for k in range(len(rows)):
                i = rows[k]
                moved[i, 0] += bases[k, 0] + steps * slopes[k, 0]
                moved[i, 1] += bases[k, 1] + steps * slopes[k, 1]
                moved[i, 2] += bases[k, 2] + steps * slopes[k, 2]


@compiled
def compose(values: Float64, transforms: Transforms, poses: Float64) -> None:
    """poses (P + 1, 3, 4): the product of each part's transforms, and last the head's."""
    one = np.empty((3, 4))
    product = np.empty((3, 4))
    for part in range(len(poses)):
        pose = poses[part]
        pose[:] = 0.0
        for axis in range(3):
            pose[axis, axis] = 1.0
        for k in range(int(transforms.start[part]), int(transforms.start[part + 1])):
            value = values[transforms.column[k]]
            if value == 0.0:
                continue
            single(int(transforms.kind[k]), value, transforms.amount[k], transforms.centre[k], one)
            multiply(pose, one, product)
            copy(product, pose)


@compiled
def single(kind: int, value: float, amount: Float64, centre: Float64, result: Float64) -> None:
    """result (3, 4): one transform; kind as in `deformer_tables.KIND_ORDER`."""
    x, y, z = value * amount[0], value * amount[1], value * amount[2]
    result[:] = 0.0
    if kind == 0:
        result[0, 0] = result[1, 1] = result[2, 2] = 1.0
        result[0, 3], result[1, 3], result[2, 3] = x, y, z
        return
    if kind == 1:
        angle = np.sqrt(x * x + y * y + z * z)
        if angle > 0.0:
            x, y, z = x / angle, y / angle, z / angle
        c, s = np.cos(angle), np.sin(angle)
        d = 1.0 - c
        result[0, 0], result[0, 1], result[0, 2] = x * x * d + c, x * y * d - z * s, x * z * d + y * s
        result[1, 0], result[1, 1], result[1, 2] = y * x * d + z * s, y * y * d + c, y * z * d - x * s
        result[2, 0], result[2, 1], result[2, 2] = z * x * d - y * s, z * y * d + x * s, z * z * d + c
    else:
        result[0, 0], result[1, 1], result[2, 2] = 1.0 + x, 1.0 + y, 1.0 + z
    for axis in range(3):
        turned = result[axis, 0] * centre[0] + result[axis, 1] * centre[1] + result[axis, 2] * centre[2]
        result[axis, 3] = centre[axis] - turned


@compiled
def multiply(outer: Float64, inner: Float64, result: Float64) -> None:
    """result = outer . inner, all (3, 4), as if below them stood 0 0 0 1."""
    for i in range(3):
        for j in range(4):
            result[i, j] = outer[i, 0] * inner[0, j] + outer[i, 1] * inner[1, j] + outer[i, 2] * inner[2, j]
        result[i, 3] += outer[i, 3]


@compiled
def poses_of_frames(values: Float64, transforms: Transforms, poses: Float64) -> None:
    """values (T, 68) -> poses (T, P + 1, 3, 4)."""
    for frame in range(len(values)):
        compose(values[frame], transforms, poses[frame])


@compiled
def sum_normals(moved: Float32, surface: Surface, part: int) -> None:
    """Add the triangles of a part, as vectors of twice their area, to the sums of their corners."""
    sum_x, sum_y, sum_z = surface.sums[0], surface.sums[1], surface.sums[2]
    for k in range(int(surface.changing_start[part]), int(surface.changing_start[part + 1])):
        sum_x[k] = sum_y[k] = sum_z[k] = 0.0
    start, stop = int(surface.triangles_start[part]), int(surface.triangles_start[part + 1])
    triangles, corners = surface.triangles[start:stop], surface.corners[start:stop]
    for k in range(len(triangles)):
        a, b, c = triangles[k, 0], triangles[k, 1], triangles[k, 2]
        x, y, z = moved[a, 0], moved[a, 1], moved[a, 2]
        ux, uy, uz = moved[b, 0] - x, moved[b, 1] - y, moved[b, 2] - z
        vx, vy, vz = moved[c, 0] - x, moved[c, 1] - y, moved[c, 2] - z
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        i, j, l = corners[k, 0], corners[k, 1], corners[k, 2]  # noqa: E741
        sum_x[i] += nx
        sum_y[i] += ny
        sum_z[i] += nz
        sum_x[j] += nx
        sum_y[j] += ny
        sum_z[j] += nz
        sum_x[l] += nx
        sum_y[l] += ny
        sum_z[l] += nz


@compiled
def turn_normals(
    turn: Float32, source: Float32, neutral: Float32, units: Float32, start: int, stop: int
) -> None:
    """units (3, N) from start to stop: source (3, N) turned by `turn` (3, 3) and made unit vectors.

    Where triangles have no area, or no direction together, the neutral normal stands in.
    """
    xx, xy, xz = turn[0, 0], turn[0, 1], turn[0, 2]
    yx, yy, yz = turn[1, 0], turn[1, 1], turn[1, 2]
    zx, zy, zz = turn[2, 0], turn[2, 1], turn[2, 2]
    # A row first, then a part of it: in one step it would no longer be known to be contiguous.
    from_x, from_y, from_z = source[0][start:stop], source[1][start:stop], source[2][start:stop]
    rest_x, rest_y, rest_z = neutral[0][start:stop], neutral[1][start:stop], neutral[2][start:stop]
    to_x, to_y, to_z = units[0][start:stop], units[1][start:stop], units[2][start:stop]
    for k in range(len(to_x)):
        x, y, z = from_x[k], from_y[k], from_z[k]
        squared = x * x + y * y + z * z
        good = (squared > SHORTEST) & (squared < LONGEST)
        x, y, z = x if good else rest_x[k], y if good else rest_y[k], z if good else rest_z[k]
        nx, ny, nz = xx * x + xy * y + xz * z, yx * x + yy * y + yz * z, zx * x + zy * y + zz * z
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        scale = ONE / length if length > ZERO else ONE
        to_x[k], to_y[k], to_z[k] = nx * scale, ny * scale, nz * scale


@compiled
def place_normals(
    surface: Surface, touched: bool, part: int, turn: Float32, start: int, out: Float32
) -> None:
    """out (N, 3): normals of a part, whose vertices begin at `start`; touched: its sums are new."""
    neutral, units = surface.neutral, surface.units
    first, stop = int(surface.changing_start[part]), int(surface.changing_start[part + 1])
    turn_normals(turn, surface.sums if touched else neutral, neutral, units, first, stop)
    first, stop = int(surface.still_start[part]), int(surface.still_start[part + 1])
    turn_normals(turn, neutral, neutral, units, first, stop)
    sum_of = surface.sum_of[start : start + len(out)]
    unit_x, unit_y, unit_z = units[0], units[1], units[2]
    for v in range(len(out)):
        i = sum_of[v]
        out[v, 0], out[v, 1], out[v, 2] = unit_x[i], unit_y[i], unit_z[i]


@compiled
def place(pose: Array, moved: Array, out: Array) -> None:
    """out (N, 3) = pose (3, 4) applied to moved (N, 3)."""
    xx, xy, xz, x0 = pose[0, 0], pose[0, 1], pose[0, 2], pose[0, 3]
    yx, yy, yz, y0 = pose[1, 0], pose[1, 1], pose[1, 2], pose[1, 3]
    zx, zy, zz, z0 = pose[2, 0], pose[2, 1], pose[2, 2], pose[2, 3]
    for v in range(len(moved)):
        x, y, z = moved[v, 0], moved[v, 1], moved[v, 2]
        out[v, 0] = xx * x + xy * y + xz * z + x0
        out[v, 1] = yx * x + yy * y + yz * z + y0
        out[v, 2] = zx * x + zy * y + zz * z + z0


@compiled
def cofactors(pose: Float64, result: Float32) -> None:
    """result (3, 3): how `pose` turns the vectors that stand upright on a surface, up to a factor."""
    largest = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for m in range(3):
            n, o = (m + 1) % 3, (m + 2) % 3
            largest = max(largest, abs(pose[j, n] * pose[k, o] - pose[j, o] * pose[k, n]))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        for m in range(3):
            n, o = (m + 1) % 3, (m + 2) % 3
            if largest > 0.0:
                result[i, m] = (pose[j, n] * pose[k, o] - pose[j, o] * pose[k, n]) / largest
            else:  # shrunk to a line or a point
                result[i, m] = 1.0 if i == m else 0.0


class Scratch(NamedTuple):
    """What a frame needs room for."""

    moved: Float32
    """(V, 3) vertices after all shifts."""
    touched: Int64
    """(P,) whether a FaceDefMesh of an active FAP moves the part."""
    poses: Float64
    """(P + 1, 3, 4), the head's last."""
    whole: Float64
    """(3, 4) a part's pose within the head's."""
    pose: Float32
    """(3, 4) the same, for the vertices."""
    turn: Float32
    """(3, 3) the same, for the normals."""


@compiled
def deform_frames(
    values: Float64,
    rest: Float32,
    part_start: Int64,
    shifts: Shifts,
    transforms: Transforms,
    surface: Surface,
    scratch: Scratch,
    with_head: bool,
    out: Float32,
    normals: Float32,
) -> None:
    """values (T, 68), rest (V, 3) -> out (T, V, 3), normals (T, V, 3), or (0, V, 3) for none."""
    for frame in range(len(values)):
        copy(rest, scratch.moved)
        scratch.touched[:] = 0
        add_shifts(values[frame], shifts, scratch.moved, scratch.touched)
        compose(values[frame], transforms, scratch.poses)
        head = len(scratch.poses) - 1
        for part in range(head):
            if with_head:
                multiply(scratch.poses[head], scratch.poses[part], scratch.whole)
            else:
                copy(scratch.poses[part], scratch.whole)
            copy(scratch.whole, scratch.pose)
            start, stop = int(part_start[part]), int(part_start[part + 1])
            place(scratch.pose, scratch.moved[start:stop], out[frame, start:stop])
            if len(normals) == 0:
                continue
            cofactors(scratch.whole, scratch.turn)
            touched = scratch.touched[part] == 1
            if touched:
                sum_normals(scratch.moved, surface, part)
            place_normals(surface, touched, part, scratch.turn, start, normals[frame, start:stop])


@compiled
def points_of_frames(
    values: Float64,
    rest: Float64,
    owner: Int64,
    shifts: Shifts,
    transforms: Transforms,
    with_head: bool,
    out: Float64,
) -> None:
    """values (T, 68), rest (N, 3), owner (N,), the part of each point or -1 -> out (T, N, 3)."""
    head = len(transforms.start) - 2
    poses = np.empty((head + 1, 3, 4))
    touched = np.zeros(head, dtype=np.int64)
    moved = np.empty_like(rest)
    for frame in range(len(values)):
        copy(rest, moved)
        add_shifts(values[frame], shifts, moved, touched)
        compose(values[frame], transforms, poses)
        for point in range(len(rest)):
            own = out[frame, point : point + 1]
            copy(moved[point], own)
            if owner[point] >= 0:
                place(poses[owner[point]], own, own)
            if with_head:
                place(poses[head], own, own)
