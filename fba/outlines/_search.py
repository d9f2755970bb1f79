"""Searches: the nearest of many silhouettes, exactly, and the likeliest sequence of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.arrays import Float32, Float64, Floating, Int64
from fba.outlines._distance import Ground, earth_movers_distance, lower_bounds, project


def nearest(
    query: Floating,
    descriptions: Float32,
    count: int,
    *,
    projected: Float32 | None = None,
    ground: Ground = "cityblock",
    prune: bool = True,
) -> tuple[Int64, Float64, int]:
    """Return the numbers (count,) of the nearest descriptions, the nearest first, and their distances.

    query: (N, D). descriptions: (S, N, D), of equal mass. projected: (S, D, N), `project` of these, where it
    is at hand. prune: leave out what lower bounds exclude, which changes no result. The third result is the
    number of distances that were computed.
    """
    total = len(descriptions)
    bounds = np.zeros(total)
    if prune:
        bounds = lower_bounds(
            project(query), project(descriptions) if projected is None else projected, ground
        )
    found: list[tuple[float, int]] = []
    compared = 0
    for number in np.argsort(bounds, kind="stable").tolist():
        # Bounds of float32 projections may exceed the distance by rounding.
        if len(found) == count and bounds[number] > found[-1][0] * (1 + 1e-5) + 1e-6:
            break
        distance = earth_movers_distance(query, descriptions[number], ground)
        compared += 1
        found = sorted([*found, (distance, number)])[:count]
    return (
        np.array([number for _, number in found], dtype=np.int64),
        np.array([distance for distance, _ in found]),
        compared,
    )


def follow(costs: Sequence[Floating], steps: Sequence[Floating]) -> list[int]:
    """Return the choice for each picture that costs least over all (Viterbi's algorithm).

    costs: (K,) for each picture, of its choices. steps: (K, L) from each picture to the next, the cost of
    going from a choice to another.
    """
    best = np.asarray(costs[0], dtype=np.float64)
    came: list[Int64] = []
    for cost, step in zip(costs[1:], steps, strict=True):
        over = best[:, None] + step
        came.append(over.argmin(axis=0))
        best = over.min(axis=0) + cost
    chosen = [int(best.argmin())]
    for before in reversed(came):
        chosen.append(int(before[chosen[-1]]))
    return chosen[::-1]
