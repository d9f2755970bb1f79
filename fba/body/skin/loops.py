"""The loops that move vertices with joints. Compiled; plain functions over NumPy arrays.

Everything is in 32 bits, relative to the root joint, so that a body far from the origin loses nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Float32, Float64, Int32, Int64
from fba.body.skin._girdle_loops import Girdle, straighten_armpits, turn_girdles
from fba.compiled import compiled, inlined
from fba.easing import smoothstep_of_one


class Twisting(NamedTuple):
    """Vertices that are turned about B bones before skinning: see `fba.body.skin._twisting`."""

    rows: Int64
    shares: Float64
    starts: Int64
    joint: Int64
    child: Int64
    centre: Float64
    axis: Float64
    child_axis: Float64


ONE, TWO, HALF = np.float32(1.0), np.float32(2.0), np.float32(0.5)
TINY = np.float32(1e-30)


@compiled
def dual_frames(
    matrices: Float64, inverse: Float64, parents: Int64, vertices: Float32, upright: Float32,
    joints: Int32, weights: Float32, counts: Int32, around: Int32, numbers: Float32, scratch: Float32,
    twists: Twisting, girdle: Girdle, twisted: Float32, out: Float32, normals: Float32,
) -> None:  # fmt: skip
    """Dual-quaternion skinning of T frames (Kavan and others, "Skinning with dual quaternions", 2007).

    matrices (T, J, 4, 4). inverse (J, 4, 4): of the bind matrices. vertices, upright (V, 3): as modelled.
    joints, weights (V, 4): those with a weight first; counts (V,): how many these are. around, numbers: see
    `normal_rings`. scratch (J, 12). twists: vertices turned beforehand. girdle: joints that turn with the
    arms. twisted (V, 3): scratch, must hold the vertices. out (T, V, 3). normals: the same, or (0, V, 3) for
    none.
    """
    for frame in range(matrices.shape[0]):
        root = matrices[frame, 0]
        joint_duals(matrices[frame], inverse, parents, scratch)
        _twist_limbs(vertices, parents, scratch, twists, twisted)
        turn_girdles(scratch, girdle)
        upper = normals[frame] if normals.shape[0] else out[frame]
        wanted = upright if normals.shape[0] else upright[:0]
        _skin_dual(twisted, joints, weights, counts, scratch, out[frame], wanted, around, upper)
        straighten_armpits(twisted, joints, weights, counts, scratch, girdle, out[frame])
        if normals.shape[0]:
            _normals_from_neighbours(out[frame], around, numbers, upper)
        _shift(out[frame], root[0, 3], root[1, 3], root[2, 3])


@compiled
def linear_frames(
    matrices: Float64, inverse: Float64, vertices: Float32, upright: Float32,
    joints: Int32, weights: Float32, counts: Int32, around: Int32, numbers: Float32, scratch: Float32,
    out: Float32, normals: Float32,
) -> None:  # fmt: skip
    """Linear-blend skinning of T frames; arguments as `dual_frames`."""
    for frame in range(matrices.shape[0]):
        root = matrices[frame, 0]
        for joint in range(matrices.shape[1]):
            for row in range(3):
                for column in range(4):
                    total = 0.0
                    for k in range(4):
                        total += matrices[frame, joint, row, k] * inverse[joint, k, column]
                    if column == 3:
                        total -= root[row, 3]
                    scratch[joint, 4 * row + column] = total
        upper = normals[frame] if normals.shape[0] else out[frame]
        wanted = upright if normals.shape[0] else upright[:0]
        _skin_linear(vertices, joints, weights, counts, scratch, out[frame], wanted, around, upper)
        if normals.shape[0]:
            _normals_from_neighbours(out[frame], around, numbers, upper)
        _shift(out[frame], root[0, 3], root[1, 3], root[2, 3])


@compiled
def joint_duals(matrices: Float64, inverse: Float64, parents: Int64, duals: Float32) -> None:
    """Fill duals (J, 8), w x y z: unit dual quaternions of joint matrices (J, 4, 4).

    The rotation comes first, then half the shift (from the root) times it. Of the two quaternions of a
    rotation, each joint takes the one nearer to its parent's, so that blends take the short way.
    """
    s = np.empty((3, 4))
    root = matrices[0]
    for joint in range(matrices.shape[0]):
        for row in range(3):
            for column in range(4):
                total = 0.0
                for k in range(4):
                    total += matrices[joint, row, k] * inverse[joint, k, column]
                s[row, column] = total
        w, x, y, z = _quaternion(s)
        parent = int(parents[joint])
        if parent >= 0:
            nearer = w * duals[parent, 0] + x * duals[parent, 1] + y * duals[parent, 2] + z * duals[parent, 3]
            if nearer < 0.0:
                w, x, y, z = -w, -x, -y, -z
        tx, ty, tz = s[0, 3] - root[0, 3], s[1, 3] - root[1, 3], s[2, 3] - root[2, 3]
        duals[joint, 0] = w
        duals[joint, 1] = x
        duals[joint, 2] = y
        duals[joint, 3] = z
        duals[joint, 4] = -0.5 * (tx * x + ty * y + tz * z)
        duals[joint, 5] = 0.5 * (tx * w + ty * z - tz * y)
        duals[joint, 6] = 0.5 * (ty * w + tz * x - tx * z)
        duals[joint, 7] = 0.5 * (tz * w + tx * y - ty * x)


@compiled
def _twist_limbs(
    vertices: Float32, parents: Int64, duals: Float32, twists: Twisting, twisted: Float32
) -> None:
    """Turn vertices of limbs about their bones into `twisted`: see `fba.body.skin._twisting`."""
    for bone in range(len(twists.joint)):
        own = twist(duals, parents, int(twists.joint[bone]), twists.axis[bone])
        child = twist(duals, parents, int(twists.child[bone]), twists.child_axis[bone])
        axis, centre = twists.axis[bone], twists.centre[bone]
        ax, ay, az = axis[0], axis[1], axis[2]
        for k in range(twists.starts[bone], twists.starts[bone + 1]):
            i = twists.rows[k]
            angle = twists.shares[k, 0] * own + twists.shares[k, 1] * child
            s, c = np.sin(angle), np.cos(angle)
            px, py, pz = vertices[i, 0] - centre[0], vertices[i, 1] - centre[1], vertices[i, 2] - centre[2]
            along = (ax * px + ay * py + az * pz) * (1.0 - c)
            twisted[i, 0] = px * c + (ay * pz - az * py) * s + ax * along + centre[0]
            twisted[i, 1] = py * c + (az * px - ax * pz) * s + ay * along + centre[1]
            twisted[i, 2] = pz * c + (ax * py - ay * px) * s + az * along + centre[2]


@inlined
def twist(duals: Float32, parents: Int64, joint: int, axis: Float64) -> float:
    """Return angle by which a joint turns about an axis, seen from its parent, radians.

    It fades to 0 where the limb points the opposite way, as the twist is undefined there.
    """
    parent = int(parents[joint])
    if parent < 0:
        return 0.0
    w, x, y, z = duals[parent, 0], duals[parent, 1], duals[parent, 2], duals[parent, 3]
    a, b, c, d = duals[joint, 0], duals[joint, 1], duals[joint, 2], duals[joint, 3]
    scalar = w * a + x * b + y * c + z * d
    about = (
        axis[0] * (w * b - x * a - y * d + z * c)
        + axis[1] * (w * c + x * d - y * a - z * b)
        + axis[2] * (w * d - x * c + y * b - z * a)
    )
    fade = smoothstep_of_one((scalar * scalar + about * about - 0.03) / 0.12)
    angle: float = 2.0 * np.arctan2(about, scalar) * fade
    return angle


@inlined
def _quaternion(s: Float64) -> tuple[float, float, float, float]:
    """Return unit quaternion w, x, y, z of the rotation in a matrix (3, 4), from its largest component."""
    trace = s[0, 0] + s[1, 1] + s[2, 2]
    if trace > 0.0:
        r = np.sqrt(1.0 + trace)
        h = 0.5 / r
        w, x, y, z = 0.5 * r, (s[2, 1] - s[1, 2]) * h, (s[0, 2] - s[2, 0]) * h, (s[1, 0] - s[0, 1]) * h
    elif s[0, 0] >= s[1, 1] and s[0, 0] >= s[2, 2]:
        r = np.sqrt(1.0 + s[0, 0] - s[1, 1] - s[2, 2])
        h = 0.5 / r
        w, x, y, z = (s[2, 1] - s[1, 2]) * h, 0.5 * r, (s[0, 1] + s[1, 0]) * h, (s[0, 2] + s[2, 0]) * h
    elif s[1, 1] >= s[2, 2]:
        r = np.sqrt(1.0 + s[1, 1] - s[0, 0] - s[2, 2])
        h = 0.5 / r
        w, x, y, z = (s[0, 2] - s[2, 0]) * h, (s[0, 1] + s[1, 0]) * h, 0.5 * r, (s[1, 2] + s[2, 1]) * h
    else:
        r = np.sqrt(1.0 + s[2, 2] - s[0, 0] - s[1, 1])
        h = 0.5 / r
        w, x, y, z = (s[1, 0] - s[0, 1]) * h, (s[0, 2] + s[2, 0]) * h, (s[1, 2] + s[2, 1]) * h, 0.5 * r
    length = 1.0 / np.sqrt(w * w + x * x + y * y + z * z)
    return w * length, x * length, y * length, z * length


@compiled
def _skin_dual(
    vertices: Float32, joints: Int32, weights: Float32, counts: Int32, duals: Float32,
    out: Float32, upright: Float32, around: Int32, normals: Float32,
) -> None:  # fmt: skip
    with_normals = upright.shape[0] > 0
    tops = np.empty((len(duals), 12), dtype=np.float32)
    _matrices(duals, tops)
    for i in range(vertices.shape[0]):
        j = joints[i, 0]
        if counts[i] == 1:  # one joint, as for most of a head: nothing to blend
            px, py, pz = vertices[i, 0], vertices[i, 1], vertices[i, 2]
            out[i, 0] = tops[j, 0] * px + tops[j, 1] * py + tops[j, 2] * pz + tops[j, 3]
            out[i, 1] = tops[j, 4] * px + tops[j, 5] * py + tops[j, 6] * pz + tops[j, 7]
            out[i, 2] = tops[j, 8] * px + tops[j, 9] * py + tops[j, 10] * pz + tops[j, 11]
            if with_normals and around[i, 0] < 0:
                px, py, pz = upright[i, 0], upright[i, 1], upright[i, 2]
                normals[i, 0] = tops[j, 0] * px + tops[j, 1] * py + tops[j, 2] * pz
                normals[i, 1] = tops[j, 4] * px + tops[j, 5] * py + tops[j, 6] * pz
                normals[i, 2] = tops[j, 8] * px + tops[j, 9] * py + tops[j, 10] * pz
            continue
        share = weights[i, 0]
        w, x, y, z = share * duals[j, 0], share * duals[j, 1], share * duals[j, 2], share * duals[j, 3]
        a, b, c, d = share * duals[j, 4], share * duals[j, 5], share * duals[j, 6], share * duals[j, 7]
        for k in range(1, counts[i]):
            j, share = joints[i, k], weights[i, k]
            w += share * duals[j, 0]
            x += share * duals[j, 1]
            y += share * duals[j, 2]
            z += share * duals[j, 3]
            a += share * duals[j, 4]
            b += share * duals[j, 5]
            c += share * duals[j, 6]
            d += share * duals[j, 7]
        # 2 / length^2: normalises, with the factor 2 of the rotation formula.
        per = TWO / max(w * w + x * x + y * y + z * z, TINY)
        px, py, pz = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        # v + 2 q x (q x v + w v)
        ux, uy, uz = y * pz - z * py + w * px, z * px - x * pz + w * py, x * py - y * px + w * pz
        tx, ty, tz = (
            w * b - x * a + y * d - z * c,
            w * c - y * a + z * b - x * d,
            w * d - z * a + x * c - y * b,
        )
        out[i, 0] = px + per * (y * uz - z * uy + tx)
        out[i, 1] = py + per * (z * ux - x * uz + ty)
        out[i, 2] = pz + per * (x * uy - y * ux + tz)
        if with_normals and around[i, 0] < 0:
            px, py, pz = upright[i, 0], upright[i, 1], upright[i, 2]
            ux, uy, uz = y * pz - z * py + w * px, z * px - x * pz + w * py, x * py - y * px + w * pz
            normals[i, 0] = px + per * (y * uz - z * uy)
            normals[i, 1] = py + per * (z * ux - x * uz)
            normals[i, 2] = pz + per * (x * uy - y * ux)


@compiled
def _matrices(duals: Float32, tops: Float32) -> None:
    """Fill tops (J, 12) with the 3x4 matrices of dual quaternions (J, 8), row by row."""
    for j in range(len(duals)):
        w, x, y, z = duals[j, 0], duals[j, 1], duals[j, 2], duals[j, 3]
        a, b, c, d = duals[j, 4], duals[j, 5], duals[j, 6], duals[j, 7]
        per = TWO / max(w * w + x * x + y * y + z * z, TINY)
        tops[j, 0], tops[j, 1], tops[j, 2] = (
            ONE - per * (y * y + z * z),
            per * (x * y - w * z),
            per * (x * z + w * y),
        )
        tops[j, 4], tops[j, 5], tops[j, 6] = (
            per * (x * y + w * z),
            ONE - per * (x * x + z * z),
            per * (y * z - w * x),
        )
        tops[j, 8], tops[j, 9], tops[j, 10] = (
            per * (x * z - w * y),
            per * (y * z + w * x),
            ONE - per * (x * x + y * y),
        )
        tops[j, 3] = per * (w * b - x * a + y * d - z * c)
        tops[j, 7] = per * (w * c - y * a + z * b - x * d)
        tops[j, 11] = per * (w * d - z * a + x * c - y * b)


@compiled
def scale_and_shift(vertices: Float32, size: float, shift: Float32, out: Float32) -> None:
    """out (V, 3) = size x vertices + shift (3,)."""
    times = np.float32(size)
    x, y, z = shift[0], shift[1], shift[2]
    for i in range(len(vertices)):
        out[i, 0] = times * vertices[i, 0] + x
        out[i, 1] = times * vertices[i, 1] + y
        out[i, 2] = times * vertices[i, 2] + z


@compiled
def _skin_linear(
    vertices: Float32, joints: Int32, weights: Float32, counts: Int32, tops: Float32,
    out: Float32, upright: Float32, around: Int32, normals: Float32,
) -> None:  # fmt: skip
    with_normals = upright.shape[0] > 0
    m = np.empty(12, dtype=np.float32)
    for i in range(vertices.shape[0]):
        m[:] = 0
        for k in range(counts[i]):
            j, share = joints[i, k], weights[i, k]
            for e in range(12):
                m[e] += share * tops[j, e]
        px, py, pz = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        out[i, 0] = m[0] * px + m[1] * py + m[2] * pz + m[3]
        out[i, 1] = m[4] * px + m[5] * py + m[6] * pz + m[7]
        out[i, 2] = m[8] * px + m[9] * py + m[10] * pz + m[11]
        if with_normals and around[i, 0] < 0:
            px, py, pz = upright[i, 0], upright[i, 1], upright[i, 2]
            nx = m[0] * px + m[1] * py + m[2] * pz
            ny = m[4] * px + m[5] * py + m[6] * pz
            nz = m[8] * px + m[9] * py + m[10] * pz
            length = nx * nx + ny * ny + nz * nz
            per = ONE / np.sqrt(length) if length > TINY else ONE
            normals[i, 0] = nx * per
            normals[i, 1] = ny * per
            normals[i, 2] = nz * per


@compiled
def _normals_from_neighbours(places: Float32, around: Int32, numbers: Float32, normals: Float32) -> None:
    """Normals from the positions of neighbours: see `normal_rings`."""
    for i in range(places.shape[0]):
        a, b, c, d = around[i, 0], around[i, 1], around[i, 2], around[i, 3]
        if a < 0:
            continue
        tx, ty, tz = places[a, 0] - places[c, 0], places[a, 1] - places[c, 1], places[a, 2] - places[c, 2]
        ux, uy, uz = places[b, 0] - places[d, 0], places[b, 1] - places[d, 1], places[b, 2] - places[d, 2]
        x, y, z = numbers[i, 0], numbers[i, 1], numbers[i, 2]
        nx = x * tx + y * ux + z * (ty * uz - tz * uy)
        ny = x * ty + y * uy + z * (tz * ux - tx * uz)
        nz = x * tz + y * uz + z * (tx * uy - ty * ux)
        length = nx * nx + ny * ny + nz * nz
        per = ONE / np.sqrt(length) if length > TINY else ONE
        normals[i, 0] = nx * per
        normals[i, 1] = ny * per
        normals[i, 2] = nz * per


@compiled
def _shift(places: Float32, x: float, y: float, z: float) -> None:
    """Positions from the root's frame to the world; done last, so that large offsets cost no precision."""
    for i in range(places.shape[0]):
        places[i, 0] += x
        places[i, 1] += y
        places[i, 2] += z
