"""The deformer's loops over vertices and triangles, compiled (see `fba.compiled`).

For each frame the neutral face is copied, every FAP that is not 0 adds its shifts, normals are summed over
the triangles of the parts that changed, and the transforms of each part and of the head are applied.

Bounds: tables and scratch are those of one model (`Deformer`), whose rows, corners, columns and parts lie
within it (`FaceModel` checks that, `flat_tables` and `build_surface` number them, `Deformer.restrict` takes
some of them); `frame_values` makes sure of 68 values a frame, `result_array` of room for every vertex. No
index comes from a value of a FAP but the interval, which stops at the last one of its track.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Array, Float32, Float64, Int64, UInt32
from fba.compiled import compiled
from fba.face.deform._normals import Surface
from fba.face.deform.flat_tables import MovingMesh, Shifts, Transforms

MIN_SQUARE = np.float32(1e-30)
"""Squared length of a sum of normals below which it has no direction."""
MAX_SQUARE = np.float32(1e30)
"""Squared length of a sum of normals above which products with it overflow."""
ZERO = np.float32(0)
ONE = np.float32(1)


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
def poses_of_frames(values: Float64, transforms: Transforms, with_head: bool, poses: Float64) -> None:
    """Write to `poses` (T, P + 1, 3, 4) the product of each part's transforms by FAPs `values` (T, 68).

    The last one is that of the head. with_head: those of parts are multiplied by it.
    """
    head = poses.shape[1] - 1
    for frame in range(len(values)):
        for down in range(head + 1):
            pose = poses[frame, head - down]
            for row in range(3):
                for column in range(4):
                    own = 1.0 if row == column else 0.0
                    pose[row, column] = poses[frame, head, row, column] if with_head and down else own
            for k in range(transforms.start[head - down], transforms.start[head - down + 1]):
                value = values[frame, transforms.column[k]]
                if value != 0.0:
                    _transform(pose, transforms.kind[k], value, transforms.amount[k], transforms.centre[k])


@compiled
def _transform(pose: Float64, kind: int, value: float, amount: Float64, centre: Float64) -> None:
    """Multiply a pose (3, 4) by one transform, in place; kind: index in `flat_tables.KIND_ORDER`."""
    x, y, z = value * amount[0], value * amount[1], value * amount[2]
    px, py, pz = centre[0], centre[1], centre[2]
    s, d = 0.0, 0.0
    if kind == 1:
        angle = np.sqrt(x * x + y * y + z * z)
        if angle == 0.0:
            return
        x, y, z = x / angle, y / angle, z / angle
        s, d = np.sin(angle), 1.0 - np.cos(angle)
    for row in range(3):
        a, b, c = pose[row, 0], pose[row, 1], pose[row, 2]
        if kind == 0:
            pose[row, 3] += a * x + b * y + c * z
            continue
        before = a * px + b * py + c * pz
        if kind == 1:
            along = d * (a * x + b * y + c * z)
            e, f, g = b * z - c * y, c * x - a * z, a * y - b * x
            a, b, c = (
                a - d * a + along * x + s * e,
                b - d * b + along * y + s * f,
                c - d * c + along * z + s * g,
            )
        else:
            a, b, c = a + a * x, b + b * y, c + c * z
        pose[row, 0], pose[row, 1], pose[row, 2] = a, b, c
        pose[row, 3] += before - (a * px + b * py + c * pz)


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
        for corner in range(3):
            i = corners[k, corner]
            sum_x[i] += nx
            sum_y[i] += ny
            sum_z[i] += nz


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
    surface: Surface, touched: bool, part: int, turn: Float32, rows: UInt32, out: Float32
) -> None:
    """Write the normals of a part's vertices `rows` (N,) to those of `out` (V, 3).

    touched: use the new sums of normals, not the neutral ones.
    """
    neutral, units = surface.neutral, surface.units
    first, stop = int(surface.changing_start[part]), int(surface.changing_start[part + 1])
    turn_normals(turn, surface.sums if touched else neutral, neutral, units, first, stop)
    first, stop = int(surface.still_start[part]), int(surface.still_start[part + 1])
    turn_normals(turn, neutral, neutral, units, first, stop)
    sum_of = surface.sum_of
    unit_x, unit_y, unit_z = units[0], units[1], units[2]
    for k in range(len(rows)):
        v = rows[k]
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
def transform_rows(pose: Array, rows: UInt32, moved: Array, out: Array) -> None:
    """Write the points `rows` (N,) of `moved` (V, 3), transformed by `pose` (3, 4), to those of `out`."""
    xx, xy, xz, x0 = pose[0, 0], pose[0, 1], pose[0, 2], pose[0, 3]
    yx, yy, yz, y0 = pose[1, 0], pose[1, 1], pose[1, 2], pose[1, 3]
    zx, zy, zz, z0 = pose[2, 0], pose[2, 1], pose[2, 2], pose[2, 3]
    for k in range(len(rows)):
        v = rows[k]
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
    """(N, P + 1, 3, 4) the poses of up to N frames, the head's last."""
    pose: Float32
    """(3, 4) one of them in the vertices' precision."""
    turn: Float32
    """(3, 3) the same for normals."""


