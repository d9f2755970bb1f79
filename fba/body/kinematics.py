"""The compiled loops of the BAP solver: angles -> joint matrices, and back.

A joint's rotation is a product of up to three turns about different axes of the body's frame,
outermost first. Nothing is allocated per joint; matrices are unrolled into rows of the output.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from fba.compiled import compiled, inlined

Float = npt.NDArray[np.float64]
Int = npt.NDArray[np.int64]

UNIT = 1e-5
"""Radians in one unit of a rotational BAP."""
MILLIMETRE = 1e-3

NEAR_LOCK = 1e-5
"""Below this cosine of the middle angle, only sum or difference of the outer angles is determined."""
TURN = 2.0 * math.pi


@inlined
def _turn(matrix: Float, axis: int, angle: float) -> None:
    """matrix := matrix . Rot(axis, angle), in place, on the upper left 3 x 3."""
    c = math.cos(angle)
    s = math.sin(angle)
    first = (axis + 1) % 3
    second = (axis + 2) % 3
    for row in range(3):
        a = float(matrix[row, first])
        b = float(matrix[row, second])
        matrix[row, first] = c * a + s * b
        matrix[row, second] = c * b - s * a


@compiled
def pose(
    values: Float,
    parents: Int,
    offsets: Float,
    bap: Int,
    axis: Int,
    sign: Float,
    translation: Int,
    translation_sign: Float,
    result: Float,
) -> None:
    """values float64 (T, 296) -> result float64 (T, J, 4, 4), given filled with 0.

    offsets: float64 (J, 3) from the parent; bap, axis, sign: (J, 3), see `Convention`.
    """
    for t in range(values.shape[0]):
        for j in range(parents.shape[0]):
            m = result[t, j]
            p = int(parents[j])
            if p < 0:
                for i in range(3):
                    m[i, i] = 1.0
                    m[i, 3] = offsets[j, i]
                    column = int(translation[i])
                    if column >= 0:
                        m[i, 3] += MILLIMETRE * float(translation_sign[i]) * float(values[t, column])
            else:
                q = result[t, p]
                for i in range(3):
                    for k in range(3):
                        m[i, k] = q[i, k]
                    m[i, 3] = (
                        q[i, 3] + q[i, 0] * offsets[j, 0] + q[i, 1] * offsets[j, 1] + q[i, 2] * offsets[j, 2]
                    )
            m[3, 3] = 1.0
            for d in range(3):
                column = int(bap[j, d])
                if column < 0:
                    break
                value = float(values[t, column])
                if value != 0.0:
                    _turn(m, int(axis[j, d]), float(sign[j, d]) * UNIT * value)


@inlined
def _nearest(angle: float, wanted: float) -> float:
    """The angle plus the number of whole turns that bring it closest to the wanted one."""
    return angle + TURN * math.floor((wanted - angle) / TURN + 0.5)


@inlined
def _angle_about(m: Float, axis: int) -> float:
    """The turn about one axis that comes closest to the rotation m (largest trace of their quotient)."""
    a = (axis + 1) % 3
    b = (axis + 2) % 3
    return math.atan2(m[b, a] - m[a, b], m[a, a] + m[b, b])


@compiled
def local_angles(
    m: Float, count: int, axis: Int, sign: Float, before: Float, angles: Float, work: Float
) -> None:
    """Angles (radians, outermost first) whose turns give the rotation m, closest to those before.

    m: (3, 3). count: number of freedoms, 1 to 3. before, angles: (3,). work: (3, 3) scratch.
    With one or two freedoms the closest rotation that they can make.
    """
    a1 = int(axis[0])
    a2 = int(axis[1])
    a3 = int(axis[2])
    e = 1.0 if (a1 + 1) % 3 == a2 else -1.0
    if count == 1:
        angles[0] = _nearest(float(sign[0]) * _angle_about(m, a1), float(before[0]))
        return
    if count == 2:
        # exact where the rotation is within reach; otherwise the alternation climbs to the closest one
        x = math.atan2(e * m[a3, a2], m[a2, a2])
        y = 0.0
        for _ in range(8):
            for i in range(3):
                for k in range(3):
                    work[i, k] = m[i, k]
            _turn_rows(work, a1, x)
            y_new = _angle_about(work, a2)
            for i in range(3):
                for k in range(3):
                    work[i, k] = m[i, k]
            _turn(work, a2, -y_new)
            x_new = _angle_about(work, a1)
            change = abs(x_new - x) + abs(y_new - y)
            x = x_new
            y = y_new
            if change < 1e-9:
                break
        angles[0] = _nearest(float(sign[0]) * x, float(before[0]))
        angles[1] = _nearest(float(sign[1]) * y, float(before[1]))
        return
    cosine = math.sqrt(m[a1, a1] * m[a1, a1] + m[a1, a2] * m[a1, a2])
    middle = math.atan2(e * m[a1, a3], cosine)
    if cosine < NEAR_LOCK:
        first = float(sign[0]) * float(before[0])
        for i in range(3):
            for k in range(3):
                work[i, k] = m[i, k]
        _turn_rows(work, a1, first)
        _turn_rows(work, a2, middle)
        angles[0] = float(before[0])
        angles[1] = _nearest(float(sign[1]) * middle, float(before[1]))
        angles[2] = _nearest(float(sign[2]) * _angle_about(work, a3), float(before[2]))
        return
    outer = math.atan2(-e * m[a2, a3], m[a3, a3])
    inner = math.atan2(-e * m[a1, a2], m[a1, a1])
    best = math.inf
    for branch in range(2):
        if branch == 1:  # the other triple of angles that makes the same rotation
            outer += math.pi
            middle = math.pi - middle
            inner += math.pi
        x = _nearest(float(sign[0]) * outer, float(before[0]))
        y = _nearest(float(sign[1]) * middle, float(before[1]))
        z = _nearest(float(sign[2]) * inner, float(before[2]))
        distance = (x - before[0]) ** 2 + (y - before[1]) ** 2 + (z - before[2]) ** 2
        if distance < best:
            best = distance
            angles[0] = x
            angles[1] = y
            angles[2] = z


@inlined
def _turn_rows(matrix: Float, axis: int, angle: float) -> None:
    """matrix := Rot(axis, -angle) . matrix, in place: takes an outermost turn off."""
    c = math.cos(angle)
    s = math.sin(angle)
    first = (axis + 1) % 3
    second = (axis + 2) % 3
    for column in range(3):
        a = float(matrix[first, column])
        b = float(matrix[second, column])
        matrix[first, column] = c * a + s * b
        matrix[second, column] = c * b - s * a


@compiled
def solve(
    matrices: Float,
    parents: Int,
    centre: Float,
    bap: Int,
    axis: Int,
    sign: Float,
    translation: Int,
    translation_sign: Float,
    wanted: npt.NDArray[np.bool_],
    previous: Float,
    limit: int,
    values: npt.NDArray[np.int32],
) -> bool:
    """matrices float64 (T, J, 4, 4) -> values int32 (T, 296), given filled with 0.

    centre: (3,) of the root. wanted: bool (J,), joints to solve; the others stay unturned. previous:
    float64 (J, 3), angles before the first frame. limit: largest magnitude of a value. What a joint
    cannot do is left to its children: each is solved against what its parent really does. Returns False where
    a value would exceed the limit.
    """
    count = parents.shape[0]
    reached = np.zeros((count, 3, 3))
    local = np.zeros((3, 3))
    work = np.zeros((3, 3))
    angles = np.zeros(3)
    for t in range(matrices.shape[0]):
        for j in range(count):
            p = int(parents[j])
            own = reached[j]
            for i in range(3):
                for k in range(3):
                    own[i, k] = (1.0 if i == k else 0.0) if p < 0 else float(reached[p, i, k])
            if p < 0:
                for i in range(3):
                    column = int(translation[i])
                    if column >= 0:
                        value = (matrices[t, j, i, 3] - centre[i]) / MILLIMETRE * translation_sign[i]
                        value = math.floor(value + 0.5)
                        if not abs(value) <= limit:
                            return False
                        values[t, column] = int(value)
            freedoms = 0
            while freedoms < 3 and int(bap[j, freedoms]) >= 0:
                freedoms += 1
            if freedoms == 0 or not wanted[j]:
                continue
            for i in range(3):
                for k in range(3):
                    total = 0.0
                    for n in range(3):
                        total += own[n, i] * matrices[t, j, n, k]
                    local[i, k] = total
            local_angles(local, freedoms, axis[j], sign[j], previous[j], angles, work)
            for d in range(freedoms):
                previous[j, d] = angles[d]
                value = math.floor(angles[d] / UNIT + 0.5)
                if not abs(value) <= limit:
                    return False
                values[t, int(bap[j, d])] = int(value)
                _turn(own, int(axis[j, d]), float(sign[j, d]) * UNIT * value)
    return True


@compiled
def joint_angles(local: Float, count: int, axis: Int, sign: Float, angles: Float) -> None:
    """local float64 (T, 3, 3) -> angles (T, 3), each frame close to the one before (`local_angles`)."""
    work = np.zeros((3, 3))
    before = np.zeros(3)
    for t in range(local.shape[0]):
        local_angles(local[t], count, axis, sign, before, angles[t], work)
        for d in range(count):
            before[d] = angles[t, d]
