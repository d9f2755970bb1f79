"""Curves through values in a cycle or a part of it. Phases are fractions of the cycle."""

from __future__ import annotations

from typing import Literal

import numpy as np
import numpy.typing as npt

from fba.arrays import Float64

Interpolation = Literal["linear", "smooth"]
"""Between two values: "linear", as in the source, or "smooth", by cubic curves."""


def check_interpolation(interpolation: Interpolation) -> Interpolation:
    """Return the given kind of interpolation; ValueError for an unknown one."""
    if interpolation not in ("linear", "smooth"):
        raise ValueError(f"interpolation must be linear or smooth, not {interpolation!r}")
    return interpolation


def cosine_wave(knots: npt.ArrayLike, phase: Float64, interpolation: Interpolation) -> Float64:
    """Return a cosine wave at phases (T,), 1 at phase 0; "linear" interpolates it between the knots."""
    if interpolation == "smooth":
        return np.cos(2.0 * np.pi * phase)
    return periodic_curve(knots, np.cos(2.0 * np.pi * np.asarray(knots)), phase, interpolation)


def periodic_curve(
    knots: npt.ArrayLike, values: npt.ArrayLike, phase: npt.ArrayLike, interpolation: Interpolation = "smooth"
) -> Float64:
    """Return the values at phases of a periodic curve, monotone between neighbouring knots.

    knots: increasing phases in 0..1. values: at the knots. The pieces are cubic; their tangents are those of
    Fritsch and Butland (1984).
    """
    x, y = np.asarray(knots, dtype=np.float64), np.asarray(values, dtype=np.float64)
    u = np.asarray(phase, dtype=np.float64)
    if interpolation == "linear":
        return np.interp(u, x, y, period=1.0)
    step = np.diff(np.append(x, x[0] + 1.0))
    slope = np.diff(np.append(y, y[0])) / step
    before, step_before = np.roll(slope, 1), np.roll(step, 1)
    weight_before, weight = step_before + 2.0 * step, 2.0 * step_before + step
    extreme = before * slope <= 0.0  # flat at maxima, at minima, and between equal values
    divisors = [np.where(extreme, 1.0, s) for s in (before, slope)]
    mean = (weight_before + weight) / (weight / divisors[0] + weight_before / divisors[1])
    tangent: Float64 = np.where(extreme, 0.0, mean)
    u = np.mod(u - x[0], 1.0) + x[0]
    k = np.clip(np.searchsorted(x, u, side="right") - 1, 0, len(x) - 1)
    after = (k + 1) % len(x)
    return _hermite((u - x[k]) / step[k], step[k], y[k], y[after], tangent[k], tangent[after])


def spline(
    knots: npt.ArrayLike, values: Float64, first: Float64, last: Float64, phase: npt.ArrayLike
) -> Float64:
    """Return the cubic spline through values (K, ...) at knots (K,) with these end slopes, at phases."""
    x, y = np.asarray(knots, dtype=np.float64), np.asarray(values, dtype=np.float64)
    count, h = len(x), np.diff(x)
    slope = np.diff(y, axis=0) / h.reshape(-1, *[1] * (y.ndim - 1))
    matrix, right = np.zeros((count, count)), np.zeros_like(y)
    matrix[0, 0] = matrix[-1, -1] = 1.0
    right[0], right[-1] = first, last
    for i in range(1, count - 1):
        matrix[i, i - 1 : i + 2] = h[i], 2.0 * (h[i - 1] + h[i]), h[i - 1]
        right[i] = 3.0 * (h[i] * slope[i - 1] + h[i - 1] * slope[i])
    solved = np.linalg.solve(matrix, right.reshape(count, -1))
    tangent = np.asarray(solved, dtype=np.float64).reshape(y.shape)
    u = np.asarray(phase, dtype=np.float64)
    k = np.clip(np.searchsorted(x, u, side="right") - 1, 0, count - 2)
    tail = (...,) + (None,) * (y.ndim - 1)
    return _hermite(((u - x[k]) / h[k])[tail], h[k][tail], y[k], y[k + 1], tangent[k], tangent[k + 1])


def _hermite(s: Float64, step: Float64, y0: Float64, y1: Float64, d0: Float64, d1: Float64) -> Float64:
    """Return the cubic with values y0, y1 and slopes d0, d1 at its ends, at fractions s of the step."""
    t = 1.0 - s
    return t * t * ((1 + 2 * s) * y0 + s * step * d0) + s * s * ((1 + 2 * t) * y1 - t * step * d1)
