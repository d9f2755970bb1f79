"""`to_blendshapes`: FAPs as weights of ARKit's 52 shapes."""

from __future__ import annotations

from fractions import Fraction
from functools import cache

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64, Int64
from fba.capture.blendshapes._motion import ShapeMotion
from fba.capture.blendshapes.combination import CLOSED, JAW, RADIAN
from fba.capture.blendshapes.conversion import EYE_FAPS, HEAD_FAPS
from fba.capture.blendshapes.shape_table import shape_faps
from fba.compiled import compiled
from fba.errors import ModelError
from fba.face import Fapu, arkit_names, neutral_points, resolve
from fba.parameters import FAP_COUNT, fap_numbers, faps

EYEBALL_RADIUS = 0.012
"""Radius of an eyeball, in metres: a turn of one radian moves the pupil this far."""
SETTLED = 1e-9
"""Change that a weight must be worth to leave a bound."""
MAX_CHANGES = 100
"""Most changes of the set of free weights in a frame, for each weight; a first frame needs one or two."""
SHARED_WEIGHT = 5e-4
"""Metres of error that count as much as a weight of 1. It divides a movement among shapes that are nearly
alike, as real faces do, and keeps shapes out of movements too small to see."""


def to_blendshapes(animation: Animation, names: tuple[str, ...] | None = None) -> ShapeMotion:
    """Return weights of ARKit's 52 shapes, 0 to 1, that show a face like its FAPs, and head and eyes.

    names: of other shapes with known FAPs, such as "aa" and "happy" of VRM.

    Visemes and expressions become FAPs first (`fba.face.resolve`). The weights of each frame are those whose
    FAPs come closest, by least squares of how far an adult's face moves. What no shape moves (ears, pupils,
    the tongue but for its tip) is lost. Times and rate are the animation's own.

    Raises ModelError without a face, or for a shape whose FAPs are not known.
    """
    names = arkit_names() if names is None else names
    if animation.face is None or not len(animation):
        raise ModelError("the animation has no face; there is nothing to make blendshapes of")
    shown = resolve(animation.face).astype(np.float64)
    weights = shown_weights(shown, names)
    times = np.asarray(animation.index, dtype=np.float64) / float(animation.rate)
    return ShapeMotion(
        names, weights, times - times[0], Fraction(animation.rate),
        head=_angles(shown, HEAD_FAPS), eyes=_angles(shown, EYE_FAPS), start=float(times[0]),
        name=animation.name,
    )  # fmt: skip


def shown_weights(shown: Float64, names: tuple[str, ...] | None = None) -> Float64:
    """Return the weights (T, N) of `to_blendshapes` for FAPs (T, 68) that a face shows (`fba.face.resolve`).

    Each frame has its weights whatever the others show. Raises ModelError for a shape whose FAPs are not
    known.
    """
    names = arkit_names() if names is None else names
    shapes = _shapes(names)
    products = shapes @ shapes.T + SHARED_WEIGHT**2 * np.eye(len(shapes))
    # By einsum: at this size the threads of a BLAS cost more than they save.
    weights = find_weights(products, np.einsum("tf,nf->tn", shown, shapes * _metres(names)))
    if {JAW, CLOSED} <= set(names):
        opened, closed = names.index(JAW), names.index(CLOSED)
        weights[:, opened] = np.minimum(weights[:, opened] + weights[:, closed], 1.0)
    return weights


@cache
def _shapes(names: tuple[str, ...]) -> Float64:
    """Return how far FAPs of each of these shapes move an adult's face, metres, (N, 68).

    "mouthClose" is there an open jaw with lips together, since it does nothing beyond "jawOpen".
    """
    rows = {name: amounts for name in names if (amounts := shape_faps(name)) is not None}
    unknown = [name for name in names if name not in rows]
    if unknown:
        raise ModelError(f"no FAPs are known for the shape {unknown[0]!r}")
    if CLOSED in rows and JAW in rows:
        rows[CLOSED] = rows[CLOSED] + rows[JAW]
    return np.array(list(rows.values())) * _metres(names)


@cache
def _metres(names: tuple[str, ...]) -> Float64:
    """Return how far one step of each FAP moves an adult's face, metres (68,); 0 for what no shape moves."""
    fapu = Fapu.measure(neutral_points())
    metres = np.array([fapu[fap.unit] if fap.unit and fap.unit != "AU" else 0.0 for fap in faps()])
    for name in EYE_FAPS:
        metres[fap_numbers()[name] - 1] = EYEBALL_RADIUS / RADIAN
    moved = np.zeros(FAP_COUNT, dtype=bool)
    for name in names:
        amounts = shape_faps(name)
        moved |= amounts != 0 if amounts is not None else False
    return np.where(moved, metres, 0.0)


