"""Measurements of a walk on the posed body: contact with the ground, slip, depth below it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Float64
from fba.body._skeleton import Skeleton
from fba.body.gait._anatomy import Anatomy, body_values
from fba.body.solve.conventions import convention
from fba.body.solve.solver import BapSolver
from fba.choices import Axes

ON_GROUND = 0.002
"""Metres above the ground up to which a point counts as touching it."""


@dataclass(frozen=True, eq=False)
class Soles:
    """Positions of points of both soles in every frame.

    points: float64 (2, 3, T, 3), metres: of the left and the right foot; heel, ball of the foot, tip of the
    toes.
    """

    points: Float64

    @property
    def touching(self) -> Bool:
        """(2, 3, T) mask of the points on the ground."""
        return self.points[..., 1] <= ON_GROUND

    @property
    def deepest(self) -> float:
        """Depth of the lowest point below the ground, metres; negative above it."""
        return float(-self.points[..., 1].min())

    @property
    def slip(self) -> float:
        """Largest distance, metres, that a point moves along the ground while it touches it."""
        worst = 0.0
        for points, touches in zip(self.points.reshape(6, -1, 3), self.touching.reshape(6, -1), strict=True):
            edges = np.flatnonzero(np.diff(np.concatenate([[False], touches, [False]]).astype(int)))
            for start, stop in zip(edges[::2], edges[1::2], strict=True):
                path = points[start:stop][:, [0, 2]]
                worst = max(worst, float(np.linalg.norm(path - path[0], axis=1).max()))
        return worst

    @property
    def stance(self) -> tuple[float, float]:
        """Share of the frames in which the left and the right foot are on the ground."""
        left, right = self.touching.any(axis=1).mean(axis=1)
        return float(left), float(right)

    @property
    def carried(self) -> bool:
        """Whether a foot is on the ground in every frame, which distinguishes walking from running."""
        return bool(self.touching.any(axis=(0, 1)).all())


def soles(animation: Animation, skeleton: Skeleton | None = None, axes: Axes = "iso") -> Soles:
    """Return the soles of an animation's body in every frame; ValueError without a body track."""
    values = body_values(animation)
    skeleton = Skeleton.default() if skeleton is None else skeleton
    anatomy = Anatomy.measure(skeleton)
    return sole_points(anatomy, BapSolver(skeleton, axes).pose(values))


def sole_points(anatomy: Anatomy, matrices: Float64) -> Soles:
    """Return the soles in poses given by joint matrices (T, J, 4, 4)."""
    points = np.zeros((2, 3, len(matrices), 3))
    for number, letter in enumerate("lr"):
        side = anatomy.sides[letter]
        for point, (joint, offset) in enumerate((
            ("ankle", side.subtalar + side.heel),
            ("metatarsal", side.tip * (0.0, 1.0, 0.0)),
            ("metatarsal", side.tip),
        )):  # fmt: skip
            frame = matrices[:, anatomy.skeleton.number(f"{letter}_{joint}")]
            points[number, point] = frame[:, :3, 3] + frame[:, :3, :3] @ offset
    return Soles(points)


def advance(animation: Animation, axes: Axes = "iso") -> float:
    """Return the straight distance of the root over the ground from first frame to last, millimetres."""
    values = body_values(animation)
    columns = convention(axes).translation
    gap = values[-1, columns].astype(float) - values[0, columns]
    return float(np.hypot(gap[0], gap[2]))