def allocate_scratch(vertices: int, parts: int, frames: int) -> Scratch:
    """Return the working arrays for a face of this number of vertices and parts, up to N frames at once."""
    return Scratch(
        moved=np.empty((vertices, 3), dtype=np.float32),
        touched=np.zeros(parts, dtype=np.int64),
        poses=np.empty((frames, parts + 1, 3, 4)),
        pose=np.empty((3, 4), dtype=np.float32),
        turn=np.empty((3, 3), dtype=np.float32),
    )


@compiled
def deform_frames(
    values: Float64, mesh: MovingMesh, scratch: Scratch, out: Float32, normals: Float32
) -> None:
    """Write the vertices for FAPs `values` (T, 68) to `out` and their normals to `normals`, both (T, V, 3).

    Only those in `mesh.rows`. normals: (0, V, 3) for none. The first T of `scratch.poses` must be those of
    the frames.
    """
    starts, surface, moved, pose = mesh.rows_start, mesh.surface, scratch.moved, scratch.pose
    for frame in range(len(values)):
        for v in range(len(moved)):
            moved[v, 0], moved[v, 1], moved[v, 2] = mesh.rest[v, 0], mesh.rest[v, 1], mesh.rest[v, 2]
        scratch.touched[:] = 0
        add_shifts(values[frame], mesh.shifts, moved, scratch.touched)
        for part in range(len(starts) - 1):
            combined = scratch.poses[frame, part]
            for row in range(3):
                for column in range(4):
                    pose[row, column] = combined[row, column]
            rows = mesh.rows[int(starts[part]) : int(starts[part + 1])]
            transform_rows(pose, rows, moved, out[frame])
            if len(normals) == 0:
                continue
            cofactors(combined, scratch.turn)
            touched = scratch.touched[part] == 1
            if touched:
                sum_normals(moved, surface, part)
            write_normals(surface, touched, part, scratch.turn, rows, normals[frame])


@compiled
def points_of_frames(
    values: Float64, poses: Float64, rest: Float64, owner: Int64, shifts: Shifts, out: Float64
) -> None:
    """Write points for FAPs (T, 68) to `out` (T, N, 3).

    poses: (T, P + 1, 3, 4) as of `poses_of_frames`. owner: (N,) which of them points follow, or -1 for none.
    """
    touched = np.zeros(poses.shape[1], dtype=np.int64)
    for frame in range(len(values)):
        moved = out[frame]
        for point in range(len(rest)):
            for axis in range(3):
                moved[point, axis] = rest[point, axis]
        add_shifts(values[frame], shifts, moved, touched)
        for point in range(len(rest)):
            if owner[point] >= 0:
                own = moved[point : point + 1]
                transform_points(poses[frame, owner[point]], own, own)
