"""The compiled loop from body animation parameters to joint matrices, and its sines and arc tangents.

Sine and arc tangent use no calls or branches, so that loops over angles are vectorised: an angle is first
reduced to an eighth of a turn, where the truncated Taylor series are exact to rounding.

A joint's rotation is a product of up to three turns about different axes of the body's frame,
outermost first. All sines and cosines of a frame are computed first, in one vectorised loop; then each
joint's matrix is copied from its parent's and turned in place.

Bounds: `BapSolver.pose` checks that values have 296 columns, and makes `result` for as many frames and its
own joints; columns of turns and of the root are below 296, and parents come first.
"""

from __future__ import annotations

import math

import numpy as np

from fba.arrays import Float64, Int32, Int64
from fba.compiled import compiled, inlined

PER_RADIAN = 2.0 / math.pi
QUARTER_HIGH = math.floor(math.pi / 2 * 2.0**32) / 2.0**32
"""The first 33 bits of a quarter turn: products with whole numbers below 2^20 are exact."""
QUARTER_LOW = (math.pi / 2 - QUARTER_HIGH) + math.sin(math.pi) / 2
"""The rest of a quarter turn; sin(math.pi) is the rounding error of math.pi."""
S3, S5, S7, S9, S11, S13, S15 = ((-1.0) ** (n // 2) / math.factorial(n) for n in range(3, 16, 2))
C2, C4, C6, C8, C10, C12, C14, C16 = ((-1.0) ** (n // 2) / math.factorial(n) for n in range(2, 17, 2))

EIGHTH = math.tan(math.pi / 8)
T3, T5, T7, T9, T11, T13, T15, T17, T19, T21, T23 = ((-1.0) ** (n // 2) / n for n in range(3, 24, 2))
UNIT = 1e-5
"""Radians in one unit of a rotational BAP."""
MILLIMETRE = 1e-3


@inlined
def sine_cosine(angle: float) -> tuple[float, float]:
    """Return sine and cosine of an angle in radians, |angle| < 10^6, within 3e-16."""
    quarters = math.floor(angle * PER_RADIAN + 0.5)
    x = (angle - quarters * QUARTER_HIGH) - quarters * QUARTER_LOW
    z = x * x
    s = x + x * z * (S3 + z * (S5 + z * (S7 + z * (S9 + z * (S11 + z * (S13 + z * S15))))))
    c = 1.0 + z * (C2 + z * (C4 + z * (C6 + z * (C8 + z * (C10 + z * (C12 + z * (C14 + z * C16)))))))
    # quarter of the turn, 0.0 to 3.0; used in selections, not in branches
    quarter = quarters - 4.0 * math.floor(quarters * 0.25)
    odd = quarter - 2.0 * math.floor(quarter * 0.5)
    sine = c if odd > 0.5 else s
    cosine = s if odd > 0.5 else c
    sine = -sine if quarter > 1.5 else sine
    cosine = -cosine if 0.5 < quarter < 2.5 else cosine
    return sine, cosine


@inlined
def arc_tangent(y: float, x: float) -> float:
    """Return the angle of the direction (x, y) as `math.atan2`, within 1e-11; 0 for (0, 0)."""
    high = max(abs(x), abs(y))
    low = min(abs(x), abs(y))
    ratio = low / (high if high > 0.0 else 1.0)
    steep = ratio > EIGHTH
    t = (ratio - 1.0) / (ratio + 1.0) if steep else ratio  # the angle less an eighth of a turn
    z = t * t
    angle = t * (1.0 + z * (T3 + z * (T5 + z * (T7 + z * (T9 + z * (T11 + z * (T13
        + z * (T15 + z * (T17 + z * (T19 + z * (T21 + z * T23)))))))))))  # fmt: skip
    angle = angle + 0.25 * math.pi if steep else angle
    angle = 0.5 * math.pi - angle if abs(y) > abs(x) else angle
    angle = math.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle


@compiled
def pose(
    values: Int32 | Float64,
    parents: Int64,
    offsets: Float64,
    turns: Int64,
    axes: Int64,
    radians: Float64,
    columns: Int64,
    counts: Int64,
    translation: Int64,
    metres: Float64,
    result: Float64,
) -> None:
    """Fill result, float64 (T * J * 16,), with joint matrices for values (T, 296), int32 or float64.

    offsets: float64 (J, 3) from the parent. counts: int64 (J,), numbers of turns; turns and axes: int64
    (J, 3), their indices into columns and their axes, outermost first. columns: int64 (N,), the BAP columns
    of all turns, radians: float64 (N,), signed radians of one unit. translation: int64 (3,), columns of the
    root's translation, -1 for none; metres: float64 (3,), signed metres of one unit.
    """
    joints = parents.shape[0]
    angles = columns.shape[0]
    sines = np.zeros(angles)
    cosines = np.zeros(angles)
    gathered = np.zeros(angles)
    for t in range(values.shape[0]):
        for n in range(angles):
            gathered[n] = values[t, int(columns[n])]
        for n in range(angles):
            sine, cosine = sine_cosine(float(gathered[n]) * float(radians[n]))
            sines[n] = sine
            cosines[n] = cosine
        for j in range(joints):
            at = (t * joints + j) * 16  # flat: slices of an array would cost more than the arithmetic
            p = int(parents[j])
            if p < 0:
                for i in range(3):
                    for k in range(3):
                        result[at + 4 * i + k] = 1.0 if i == k else 0.0
                    place = float(offsets[j, i])
                    column = int(translation[i])
                    if column >= 0:
                        place += float(metres[i]) * float(values[t, column])
                    result[at + 4 * i + 3] = place
            else:
                up = (t * joints + p) * 16
                x = float(offsets[j, 0])
                y = float(offsets[j, 1])
                z = float(offsets[j, 2])
                for i in range(0, 12, 4):
                    a = float(result[up + i])
                    b = float(result[up + i + 1])
                    c = float(result[up + i + 2])
                    result[at + i] = a
                    result[at + i + 1] = b
                    result[at + i + 2] = c
                    result[at + i + 3] = result[up + i + 3] + (a * x + b * y + c * z)
            result[at + 12] = 0.0
            result[at + 13] = 0.0
            result[at + 14] = 0.0
            result[at + 15] = 1.0
            for d in range(int(counts[j])):
                n = int(turns[j, d])
                sine = float(sines[n])
                cosine = float(cosines[n])
                if sine == 0.0 and cosine > 0.0:
                    continue
                axis = int(axes[j, d])
                first = at + (axis + 1 if axis < 2 else 0)
                second = at + (axis - 1 if axis > 0 else 2)
                for i in range(0, 12, 4):
                    a = float(result[first + i])
                    b = float(result[second + i])
                    result[first + i] = cosine * a + sine * b
                    result[second + i] = cosine * b - sine * a
