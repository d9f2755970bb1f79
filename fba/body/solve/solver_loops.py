"""The compiled loops from joint matrices to body animation parameters.

A rotation has two decompositions into turns about three axes, and at gimbal lock infinitely many; the one
closest to the frame before is taken, so that a smooth motion has smooth angles.

Bounds: `BapSolver.solve` checks the shape of matrices, and passes tables of its own joints: three axes of
0..2 and as many columns, below 296, as a joint has freedoms, of which there are at most three; parents come
first. It makes `values` with a row for each frame. For blocks of BLOCK_FRAMES, all else is made here.
`joint_angles` makes all arrays that it does not get; angles have a column for each frame of `local`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fba.arrays import Bool, Float64, Int32, Int64
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
def _excess(angle: float, bounds: Float64) -> float:
    """Return the amount by which an angle is outside bounds (2,), 0 inside."""
    return max(0.0, float(bounds[0]) - angle, angle - float(bounds[1]))


@inlined
def _turn(m: Float64, axis: int, sine: float, cosine: float) -> None:
    """m := m . Rot(axis), in place."""
    first = axis + 1 if axis < 2 else 0
    second = axis - 1 if axis > 0 else 2
    for row in range(3):
        a = float(m[row, first])
        b = float(m[row, second])
        m[row, first] = cosine * a + sine * b
        m[row, second] = cosine * b - sine * a


@inlined
def _turn_rows(m: Float64, axis: int, sine: float, cosine: float) -> None:
    """m := Rot(axis)^-1 . m, in place: removes an outermost turn."""
    first = axis + 1 if axis < 2 else 0
    second = axis - 1 if axis > 0 else 2
    for column in range(3):
        a = float(m[first, column])
        b = float(m[second, column])
        m[first, column] = cosine * a + sine * b
        m[second, column] = cosine * b - sine * a


@inlined
def _angle_about(m: Float64, axis: int) -> float:
    """Return the angle about one axis whose rotation is closest to m (largest trace of their quotient)."""
    a = axis + 1 if axis < 2 else 0
    b = axis - 1 if axis > 0 else 2
    return arc_tangent(m[b, a] - m[a, b], m[a, a] + m[b, b])


@compiled
def _refine_two(m: Float64, f: int, a1: int, a2: int, start: Float64, work: Float64) -> None:
    """Refine frame f of start (3, N), in place: turns about two axes closest to the rotations m (3, 3, N)."""
    x = float(start[0, f])
    y = float(start[1, f])
    steps = MAX_SEARCH_STEPS if abs(m[a1, a2, f]) > ALMOST else 1
    for _ in range(steps):  # coordinate ascent: one turn, then the other
        for i in range(3):
            for k in range(3):
                work[i, k] = m[i, k, f]
        sine, cosine = sine_cosine(x)
        _turn_rows(work, a1, sine, cosine)
        y_new = _angle_about(work, a2)
        for i in range(3):
            for k in range(3):
                work[i, k] = m[i, k, f]
        sine, cosine = sine_cosine(-y_new)
        _turn(work, a2, sine, cosine)
        x_new = _angle_about(work, a1)
        change = abs(x_new - x) + abs(y_new - y)
        x = x_new
        y = y_new
        if change < SETTLED:
            break
    start[0, f] = x
    start[1, f] = y


@compiled
def _third_angle_at_lock(
    m: Float64, f: int, axes: tuple[int, int, int], outer: float, middle: float, work: Float64
) -> float:
    """Return the third angle at gimbal lock, where the outer one is given."""
    a1, a2, a3 = axes
    for i in range(3):
        for k in range(3):
            work[i, k] = m[i, k, f]
    sine, cosine = sine_cosine(outer)
    _turn_rows(work, a1, sine, cosine)
    sine, cosine = sine_cosine(middle)
    _turn_rows(work, a2, sine, cosine)
    return _angle_about(work, a3)


@compiled
def _angles(
    m: Float64, frames: int, j: int, freedoms: Freedoms, previous: Float64, bounded: bool, angles: Float64
) -> None:
    """Fill angles (3, N), outermost first, with the decomposition of rotations m (3, 3, N).

    j: the joint, of 1 to 3 freedoms; with one or two, the closest rotation that they can make. First the part
    that depends on no other frame, vectorised; then the choice of whole turns and of one of the two triples,
    frame after frame.
    """
    count, sign, limits = int(freedoms.counts[j]), freedoms.sign, freedoms.limits
    work, cosines = np.zeros((3, 3)), np.zeros(frames)
    a1 = int(freedoms.axis[j, 0])
    a2 = int(freedoms.axis[j, 1])
    a3 = int(freedoms.axis[j, 2])
    e = 1.0 if (a2 - a1) % 3 == 1 else -1.0
    if count == 1:
        b = a1 + 1 if a1 < 2 else 0
        c = a1 - 1 if a1 > 0 else 2
        for f in range(frames):
            angles[0, f] = arc_tangent(m[c, b, f] - m[b, c, f], m[b, b, f] + m[c, c, f])
    elif count == 2:
        for f in range(frames):
            angles[0, f] = arc_tangent(e * m[a3, a2, f], m[a2, a2, f])
        for f in range(frames):
            angles[1, f] = arc_tangent(e * m[a1, a3, f], m[a1, a1, f])
        for f in range(frames):
            if abs(m[a1, a2, f]) > WITHIN_REACH:
                _refine_two(m, f, a1, a2, angles, work)
    else:
        for f in range(frames):
            cosines[f] = math.sqrt(m[a1, a1, f] * m[a1, a1, f] + m[a1, a2, f] * m[a1, a2, f])
        for f in range(frames):
            angles[0, f] = arc_tangent(-e * m[a2, a3, f], m[a3, a3, f])
        for f in range(frames):
            angles[1, f] = arc_tangent(e * m[a1, a3, f], cosines[f])
        for f in range(frames):
            angles[2, f] = arc_tangent(-e * m[a1, a2, f], m[a1, a1, f])

    first = float(previous[j, 0])
    second = float(previous[j, 1])
    third = float(previous[j, 2])
    for f in range(frames):
        x = _nearest(float(sign[j, 0]) * float(angles[0, f]), first)
        y = _nearest(float(sign[j, 1]) * float(angles[1, f]), second) if count > 1 else 0.0
        z = 0.0
        if count == 3:
            if cosines[f] < NEAR_LOCK:
                x = first
                turn = _third_angle_at_lock(m, f, (a1, a2, a3), sign[j, 0] * first, angles[1, f], work)
                z = _nearest(float(sign[j, 2]) * turn, third)
            else:
                z = _nearest(float(sign[j, 2]) * float(angles[2, f]), third)
                # the other triple of angles that makes the same rotation
                u = x + math.pi if x < first else x - math.pi
                v = _nearest(float(sign[j, 1]) * math.pi - y, second)
                w = z + math.pi if z < third else z - math.pi
                here = (x - first) ** 2 + (y - second) ** 2 + (z - third) ** 2
                other = (u - first) ** 2 + (v - second) ** 2 + (w - third) ** 2
                if bounded and f == 0:
                    out = (
                        _excess(x, limits[j, 0])
                        + _excess(y, limits[j, 1])
                        + _excess(z, limits[j, 2])
                        - _excess(u, limits[j, 0])
                        - _excess(v, limits[j, 1])
                        - _excess(w, limits[j, 2])
                    )
                    if abs(out) > UNIT:  # one of them leaves the limits by more
                        here = out
                        other = 0.0
                if other < here:
                    x, y, z = u, v, w
        first, second, third = x, y, z
        angles[0, f] = x
        angles[1, f] = y
        angles[2, f] = z
    previous[j, 0] = first
    previous[j, 1] = second
    previous[j, 2] = third


@compiled
def solve(
    matrices: Float64,
    joints: Joints,
    wanted: Bool,
    previous: Float64,
    bounded: bool,
    largest: int,
    values: Int32,
) -> bool:
    """Fill values, int32 (T, 296) of zeros, with the BAPs of joint matrices float64 (T, J, 4, 4).

    wanted: bool (J,), joints to solve; the others stay unturned. previous: float64 (J, 3), angles before the
    first frame, changed. bounded: whether limits count, in the first frame only. largest: magnitude of a
    value. Each joint is solved against the rotation that its parent really reaches, so children make up for
    what a parent cannot do. Returns False where a value would exceed the largest.
    """
    axis, sign = joints.freedoms.axis, joints.freedoms.sign
    size = joints.parents.shape[0]
    reached = np.zeros((size, 3, 3, BLOCK_FRAMES))  # frames innermost: vector code
    local = np.zeros((3, 3, BLOCK_FRAMES))
    angles = np.zeros((3, BLOCK_FRAMES))
    sines = np.zeros(BLOCK_FRAMES)
    cosines = np.zeros(BLOCK_FRAMES)
    for begin in range(0, values.shape[0], BLOCK_FRAMES):
        frames = min(BLOCK_FRAMES, values.shape[0] - begin)
        for j in range(size):
            p = int(joints.parents[j])
            count = int(joints.freedoms.counts[j]) if wanted[j] else 0
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
                    a = float(matrices[begin + f, j, 0, k])
                    b = float(matrices[begin + f, j, 1, k])
                    c = float(matrices[begin + f, j, 2, k])
                    for i in range(3):
                        local[i, k, f] = (
                            a * reached[j, 0, i, f] + b * reached[j, 1, i, f] + c * reached[j, 2, i, f]
                        )
            _angles(local, frames, j, joints.freedoms, previous, bounded and begin == 0, angles)
            for d in range(count):
                column = int(joints.bap[j, d])
                for f in range(frames):
                    value = math.floor(angles[d, f] / UNIT + 0.5)
                    if not abs(value) <= largest:
                        return False
                    values[begin + f, column] = int(value)
                    angles[d, f] = float(sign[j, d]) * UNIT * value
                for f in range(frames):
                    sine, cosine = sine_cosine(float(angles[d, f]))
                    sines[f] = sine
                    cosines[f] = cosine
                first = int(axis[j, d]) + 1 if axis[j, d] < 2 else 0
                second = int(axis[j, d]) - 1 if axis[j, d] > 0 else 2
                for i in range(3):
                    for f in range(frames):
                        a = float(reached[j, i, first, f])
                        b = float(reached[j, i, second, f])
                        reached[j, i, first, f] = cosines[f] * a + sines[f] * b
                        reached[j, i, second, f] = cosines[f] * b - sines[f] * a
    return True


def joint_angles(local: Float64, count: int, axis: Int64, sign: Float64, angles: Float64) -> None:
    """Fill angles (3, T) with the decomposition of local, float64 (3, 3, T), continuous over frames.

    count: number of freedoms, axis int64 (1, 3) and sign float64 (1, 3), see `Convention`.
    """
    # the types that `solve` passes, so that nothing is compiled again
    axis, sign = np.array(axis, dtype=np.int64), np.array(sign)
    freedoms = Freedoms(np.array([count], dtype=np.int64), axis, sign, np.zeros((1, 3, 2)))
    _angles(local, local.shape[2], 0, freedoms, np.zeros((1, 3)), False, angles)
