"""The deformer's loops over vertices and triangles, compiled (see `fba.compiled`).

For each frame the neutral face is copied, every FAP that is not 0 adds its shifts, normals are summed over
the triangles of the parts that changed, and the transforms of each part and of the head are applied.

Bounds: tables and scratch are those of one model (`Deformer`), whose rows, corners, columns and parts lie
within it (`FaceModel` checks that, `flat_tables` and `build_surface` number them); `frame_values` makes sure
of 68 values a frame, `result_array` of room for every vertex. No index comes from a value of a FAP but the
interval, which stops at the last one of its track.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Array, Float32, Float64, Int64
from fba.compiled import compiled
from fba.face.deform._normals import Surface
from fba.face.deform.flat_tables import FlatModel, Shifts, Transforms

MIN_SQUARE = np.float32(1e-30)
"""Squared length of a sum of normals below which it has no direction."""
MAX_SQUARE = np.float32(1e30)
"""Squared length of a sum of normals above which products with it overflow."""
ZERO = np.float32(0)
ONE = np.float32(1)


@compiled
def copy(source: Array, target: Array) -> None:
    """Copy a contiguous array to another of its shape.

    Runs faster than `target[:] = source`, which iterates over rows and columns, and compiles faster, as it
    needs no error for shapes that differ.
    """
    values, result = source.reshape(-1), target.reshape(-1)
    for k in range(len(values)):
        result[k] = values[k]


@compiled
def add_shifts(values: Float64, shifts: Shifts, moved: Array, touched: Int64) -> None:
    """Add to `moved` (V, 3) the shifts by FAPs (68,); set `touched` (P,) to 1 for parts that move."""
    for track in range(len(shifts.column)):
        value = values[shifts.column[track]]
        if value == 0.0:
            continue
        interval, last = int(shifts.first[track]), int(shifts.first[track + 1]) - 1
        while interval < last and value > shifts.upper[interval]:
            interval += 1
        touched[shifts.part[track]] = 1
        # The detour through an array rounds to the tables' dtype, so that the sums below stay in it.
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
    """Write to `poses` (P + 1, 3, 4) the product of each part's transforms, and last that of the head's."""
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
            transform_matrix(int(transforms.kind[k]), value, transforms.amount[k], transforms.centre[k], one)
            multiply(pose, one, product)
            copy(product, pose)


@compiled
def transform_matrix(kind: int, value: float, amount: Float64, centre: Float64, result: Float64) -> None:
    """Write one transform to `result` (3, 4); kind: index in `flat_tables.KIND_ORDER`."""
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
    """Write outer . inner to `result`; all (3, 4), with 0 0 0 1 as the fourth row."""
    for i in range(3):
        for j in range(4):
            result[i, j] = outer[i, 0] * inner[0, j] + outer[i, 1] * inner[1, j] + outer[i, 2] * inner[2, j]
        result[i, 3] += outer[i, 3]


@compiled
def poses_of_frames(values: Float64, transforms: Transforms, poses: Float64) -> None:
    """Write to `poses` (T, P + 1, 3, 4) what `compose` does for each of FAPs `values` (T, 68)."""
    for frame in range(len(values)):
        compose(values[frame], transforms, poses[frame])


@compiled
def sum_normals(moved: Float32, surface: Surface, part: int) -> None:
    """Sum, for each corner, the normals of a part's triangles, as long as twice their area."""
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
        i, j, m = corners[k, 0], corners[k, 1], corners[k, 2]
        sum_x[i] += nx
        sum_y[i] += ny
        sum_z[i] += nz
        sum_x[j] += nx
        sum_y[j] += ny
        sum_z[j] += nz
        sum_x[m] += nx
        sum_y[m] += ny
        sum_z[m] += nz


