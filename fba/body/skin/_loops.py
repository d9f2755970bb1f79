"""The compiled loops that move vertices with joints: plain functions over NumPy arrays.

Vertices are float32 relative to the root joint, so that a body far from the origin loses no precision.

Bounds: `Skinner` passes arrays of one mesh and skeleton, which `BodyModel` checks: joints of vertices,
parents and neighbours are numbers of these, with at most four joints a vertex. It checks the shape of
vertices, normals and matrices that are given, and `result_array` that of results; scratch is made for its
joints.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Float32, Float64, Int32, Int64
from fba.body.skin._girdle import Girdle, smoothstep_of_one, straighten_armpits, turn_girdles
from fba.compiled import compiled, inlined


class Twisting(NamedTuple):
    """Vertices that are turned about B bones before skinning: see `fba.body.skin.skinning`."""

    rows: Int64
    shares: Float64
    starts: Int64
    joint: Int64
    child: Int64
    centre: Float64
    axis: Float64
    child_axis: Float64


ONE, TWO, HALF = np.float32(1.0), np.float32(2.0), np.float32(0.5)
MIN_SQUARE = np.float32(1e-30)
"""Squared length below which a sum has no direction."""


class Skin(NamedTuple):
    """A mesh that joints move.

    vertices, normals: float32 (V, 3), as modelled. joints, weights: (V, 4), those with a weight first; counts
    (V,): how many those are. neighbours, coefficients: see `normal_rings`. inverse: float64 (J, 4, 4), of
    the bind matrices. scratch: float32 (J, 12). rows: int64 (N,), the vertices to be moved, all or fewer.
    """

    vertices: Float32
    normals: Float32
    joints: Int32
    weights: Float32
    counts: Int32
    neighbours: Int32
    coefficients: Float32
    inverse: Float64
    scratch: Float32
    rows: Int64


class Limbs(NamedTuple):
    """What turns a mesh before it is skinned.

    parents: int64 (J,). twists: vertices turned about bones. girdle: joints that turn with the arms.
    twisted: float32 (V, 3), scratch, must hold the vertices.
    """

    parents: Int64
    twists: Twisting
    girdle: Girdle
    twisted: Float32


@compiled
def dual_frames(matrices: Float64, skin: Skin, limbs: Limbs, out: Float32, normals: Float32) -> None:
    """Fill `out` with T frames of a mesh skinned by dual quaternions, and `normals` with its normals.

    matrices (T, J, 4, 4). out (T, V, 3). normals: the same, or (0, V, 3) for none. Kavan and others,
    "Skinning with dual quaternions", 2007.
    """
    scratch, twisted = skin.scratch, limbs.twisted
    for frame in range(matrices.shape[0]):
        root = matrices[frame, 0]
        joint_duals(matrices[frame], skin.inverse, limbs.parents, scratch)
        _twist_limbs(skin.vertices, limbs.parents, scratch, limbs.twists, twisted)
        turn_girdles(scratch, limbs.girdle)
        frame_normals = normals[frame] if normals.shape[0] else out[frame][:0]
        _skin_dual(twisted, skin, out[frame], frame_normals)
        straighten_armpits(twisted, skin.joints, skin.weights, skin.counts, scratch, limbs.girdle, out[frame])
        if normals.shape[0]:
            _normals_from_neighbours(out[frame], skin, frame_normals)
        _shift(out[frame], skin.rows, root[0, 3], root[1, 3], root[2, 3])


@compiled
def linear_frames(matrices: Float64, skin: Skin, out: Float32, normals: Float32) -> None:
    """Fill `out` and `normals` by linear blend skinning; arguments as of `dual_frames`."""
    for frame in range(matrices.shape[0]):
        root = matrices[frame, 0]
        for joint in range(matrices.shape[1]):
            for row in range(3):
                for column in range(4):
                    total = 0.0
                    for k in range(4):
                        total += matrices[frame, joint, row, k] * skin.inverse[joint, k, column]
                    if column == 3:
                        total -= root[row, 3]
                    skin.scratch[joint, 4 * row + column] = total
        frame_normals = normals[frame] if normals.shape[0] else out[frame][:0]
        _skin_linear(skin, out[frame], frame_normals)
        if normals.shape[0]:
            _normals_from_neighbours(out[frame], skin, frame_normals)
        _shift(out[frame], skin.rows, root[0, 3], root[1, 3], root[2, 3])


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
    """Write to `twisted` vertices of limbs turned about their bones: see `fba.body.skin.skinning`."""
    for bone in range(len(twists.joint)):
        own, child = 0.0, 0.0
        for k in range(2):  # one call: each would be compiled by itself
            joint = twists.child[bone] if k else twists.joint[bone]
            own, child = child, twist(duals, parents, joint, (twists.child_axis if k else twists.axis)[bone])
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
    """Return a joint's turn about an axis, radians, fading to 0 where the limb is turned back on itself."""
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
    """Return the unit quaternion w, x, y, z of the rotation in a matrix (3, 4), by its largest component."""
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
def _skin_dual(vertices: Float32, skin: Skin, out: Float32, normals: Float32) -> None:
    """Fill `out` with twisted vertices (V, 3) of one frame, and normals of those without neighbours."""
    joints, weights, counts, neighbours = skin.joints, skin.weights, skin.counts, skin.neighbours
    rest_normals, duals = skin.normals, skin.scratch
    with_normals = normals.shape[0] > 0
    rows = np.empty((len(duals), 12), dtype=np.float32)
    _matrices(duals, rows)
    for i in skin.rows:
        j = joints[i, 0]
        if counts[i] == 1:  # one joint, as for most of a head: nothing to blend
            px, py, pz = vertices[i, 0], vertices[i, 1], vertices[i, 2]
            out[i, 0] = rows[j, 0] * px + rows[j, 1] * py + rows[j, 2] * pz + rows[j, 3]
            out[i, 1] = rows[j, 4] * px + rows[j, 5] * py + rows[j, 6] * pz + rows[j, 7]
            out[i, 2] = rows[j, 8] * px + rows[j, 9] * py + rows[j, 10] * pz + rows[j, 11]
            if with_normals and neighbours[i, 0] < 0:
                px, py, pz = rest_normals[i, 0], rest_normals[i, 1], rest_normals[i, 2]
                normals[i, 0] = rows[j, 0] * px + rows[j, 1] * py + rows[j, 2] * pz
                normals[i, 1] = rows[j, 4] * px + rows[j, 5] * py + rows[j, 6] * pz
                normals[i, 2] = rows[j, 8] * px + rows[j, 9] * py + rows[j, 10] * pz
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
        # 2 / length^2: normalises, and has the factor 2 of the rotation formula
        factor = TWO / max(w * w + x * x + y * y + z * z, MIN_SQUARE)
        px, py, pz = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        # v + 2 q x (q x v + w v)
        ux, uy, uz = y * pz - z * py + w * px, z * px - x * pz + w * py, x * py - y * px + w * pz
        tx, ty, tz = (
            w * b - x * a + y * d - z * c,
            w * c - y * a + z * b - x * d,
            w * d - z * a + x * c - y * b,
        )
        out[i, 0] = px + factor * (y * uz - z * uy + tx)
        out[i, 1] = py + factor * (z * ux - x * uz + ty)
        out[i, 2] = pz + factor * (x * uy - y * ux + tz)
        if with_normals and neighbours[i, 0] < 0:
            px, py, pz = rest_normals[i, 0], rest_normals[i, 1], rest_normals[i, 2]
            ux, uy, uz = y * pz - z * py + w * px, z * px - x * pz + w * py, x * py - y * px + w * pz
            normals[i, 0] = px + factor * (y * uz - z * uy)
            normals[i, 1] = py + factor * (z * ux - x * uz)
            normals[i, 2] = pz + factor * (x * uy - y * ux)


