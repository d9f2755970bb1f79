"""The compiled loop from body animation parameters to joint matrices.

A joint's rotation is a product of up to three turns about different axes of the body's frame,
outermost first. All sines and cosines of a frame are computed first, in one vectorised loop; then each
joint's matrix is copied from its parent's and turned in place.

Bounds: `BapSolver.pose` checks that values have 296 columns, and makes `result` for as many frames and its
own joints; columns of turns and of the root are below 296, and parents come first.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64, Int32, Int64
from fba.body.solve._fast_trig import sine_cosine
from fba.compiled import compiled

UNIT = 1e-5
"""Radians in one unit of a rotational BAP."""
MILLIMETRE = 1e-3


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