@compiled
def turn_normals(
    turn: Float32, source: Float32, neutral: Float32, units: Float32, start: int, stop: int
) -> None:
    """Write normals `source` (3, N), rotated by `turn` (3, 3) and normalised, to `units` (3, N).

    Only columns start to stop. A sum without a direction is replaced by the neutral normal.
    """
    xx, xy, xz = turn[0, 0], turn[0, 1], turn[0, 2]
    yx, yy, yz = turn[1, 0], turn[1, 1], turn[1, 2]
    zx, zy, zz = turn[2, 0], turn[2, 1], turn[2, 2]
    # Index the row first, then slice it: the compiler knows only then that the slice is contiguous.
    from_x, from_y, from_z = source[0][start:stop], source[1][start:stop], source[2][start:stop]
    rest_x, rest_y, rest_z = neutral[0][start:stop], neutral[1][start:stop], neutral[2][start:stop]
    to_x, to_y, to_z = units[0][start:stop], units[1][start:stop], units[2][start:stop]
    for k in range(len(to_x)):
        x, y, z = from_x[k], from_y[k], from_z[k]
        squared = x * x + y * y + z * z
        good = (squared > MIN_SQUARE) & (squared < MAX_SQUARE)
        x, y, z = x if good else rest_x[k], y if good else rest_y[k], z if good else rest_z[k]
        nx, ny, nz = xx * x + xy * y + xz * z, yx * x + yy * y + yz * z, zx * x + zy * y + zz * z
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        scale = ONE / length if length > ZERO else ONE
        to_x[k], to_y[k], to_z[k] = nx * scale, ny * scale, nz * scale


@compiled
def write_normals(
    surface: Surface, touched: bool, part: int, turn: Float32, start: int, out: Float32
) -> None:
    """Write the normals of a part to `out` (N, 3).

    start: the part's first vertex. touched: use the new sums of normals, not the neutral ones.
    """
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
def transform_points(pose: Array, moved: Array, out: Array) -> None:
    """Write points `moved` (N, 3), transformed by `pose` (3, 4), to `out` (N, 3)."""
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
    """Write to `result` (3, 3) the matrix that transforms normals as `pose` does surfaces, up to a factor."""
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
    """Working arrays for one frame."""

    moved: Float32
    """(V, 3) vertices after all shifts."""
    touched: Int64
    """(P,) 1 where a FaceDefMesh of a FAP that is not 0 moves the part."""
    poses: Float64
    """(P + 1, 3, 4), the head's last."""
    combined: Float64
    """(3, 4) the transforms of a part, then those of the head."""
    pose: Float32
    """(3, 4) `combined` in the vertices' precision."""
    turn: Float32
    """(3, 3) `combined` for normals."""


def allocate_scratch(vertices: int, parts: int) -> Scratch:
    """Return the working arrays for a face of this number of vertices and parts."""
    return Scratch(
        moved=np.empty((vertices, 3), dtype=np.float32),
        touched=np.zeros(parts, dtype=np.int64),
        poses=np.empty((parts + 1, 3, 4)),
        combined=np.empty((3, 4)),
        pose=np.empty((3, 4), dtype=np.float32),
        turn=np.empty((3, 3), dtype=np.float32),
    )


@compiled
def deform_frames(
    values: Float64, tables: FlatModel, scratch: Scratch, with_head: bool, out: Float32, normals: Float32
) -> None:
    """Write the vertices for FAPs `values` (T, 68) to `out` and their normals to `normals`, both (T, V, 3).

    normals: (0, V, 3) for none. with_head: apply the head's transforms.
    """
    part_start, surface = tables.part_start, tables.surface
    for frame in range(len(values)):
        copy(tables.rest, scratch.moved)
        scratch.touched[:] = 0
        add_shifts(values[frame], tables.shifts, scratch.moved, scratch.touched)
        compose(values[frame], tables.transforms, scratch.poses)
        head = len(scratch.poses) - 1
        for part in range(head):
            if with_head:
                multiply(scratch.poses[head], scratch.poses[part], scratch.combined)
            else:
                copy(scratch.poses[part], scratch.combined)
            copy(scratch.combined, scratch.pose)
            start, stop = int(part_start[part]), int(part_start[part + 1])
            transform_points(scratch.pose, scratch.moved[start:stop], out[frame, start:stop])
            if len(normals) == 0:
                continue
            cofactors(scratch.combined, scratch.turn)
            touched = scratch.touched[part] == 1
            if touched:
                sum_normals(scratch.moved, surface, part)
            write_normals(surface, touched, part, scratch.turn, start, normals[frame, start:stop])


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
    """Write points for FAPs (T, 68) to `out` (T, N, 3). owner: (N,) whose transforms they follow, or -1."""
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
                transform_points(poses[owner[point]], own, own)
            if with_head:
                transform_points(poses[head], own, own)