@compiled
def _matrices(duals: Float32, rows: Float32) -> None:
    """Fill rows (J, 12) with the 3x4 matrices of dual quaternions (J, 8), row by row."""
    for j in range(len(duals)):
        w, x, y, z = duals[j, 0], duals[j, 1], duals[j, 2], duals[j, 3]
        a, b, c, d = duals[j, 4], duals[j, 5], duals[j, 6], duals[j, 7]
        factor = TWO / max(w * w + x * x + y * y + z * z, MIN_SQUARE)
        rows[j, 0], rows[j, 1], rows[j, 2] = (
            ONE - factor * (y * y + z * z),
            factor * (x * y - w * z),
            factor * (x * z + w * y),
        )
        rows[j, 4], rows[j, 5], rows[j, 6] = (
            factor * (x * y + w * z),
            ONE - factor * (x * x + z * z),
            factor * (y * z - w * x),
        )
        rows[j, 8], rows[j, 9], rows[j, 10] = (
            factor * (x * z - w * y),
            factor * (y * z + w * x),
            ONE - factor * (x * x + y * y),
        )
        rows[j, 3] = factor * (w * b - x * a + y * d - z * c)
        rows[j, 7] = factor * (w * c - y * a + z * b - x * d)
        rows[j, 11] = factor * (w * d - z * a + x * c - y * b)


