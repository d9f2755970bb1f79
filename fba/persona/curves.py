"""How strongly and in which way a face shows each class: from its slightest to its strongest.

Nobody has the same performance of an actor and of another person. But both show the same classes, so they
are paired by class and by rank: the strongest smile of one with the strongest smile of the other, and so on
down.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fba.arrays import Bool, Float64
from fba.persona.points.layout import PARTS
from fba.persona.recognition import ClassRecogniser, Labels

FEWEST = 4
"""Frames of a class that tell how a face shows it."""
RANKS = np.array([0.1, 0.3, 0.5, 0.7, 0.9])
"""Ranks, by how far vertices move, at which a class is described."""
SPAN = 0.1
"""Ranks around each, within which frames are averaged."""
STRAIGHT, NEAR, REACH = 0.02, 4.0, 6.0
"""Shares of a curve map that are straight, and that fade with the distance: millimetres of a whole part."""
NOISE = 3.0
"""Square millimetres by which pairs are taken to be off."""


@dataclass(frozen=True, eq=False)
class Curves:
    """How a part moves for each class.

    moved: float64 (C, 5, 2V), displacements of its vertices, all x and then all y, at each of `RANKS`; 0
    where unknown. known: bool (C,), classes of which there are enough frames.
    """

    moved: Float64
    known: Bool


def measure_curves(moved: Float64, labels: Labels, count: int) -> Curves:
    """Return how a part moves for each of `count` classes. moved: (S, 2V), with these labels; those of two
    do not count."""
    curves, known = np.zeros((count, len(RANKS), moved.shape[1])), np.zeros(count, dtype=bool)
    single = (labels.first >= 0) & (labels.second < 0)
    for number in range(count):
        frames = np.flatnonzero(single & (labels.first == number))
        if len(frames) >= FEWEST:
            curves[number], known[number] = _measure(moved[frames]), True
    return Curves(curves, known)


def _measure(moved: Float64) -> Float64:
    """Return the means (5, 2V) of displacements (S, 2V) around each rank."""
    ordered = moved[np.argsort(np.linalg.norm(moved, axis=1))]
    count = len(ordered)
    starts = np.floor((RANKS - SPAN) * count).astype(int)
    stops = np.maximum(np.ceil((RANKS + SPAN) * count).astype(int), starts + 1)
    return np.stack(
        [ordered[max(start, 0) : stop].mean(axis=0) for start, stop in zip(starts, stops, strict=True)]
    )


@lru_cache(maxsize=4)
def general_curves(recogniser: ClassRecogniser) -> dict[str, Curves]:
    """Return how faces move in general, part by part: from the examples of a recogniser."""
    result = {}
    for part in PARTS:
        labels = recogniser.example_labels[part]
        first = np.where(labels.sum(axis=1) == 1, labels.argmax(axis=1), -1)
        moved = recogniser.example_motion(part)
        result[part] = measure_curves(moved, Labels(first, np.full(len(first), -1)), labels.shape[1])
    return result


@dataclass(frozen=True, eq=False)
class CurveMap:
    """y = x + k(x, centres) . weights: what is paired with curves that are near, and little where none are.

    k(a, b) = `STRAIGHT` a . b + `NEAR` exp(-|a - b|^2 / (2 `REACH`^2)), as in a Gaussian process.
    """

    centres: Float64
    weights: Float64

    def __call__(self, moved: Float64) -> Float64:
        """Return displacements (S, 2V) of one face as those of another."""
        return np.asarray(moved + _alike(moved, self.centres) @ self.weights)


def fit_curves(here: Curves, there: Curves) -> CurveMap:
    """Return the smooth map that brings one face's curves to another's, and rest to rest."""
    inputs, outputs = pair_curves(here, there)
    rest = np.zeros((1, inputs.shape[1]))
    centres, change = np.concatenate([inputs, rest]), np.concatenate([outputs - inputs, rest])
    normal = _alike(centres, centres) + NOISE * np.eye(len(centres))
    return CurveMap(centres, np.asarray(np.linalg.solve(normal, change)))


def _alike(moved: Float64, others: Float64) -> Float64:
    """Return how alike displacements (S, 2V) and others (N, 2V) are: (S, N)."""
    both = moved @ others.T
    square = (moved**2).sum(axis=1)[:, None] + (others**2).sum(axis=1) - 2 * both
    return np.asarray(STRAIGHT * both + NEAR * np.exp(-np.maximum(square, 0) / (2 * REACH**2)))


def pair_curves(here: Curves, there: Curves) -> tuple[Float64, Float64]:
    """Return displacements of two faces that go together: (N, 2V) each."""
    both = here.known & there.known
    width = here.moved.shape[2]
    return here.moved[both].reshape(-1, width), there.moved[both].reshape(-1, width)