def _angles(shown: Float64, names: tuple[str, ...]) -> Float64:
    """Return angles (T, n), radians, of FAPs."""
    return shown[:, [fap_numbers()[name] - 1 for name in names]] / RADIAN


@compiled
def find_weights(products: Float64, goals: Float64) -> Float64:
    """Turn goals (T, N) into the weights (T, N) of 0 to 1 that solve least squares; return them.

    products: (N, N), of all shapes with each other, symmetric, positive definite. goals: products of what is
    wanted with each shape.

    An active set: weights between the bounds are free, and solve their normal equations. On the way there,
    the one that meets a bound first stops there; once all are there, the one at a bound that is most worth
    moving becomes free, until none is worth SETTLED. The error falls with each, so that no set comes twice.
    A frame begins with the weights and the set of the frame before, of which it mostly needs little else.

    Bounds: indices run over the shape of goals, the array that is written; products is checked against it.
    """
    frames, shapes = goals.shape
    if products.shape[0] < shapes or products.shape[1] < shapes:
        raise IndexError("fewer products than shapes")
    weights = np.zeros(shapes)
    free = np.zeros(shapes, np.int64)  # the first `count`: free weights, in the order of the factor's rows
    count = 0
    is_free = np.zeros(shapes, np.bool_)
    factor = np.zeros((shapes, shapes))
    best = np.zeros(shapes)
    rest = np.zeros(shapes)
    for frame in range(frames):
        goal = goals[frame]
        for _ in range(MAX_CHANGES * shapes):
            _solve_free(products, goal, weights, free, count, is_free, factor, best)
            share, place, bound = 1.0, -1, 0.0
            for row in range(count):
                old, new = weights[free[row]], best[row]
                if new < 0.0 and old < share * (old - new):
                    share, place, bound = old / (old - new), row, 0.0
                elif new > 1.0 and 1.0 - old < share * (new - old):
                    share, place, bound = (1.0 - old) / (new - old), row, 1.0
            for row in range(count):
                old = weights[free[row]]
                weights[free[row]] = best[row] if place < 0 else old + share * (best[row] - old)
            if place >= 0:
                weights[free[place]] = bound
                is_free[free[place]] = False
                count -= 1
                for row in range(place, count):
                    free[row] = free[row + 1]
                _factor_rows(products, free, place, count, factor)
                continue
            rest[:] = goal
            for shape in range(shapes):
                if weights[shape] != 0.0:
                    for other in range(shapes):
                        rest[other] -= products[shape, other] * weights[shape]
            most, better = SETTLED, -1
            for shape in range(shapes):
                if not is_free[shape]:
                    change = rest[shape] / products[shape, shape]
                    change = -change if weights[shape] == 1.0 else change
                    if change > most:
                        most, better = change, shape
            if better < 0:
                break
            free[count] = better
            is_free[better] = True
            count += 1
            _factor_rows(products, free, count - 1, count, factor)
        for shape in range(shapes):
            goal[shape] = min(max(weights[shape], 0.0), 1.0)
    return goals


@compiled
def _factor_rows(products: Float64, free: Int64, first: int, count: int, factor: Float64) -> None:
    """Compute rows `first` to `count` of the Cholesky factor of the products of the free weights.

    Bounds: rows are at most the number of shapes, by which the caller sizes all arrays.
    """
    for row in range(first, count):
        for column in range(row + 1):
            rest = products[free[row], free[column]]
            for k in range(column):
                rest -= factor[row, k] * factor[column, k]
            factor[row, column] = np.sqrt(rest) if row == column else rest / factor[column, column]


@compiled
def _solve_free(
    products: Float64,
    goal: Float64,
    weights: Float64,
    free: Int64,
    count: int,
    is_free: Bool,
    factor: Float64,
    best: Float64,
) -> None:
    """Write the best values of the free weights, without bounds, to `best`, in the order of `free`.

    Bounds: rows are at most the number of shapes, by which the caller sizes all arrays.
    """
    for row in range(count):
        best[row] = goal[free[row]]
    for shape in range(len(weights)):
        if weights[shape] != 0.0 and not is_free[shape]:
            for row in range(count):
                best[row] -= products[shape, free[row]] * weights[shape]
    for row in range(count):
        for k in range(row):
            best[row] -= factor[row, k] * best[k]
        best[row] /= factor[row, row]
    for row in range(count - 1, -1, -1):
        for k in range(row + 1, count):
            best[row] -= factor[k, row] * best[k]
        best[row] /= factor[row, row]
