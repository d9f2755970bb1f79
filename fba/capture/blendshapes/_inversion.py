"""`to_blendshapes`: FAPs as weights of ARKit's 52 shapes."""

from __future__ import annotations

from fractions import Fraction
from functools import cache

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64
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
MAX_SWEEPS = 200
"""Largest number of sweeps, in each of which every weight is set to its best value for the others."""
MAX_CHANGE = 1e-4
"""The sweeps end when no weight changes by more than this."""
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
    shapes = _shapes(names)
    products = shapes @ shapes.T + SHARED_WEIGHT**2 * np.eye(len(shapes))
    weights = find_weights(products, (shown * _metres(names)) @ shapes.T, MAX_SWEEPS, MAX_CHANGE)
    if {JAW, CLOSED} <= set(names):
        opened, closed = names.index(JAW), names.index(CLOSED)
        weights[:, opened] = np.minimum(weights[:, opened] + weights[:, closed], 1.0)
    times = np.asarray(animation.index, dtype=np.float64) / float(animation.rate)
    return ShapeMotion(
        names, weights, times - times[0], Fraction(animation.rate),
        head=_angles(shown, HEAD_FAPS), eyes=_angles(shown, EYE_FAPS), start=float(times[0]),
        name=animation.name,
    )  # fmt: skip


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
def find_weights(products: Float64, goals: Float64, sweeps: int, settled: float) -> Float64:
    """Turn goals (T, N) into weights (T, N) of 0 to 1 that solve least squares; return them.

    products: (N, N), of all shapes with each other, symmetric. goals: products of what is wanted with each
    shape. Each weight in turn is set to its best value for the others, up to `sweeps` times, until none
    changes by more than `settled`. A frame starts from the weights of the frame before.

    Bounds: indices run over the shape of goals, the array that is written; products is checked against it.
    """
    frames, shapes = goals.shape
    if products.shape[0] < shapes or products.shape[1] < shapes:
        raise IndexError("fewer products than shapes")
    for frame in range(frames):
        rest = goals[frame].copy()  # what is wanted, less what the weights give
        weights = goals[frame]
        for shape in range(shapes):
            weights[shape] = goals[frame - 1, shape] if frame else 0.0
            if weights[shape] != 0.0:
                for other in range(shapes):
                    rest[other] -= products[shape, other] * weights[shape]
        for _ in range(sweeps):
            change = 0.0
            for shape in range(shapes):
                better = weights[shape] + rest[shape] / products[shape, shape]
                better = min(max(better, 0.0), 1.0)
                moved = better - weights[shape]
                if moved != 0.0:  # most weights rest at 0
                    change = max(change, abs(moved))
                    weights[shape] = better
                    for other in range(shapes):
                        rest[other] -= products[shape, other] * moved
            if change < settled:
                break
    return goals