@compiled
def _skin_linear(skin: Skin, out: Float32, normals: Float32) -> None:
    """Fill the same as `_skin_dual`, with the 3x4 matrices of joints, rows (J, 12)."""
    vertices, joints, weights, counts = skin.vertices, skin.joints, skin.weights, skin.counts
    rest_normals, neighbours, rows = skin.normals, skin.neighbours, skin.scratch
    with_normals = normals.shape[0] > 0
    m = np.empty(12, dtype=np.float32)
    for i in skin.rows:
        m[:] = 0
        for k in range(counts[i]):
            j, share = joints[i, k], weights[i, k]
            for e in range(12):
                m[e] += share * rows[j, e]
        px, py, pz = vertices[i, 0], vertices[i, 1], vertices[i, 2]
        out[i, 0] = m[0] * px + m[1] * py + m[2] * pz + m[3]
        out[i, 1] = m[4] * px + m[5] * py + m[6] * pz + m[7]
        out[i, 2] = m[8] * px + m[9] * py + m[10] * pz + m[11]
        if with_normals and neighbours[i, 0] < 0:
            px, py, pz = rest_normals[i, 0], rest_normals[i, 1], rest_normals[i, 2]
            nx = m[0] * px + m[1] * py + m[2] * pz
            ny = m[4] * px + m[5] * py + m[6] * pz
            nz = m[8] * px + m[9] * py + m[10] * pz
            length = nx * nx + ny * ny + nz * nz
            factor = ONE / np.sqrt(length) if length > MIN_SQUARE else ONE
            normals[i, 0] = nx * factor
            normals[i, 1] = ny * factor
            normals[i, 2] = nz * factor


@compiled
def _normals_from_neighbours(positions: Float32, skin: Skin, normals: Float32) -> None:
    """Fill normals from the positions of neighbours: see `normal_rings`."""
    neighbours, coefficients = skin.neighbours, skin.coefficients
    for i in skin.rows:
        a, b, c, d = neighbours[i, 0], neighbours[i, 1], neighbours[i, 2], neighbours[i, 3]
        if a < 0:
            continue
        tx, ty, tz = (
            positions[a, 0] - positions[c, 0],
            positions[a, 1] - positions[c, 1],
            positions[a, 2] - positions[c, 2],
        )
        ux, uy, uz = (
            positions[b, 0] - positions[d, 0],
            positions[b, 1] - positions[d, 1],
            positions[b, 2] - positions[d, 2],
        )
        x, y, z = coefficients[i, 0], coefficients[i, 1], coefficients[i, 2]
        nx = x * tx + y * ux + z * (ty * uz - tz * uy)
        ny = x * ty + y * uy + z * (tz * ux - tx * uz)
        nz = x * tz + y * uz + z * (tx * uy - ty * ux)
        length = nx * nx + ny * ny + nz * nz
        factor = ONE / np.sqrt(length) if length > MIN_SQUARE else ONE
        normals[i, 0] = nx * factor
        normals[i, 1] = ny * factor
        normals[i, 2] = nz * factor


@compiled
def _shift(positions: Float32, rows: Int64, x: float, y: float, z: float) -> None:
    """Shift positions to the world, in place; done last, so that large offsets cost no precision."""
    for i in rows:
        positions[i, 0] += x
        positions[i, 1] += y
        positions[i, 2] += z
