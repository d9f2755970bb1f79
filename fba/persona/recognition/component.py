"""`Component`: what is known of one part of the face: means, principal components, a network and its
classes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64
from fba.persona.recognition.network import Network, train

DIMENSIONS = {"mouth": 11, "left_eye": 5, "right_eye": 5, "left_brow": 5, "right_brow": 5}
"""Principal components that are kept."""
UNITS = {"mouth": 30, "left_eye": 20, "right_eye": 20, "left_brow": 20, "right_brow": 20}
"""Hidden units of the networks."""
WANTED_ACCURACY = {"mouth": 0.6, "left_eye": 0.9, "right_eye": 0.9, "left_brow": 0.9, "right_brow": 0.9}
"""Share of the validation examples that a network must get right."""
FLATTEST = 0.4
"""Millimetres: corners of eyes that noise moves by less do not count for more."""


@dataclass(frozen=True, eq=False)
class Component:
    """A part of the face.

    mean, spread: float64 (2K,), of the displacements that it was trained with. axes: (D, 2K), principal
    components of the standardised ones. variance: (2K,), share of the variance that each component has, all
    of them. network: its outputs are `classes`. share: of the validation examples that are right.
    """

    part: str
    classes: tuple[str, ...]
    mean: Float64
    spread: Float64
    axes: Float64
    variance: Float64
    network: Network
    share: float

    def scores(self, moved: Float64) -> Float64:
        """Return principal components (..., D) of displacements (..., 2K): z-scores, then a change of
        basis."""
        return np.asarray(((moved - self.mean) / self.spread) @ self.axes.T)

    def outputs(self, moved: Float64) -> Float64:
        """Return the outputs (T, C) of the network for displacements (T, 2K)."""
        return self.network(self.scores(moved))

    @property
    def kept_variance(self) -> float:
        """Share of the variance that the components which are kept have together."""
        return float(self.variance[: len(self.axes)].sum())


def train_component(
    part: str,
    classes: tuple[str, ...],
    moved: Float64,
    targets: Bool,
    check: Bool,
    *,
    tries: int = 3,
    seed: int = 0,
) -> Component:
    """Return what examples teach of a part.

    moved: displacements (N, 2K); targets: bool (N, C), their classes; check: bool (N,), those kept for
    validation.
    """
    used = targets.any(axis=1)
    mean, spread = moved[~check].mean(axis=0), np.maximum(moved[~check].std(axis=0), FLATTEST)
    standard = (moved - mean) / spread
    variance, axes = find_axes(standard[~check])
    axes = axes[: DIMENSIONS[part]]
    scores = standard @ axes.T
    training = train(
        scores[used], targets[used], check[used],
        units=UNITS[part], enough=WANTED_ACCURACY[part], tries=tries, seed=seed,
    )  # fmt: skip
    return Component(part, classes, mean, spread, axes, variance, training.network, training.share)


def find_axes(values: Float64) -> tuple[Float64, Float64]:
    """Return the principal components of values (N, K): shares of variance (K,) and axes (K, K).

    Axes are rows, the one with the largest variance first, the largest of each one's numbers positive.
    """
    centred = values - values.mean(axis=0)
    sizes, vectors = np.linalg.eigh(centred.T @ centred)
    sizes, axes = np.maximum(sizes[::-1], 0.0), vectors.T[::-1]
    largest = axes[np.arange(len(axes)), np.abs(axes).argmax(axis=1)]
    return np.asarray(sizes / sizes.sum()), np.asarray(axes * np.sign(largest)[:, None])
