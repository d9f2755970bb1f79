"""`Component`: recognition of the classes of a part: principal components and a small network."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64
from fba.persona.points.layout import ANCHORS, part_points


@dataclass(frozen=True, eq=False)
class Network:
    """A network with one hidden layer of tanh units and a linear output for each class.

    outputs = tanh(inputs . hidden + hidden_shift) . output + output_shift. hidden: float64 (D, H);
    hidden_shift: (H,); output: (H, C); output_shift: (C,).
    """

    hidden: Float64
    hidden_shift: Float64
    output: Float64
    output_shift: Float64

    def __call__(self, inputs: Float64) -> Float64:
        """Return outputs (..., C), about -1 to 1, for inputs (..., D)."""
        return np.asarray(np.tanh(inputs @ self.hidden + self.hidden_shift) @ self.output + self.output_shift)


@dataclass(frozen=True, eq=False)
class Component:
    """A part of the face.

    mean, spread: float64 (2K,), of the training displacements. axes: (D, 2K), principal components of the
    standardised displacements. variance: (2K,), share of the variance of every principal component, also of
    those left out. network: its outputs are `classes`. share: of the validation examples it gets right.
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
        """Return principal components (..., D) of displacements (..., 2K)."""
        return np.asarray(((moved - self.mean) / self.spread) @ self.axes.T)

    def outputs(self, moved: Float64) -> Float64:
        """Return the outputs (T, C) of the network for displacements (T, 2K)."""
        return self.network(self.scores(moved))

    @property
    def kept_variance(self) -> float:
        """Share of the variance that `axes` cover."""
        return float(self.variance[: len(self.axes)].sum())


def displacements(points: Float64, neutral: Float64, part: str) -> Float64:
    """Return how far the points of a part are from the neutral face: float64 (T, 2K), all x, then all y.

    points: (T, 64, 2) on the standard mask. neutral: (64, 2), or (T, 64, 2). Both are taken relative to the
    part's anchor. Equation 4.3 of the source.
    """
    rows, anchor = part_points(part), ANCHORS[part] - 1
    moved, still = (face[..., rows, :2] - face[..., anchor : anchor + 1, :2] for face in (points, neutral))
    return np.concatenate([moved[..., 0] - still[..., 0], moved[..., 1] - still[..., 1]], axis=-1)
