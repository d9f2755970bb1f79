"""Curves: how a face shows each class of expression, from the slightest to the strongest.

There is no recording of two people who perform alike. But both show the same classes, so they are paired by
class and rank: the strongest smile of the first with the strongest smile of the second, and so on.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fba.arrays import Bool, Float64
from fba.persona.points.layout import PARTS
from fba.persona.recognition import ClassRecogniser, Labels

MIN_FRAMES = 4
"""Number of frames of a class that its curve needs."""
RANKS = np.array([0.1, 0.3, 0.5, 0.7, 0.9])
"""Ranks, by displacement, at which a class is described."""
RANK_SPAN = 0.1
"""Difference of rank up to which frames are averaged."""


@dataclass(frozen=True)
class Kernel:
    """k(a, b) = linear a . b + radial exp(-|a - b|^2 / (2 reach^2)), as in a Gaussian process."""

    linear: float = 0.02
    radial: float = 4.0
    reach: float = 6.0  # mm, of all vertices of a part together
    noise: float = 3.0  # mm^2, variance of the pairs

    def __call__(self, moved: Float64, others: Float64) -> Float64:
        """Return k for displacements (S, 2V) and others (N, 2V): (S, N)."""
        both = moved @ others.T
        square = (moved**2).sum(axis=1)[:, None] + (others**2).sum(axis=1) - 2 * both
        return np.asarray(
            self.linear * both + self.radial * np.exp(-np.maximum(square, 0) / (2 * self.reach**2))
        )


KERNEL = Kernel()


@dataclass(frozen=True, eq=False)
class Curves:
    """How a part moves for each class.

    moved: float64 (C, 5, 2V), displacements of its vertices, all x and then all y, at each of `RANKS`; 0
    where unknown. known: bool (C,), classes with at least `MIN_FRAMES` frames.
    """

    moved: Float64
    known: Bool


def measure_curves(moved: Float64, labels: Labels, count: int) -> Curves:
    """Return the curves of `count` classes from displacements (S, 2V). Frames of two classes are ignored."""
    curves, known = np.zeros((count, len(RANKS), moved.shape[1])), np.zeros(count, dtype=bool)
    single = (labels.first >= 0) & (labels.second < 0)
    for number in range(count):
        frames = np.flatnonzero(single & (labels.first == number))
        if len(frames) >= MIN_FRAMES:
            curves[number], known[number] = _measure(moved[frames]), True
    return Curves(curves, known)


def _measure(moved: Float64) -> Float64:
    """Return the means (5, 2V) of displacements (S, 2V) around each rank."""
    ordered = moved[np.argsort(np.linalg.norm(moved, axis=1))]
    count = len(ordered)
    starts = np.floor((RANKS - RANK_SPAN) * count).astype(int)
    stops = np.maximum(np.ceil((RANKS + RANK_SPAN) * count).astype(int), starts + 1)
    return np.stack(
        [ordered[max(start, 0) : stop].mean(axis=0) for start, stop in zip(starts, stops, strict=True)]
    )


@lru_cache(maxsize=4)
def general_curves(recogniser: ClassRecogniser) -> dict[str, Curves]:
    """Return the curves of people in general by part, from a recogniser's examples."""
    result = {}
    for part in PARTS:
        labels = recogniser.example_labels[part]
        first = np.where(labels.sum(axis=1) == 1, labels.argmax(axis=1), -1)
        moved = recogniser.example_motion(part)
        result[part] = measure_curves(moved, Labels(first, np.full(len(first), -1)), labels.shape[1])
    return result


@dataclass(frozen=True, eq=False)
class CurveMap:
    """A map of displacements: y = x + k(x, centres) . weights. Far from all centres it changes little."""

    centres: Float64
    weights: Float64

    def __call__(self, moved: Float64) -> Float64:
        """Return displacements (S, 2V) of one face as those of another."""
        return np.asarray(moved + KERNEL(moved, self.centres) @ self.weights)


def fit_curves(here: Curves, there: Curves) -> CurveMap:
    """Return the smooth map that takes one face's curves to another's, and rest to rest."""
    inputs, outputs = pair_curves(here, there)
    rest = np.zeros((1, inputs.shape[1]))
    centres, change = np.concatenate([inputs, rest]), np.concatenate([outputs - inputs, rest])
    normal = KERNEL(centres, centres) + KERNEL.noise * np.eye(len(centres))
    return CurveMap(centres, np.asarray(np.linalg.solve(normal, change)))


def pair_curves(here: Curves, there: Curves) -> tuple[Float64, Float64]:
    """Return paired displacements of two faces: (N, 2V) each."""
    both = here.known & there.known
    width = here.moved.shape[2]
    return here.moved[both].reshape(-1, width), there.moved[both].reshape(-1, width)
