"""The compiled loops from joint matrices to body animation parameters.

A rotation has two decompositions into turns about three axes, and at gimbal lock infinitely many; the one
closest to the frame before is taken, so that a smooth motion has smooth angles.

Bounds: `BapSolver.solve` checks the shape of matrices, and passes tables of its own joints: three axes of
0..2 and as many columns, below 296, as a joint has freedoms, of which there are at most three; parents come
first. It makes `values` with a row for each frame. For blocks of BLOCK_FRAMES, all else is made here.
`joint_angles` makes its tables and scratch, with a column for each frame of `local`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fba.arrays import Float64, Int32, Int64
from fba.body.solve._pose_loops import UNIT, arc_tangent, sine_cosine
from fba.compiled import compiled, inlined

NEAR_LOCK = 1e-5
"""Below this cosine of the middle angle, only sum or difference of the outer angles is determined."""
WITHIN_REACH = 1e-8
"""A joint of two freedoms reaches a rotation whose component about the third axis is smaller."""
ALMOST = 1e-4
"""Where that component is smaller than this, one step of the search is enough."""
SETTLED = 1e-8
"""Radians: the search for two turns ends when a step changes them by less."""
MAX_SEARCH_STEPS = 12
"""Most steps of the search for two turns."""
BLOCK_FRAMES = 16
"""Frames that are solved together, joint by joint."""
TURN = 2.0 * math.pi


class Freedoms(NamedTuple):
    """The freedoms of J joints.

    counts: int64 (J,), how many each has. axis: int64 (J, 3), which they turn about, outermost first. sign:
    float64 (J, 3). limits: float64 (J, 3, 2), lowest and highest angles.
    """

    counts: Int64
    axis: Int64
    sign: Float64
    limits: Float64


class Joints(NamedTuple):
    """J joints. parents: int64 (J,). freedoms: theirs. bap: int64 (J, 3), their columns of BAPs.

    centre: float64 (3,) of the root. translation: int64 (3,), its columns, -1 for none; metres: float64 (3,),
    signed metres of one unit of each.
    """

    parents: Int64
    freedoms: Freedoms
    bap: Int64
    centre: Float64
    translation: Int64
    metres: Float64


@inlined
def _nearest(angle: float, wanted: float) -> float:
    """Return the angle plus the number of whole turns that bring it closest to the wanted one."""
    return angle + TURN * math.floor((wanted - angle) / TURN + 0.5)


@inlined
def _excess(x: float, y: float, z: float, limits: Float64) -> float:
    """Return the amount by which three angles are outside limits (3, 2), 0 inside."""
    excess: float = max(0.0, limits[0, 0] - x, x - limits[0, 1])
    excess += max(0.0, limits[1, 0] - y, y - limits[1, 1])
    excess += max(0.0, limits[2, 0] - z, z - limits[2, 1])
    return excess


class Scratch(NamedTuple):
    """Working arrays for N frames, which come last in each, so that the processor takes several at a time.

    reached: (J, 3, 3, N), rotations that joints reach. local: (3, 3, N), the rotations wanted of a joint.
    angles: (5, N), three for its angles. one: (3, 3), a rotation.
    """

    reached: Float64
    local: Float64
    angles: Float64
    one: Float64


def allocate_scratch(joints: int, frames: int) -> Scratch:
    """Return working arrays for this number of joints and of frames."""
    reached, local = np.zeros((joints, 3, 3, frames)), np.zeros((3, 3, frames))
    return Scratch(reached, local, np.zeros((5, frames)), np.zeros((3, 3)))


@compiled
def _turn_back(m: Float64, axis: int, angle: float) -> None:
    """m := Rot(axis)^-1 . m, in place: removes an outermost turn."""
    sine, cosine = sine_cosine(angle)
    first = axis + 1 if axis < 2 else 0
    second = axis - 1 if axis > 0 else 2
    for column in range(3):
        a, b = m[first, column], m[second, column]
        m[first, column] = cosine * a + sine * b
        m[second, column] = cosine * b - sine * a


@compiled
def _angle_about(m: Float64, axis: int) -> float:
    """Return the angle about one axis whose rotation is closest to m (largest trace of their quotient)."""
    a = axis + 1 if axis < 2 else 0
    b = axis - 1 if axis > 0 else 2
    return arc_tangent(m[b, a] - m[a, b], m[a, a] + m[b, b])


@compiled
def _refine_two(m: Float64, f: int, a1: int, a2: int, angles: Float64, one: Float64) -> None:
    """Refine frame f of angles (5, N): turns about two axes closest to the rotations m (3, 3, N)."""
    for _ in range(MAX_SEARCH_STEPS if abs(m[a1, a2, f]) > ALMOST else 1):
        change = 0.0
        for turned in range(2):  # coordinate ascent: one turn, then the other, of the inverse rotation
            for i in range(3):
                for k in range(3):
                    one[i, k] = m[k, i, f] if turned else m[i, k, f]
            if turned:
                _turn_back(one, a2, -angles[1, f])
                found = -_angle_about(one, a1)
            else:
                _turn_back(one, a1, angles[0, f])
                found = _angle_about(one, a2)
            change += abs(found - angles[1 - turned, f])
            angles[1 - turned, f] = found
        if change < SETTLED:
            break


@compiled
def _first_angles(scratch: Scratch, frames: int, count: int, axes: tuple[int, int, int], sign: float) -> None:
    """Fill `scratch.angles` with angles about `axes`, outermost first, by themselves in each frame.

    count: freedoms, 1 to 3. sign: 1 for axes in cyclic order, else -1. The fourth row becomes the cosines of
    the middle one of three angles.
    """
    m, angles = scratch.local, scratch.angles
    a1, a2, a3 = axes
    b = a1 + 1 if a1 < 2 else 0
    c = a1 - 1 if a1 > 0 else 2
    for d in range(count):
        below = angles[3] if d == 1 else angles[4]
        row, column, place, s = a1, a3, a1, sign
        if d == 2:
            column, s = a2, -sign
        elif d == 0:
            row, column, place, s = (a3, a2, a2, sign) if count == 2 else (a2, a3, a3, -sign)
        for f in range(frames):
            if count == 1:
                angles[d, f], below[f] = m[c, b, f] - m[b, c, f], m[b, b, f] + m[c, c, f]
            else:
                angles[d, f], below[f] = s * m[row, column, f], m[place, place, f]
        if count == 3 and d == 1:
            for f in range(frames):
                below[f] = math.sqrt(m[a1, a1, f] * m[a1, a1, f] + m[a1, a2, f] * m[a1, a2, f])
        for f in range(frames):
            angles[d, f] = arc_tangent(angles[d, f], below[f])
    if count == 2:
        for f in range(frames):
            if abs(m[a1, a2, f]) > WITHIN_REACH:
                _refine_two(m, f, a1, a2, angles, scratch.one)


@compiled
def _angles(
    scratch: Scratch, frames: int, j: int, freedoms: Freedoms, previous: Float64, bounded: bool
) -> None:
    """Fill `scratch.angles`, outermost first, with the decomposition of rotations `scratch.local`.

    j: the joint, of 1 to 3 freedoms; with one or two, the closest rotation that they can make. First the part
    that depends on no other frame, vectorised; then the choice of whole turns and of one of the two triples,
    frame after frame.
    """
    angles, one = scratch.angles, scratch.one
    count, limits = int(freedoms.counts[j]), freedoms.limits[j]
    a1, a2, a3 = int(freedoms.axis[j, 0]), int(freedoms.axis[j, 1]), int(freedoms.axis[j, 2])
    s1, s2, s3 = freedoms.sign[j, 0], freedoms.sign[j, 1], freedoms.sign[j, 2]
    _first_angles(scratch, frames, count, (a1, a2, a3), 1.0 if (a2 - a1) % 3 == 1 else -1.0)
    first, second, third = previous[j, 0], previous[j, 1], previous[j, 2]
    for f in range(frames):
        x = _nearest(s1 * angles[0, f], first)
        y = _nearest(s2 * angles[1, f], second) if count > 1 else 0.0
        z = 0.0
        if count == 3:
            turn = angles[2, f]
            locked = angles[3, f] < NEAR_LOCK
            if locked:  # the outer angle stays
                for i in range(3):
                    for k in range(3):
                        one[i, k] = scratch.local[i, k, f]
                _turn_back(one, a1, s1 * first)
                _turn_back(one, a2, angles[1, f])
                turn = _angle_about(one, a3)
                x = first
            z = _nearest(s3 * turn, third)
            if not locked:
                # the other triple of angles that makes the same rotation
                u = x + math.pi if x < first else x - math.pi
                v = _nearest(s2 * math.pi - y, second)
                w = z + math.pi if z < third else z - math.pi
                here = (x - first) ** 2 + (y - second) ** 2 + (z - third) ** 2
                other = (u - first) ** 2 + (v - second) ** 2 + (w - third) ** 2
                if bounded and f == 0:
                    out = _excess(x, y, z, limits) - _excess(u, v, w, limits)
                    if abs(out) > UNIT:  # one of them leaves the limits by more
                        here = out
                        other = 0.0
                if other < here:
                    x, y, z = u, v, w
        first, second, third = x, y, z
        angles[0, f], angles[1, f], angles[2, f] = x, y, z
    previous[j, 0], previous[j, 1], previous[j, 2] = first, second, third


@compiled
def solve(
    matrices: Float64,
    joints: Joints,
    previous: Float64,
    bounded: bool,
    largest: int,
    scratch: Scratch,
    values: Int32,
) -> bool:
    """Fill values, int32 (T, 296) of zeros, with the BAPs of joint matrices float64 (T, J, 4, 4).

    Joints whose number of freedoms is 0 stay unturned. previous: float64 (J, 3), angles before the first
    frame, changed. bounded: whether limits count, in the first frame only. largest: magnitude of a value.
    Each joint is solved against the rotation that its parent really reaches, so children make up for what a
    parent cannot do. scratch: for J joints and BLOCK_FRAMES. Returns False where a value would exceed the
    largest.
    """
    axis, sign = joints.freedoms.axis, joints.freedoms.sign
    reached, local, angles = scratch.reached, scratch.local, scratch.angles
    for begin in range(0, values.shape[0], BLOCK_FRAMES):
        frames = min(BLOCK_FRAMES, values.shape[0] - begin)
        for j in range(joints.parents.shape[0]):
            p = int(joints.parents[j])
            count = int(joints.freedoms.counts[j])
            for i in range(3):
                for k in range(3):
                    for f in range(frames):
                        reached[j, i, k, f] = (1.0 if i == k else 0.0) if p < 0 else reached[p, i, k, f]
            if p < 0:
                for i in range(3):
                    column = int(joints.translation[i])
                    if column < 0:
                        continue
                    for f in range(frames):
                        place = matrices[begin + f, j, i, 3] - joints.centre[i]
                        value = math.floor(place / joints.metres[i] + 0.5)
                        if not abs(value) <= largest:
                            return False
                        values[begin + f, column] = int(value)
            if count == 0:
                continue
            for k in range(3):
                for f in range(frames):
                    a, b, c = (
                        matrices[begin + f, j, 0, k],
                        matrices[begin + f, j, 1, k],
                        matrices[begin + f, j, 2, k],
                    )
                    for i in range(3):
                        local[i, k, f] = (
                            a * reached[j, 0, i, f] + b * reached[j, 1, i, f] + c * reached[j, 2, i, f]
                        )
            _angles(scratch, frames, j, joints.freedoms, previous, bounded and begin == 0)
            sines, cosines = angles[3], angles[4]
            for d in range(count):
                column = int(joints.bap[j, d])
                for f in range(frames):
                    value = math.floor(angles[d, f] / UNIT + 0.5)
                    if not abs(value) <= largest:
                        return False
                    values[begin + f, column] = int(value)
                    angles[d, f] = sign[j, d] * UNIT * value
                for f in range(frames):
                    sines[f], cosines[f] = sine_cosine(angles[d, f])
                first = axis[j, d] + 1 if axis[j, d] < 2 else 0
                second = axis[j, d] - 1 if axis[j, d] > 0 else 2
                for i in range(3):
                    for f in range(frames):
                        a, b = reached[j, i, first, f], reached[j, i, second, f]
                        reached[j, i, first, f] = cosines[f] * a + sines[f] * b
                        reached[j, i, second, f] = cosines[f] * b - sines[f] * a
    return True


def joint_angles(local: Float64, count: int, axis: Int64, sign: Float64) -> Float64:
    """Return angles (count, T): the decomposition of local, float64 (3, 3, T), continuous over frames.

    count: number of freedoms, axis int64 (1, 3) and sign float64 (1, 3), see `Convention`.
    """
    # the types that `solve` passes, so that nothing is compiled again
    axis, sign = np.array(axis, dtype=np.int64), np.array(sign)
    freedoms = Freedoms(np.array([count], dtype=np.int64), axis, sign, np.zeros((1, 3, 2)))
    scratch = allocate_scratch(1, local.shape[2])
    scratch.local[:] = local
    _angles(scratch, local.shape[2], 0, freedoms, np.zeros((1, 3)), False)
    return scratch.angles[:count]
