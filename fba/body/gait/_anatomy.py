"""The bones of legs and arms that a walk needs, and the points at which soles touch the ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64, Int32
from fba.body.gait._limb import ELBOW, KNEE, Limb
from fba.body.skeleton import ROOT, Skeleton
from fba.body.solve.conventions import convention
from fba.choices import Axes
from fba.errors import ModelError

HEEL_BEHIND = 0.054
"""Metres from the ankle's centre back to where the heel touches, for the default body."""
TOES_AHEAD = 0.062
"""Metres from the metatarsal joint to the tip of the toes, for the default body."""
HIP_HEIGHT = 0.9364
"""Height of the default body's hips, metres; a body's scale is the height of its hips divided by this."""
PALMS = ("middle0", "middle1", "index0", "wrist")
"""Joints that may represent the palm; the first that the skeleton has is used."""


@dataclass(frozen=True, eq=False)
class Side:
    """One side of a body: positions and vectors in the default posture, float64 (3,), metres.

    letter: "l" or "r". sign: +1 left, -1 right. hip: vector from the root. leg, arm: their bones. ankle:
    position of its centre. subtalar: vector from the ankle. heel, toe: vectors from the subtalar joint to
    the heel's ground point and to the metatarsal joint. tip: vector from there to the tip of the toes, on
    the ground.
    """

    letter: str
    sign: float
    hip: Float64
    leg: Limb
    ankle: Float64
    subtalar: Float64
    heel: Float64
    toe: Float64
    tip: Float64
    arm: Limb


@dataclass(frozen=True, eq=False)
class Anatomy:
    """Measurements of a skeleton for walking.

    sides: by letter ("l", "r"). scale: size relative to the default body. pelvis: (3,) vector from the root
    to the sacroiliac joint, metres.
    """

    skeleton: Skeleton
    sides: dict[str, Side]
    scale: float
    pelvis: Float64

    @classmethod
    def measure(cls, skeleton: Skeleton) -> Anatomy:
        """Return the anatomy of a skeleton; ModelError if it lacks legs or arms, or cannot stand."""
        wanted = [ROOT, "sacroiliac"]
        for letter in "lr":
            wanted += [f"{letter}_{j}" for j in ("hip", "knee", "ankle", "subtalar", "metatarsal")]
            wanted += [f"{letter}_{j}" for j in ("shoulder", "elbow", "wrist")]
        missing = [joint for joint in wanted if joint not in skeleton]
        if missing:
            raise ModelError(f"gait: the skeleton has no {', '.join(missing)}; it cannot walk without them")
        centre = {name: skeleton.centres[skeleton.number(name)] for name in skeleton.names}
        height = float(centre["l_hip"][1])
        scale = height / HIP_HEIGHT
        sides = {}
        for letter, sign in (("l", 1.0), ("r", -1.0)):
            hip, knee, ankle, subtalar, toe = (
                centre[f"{letter}_{j}"] for j in ("hip", "knee", "ankle", "subtalar", "metatarsal")
            )
            shoulder, elbow = centre[f"{letter}_shoulder"], centre[f"{letter}_elbow"]
            palm = next(centre[f"{letter}_{j}"] for j in PALMS if f"{letter}_{j}" in skeleton)
            lengths = [np.linalg.norm(b) for b in (knee - hip, ankle - knee, elbow - shoulder, palm - elbow)]
            if height <= 0.0 or ankle[1] < 0.0 or min(lengths) < 1e-3 * scale:
                raise ModelError(
                    "gait: the skeleton's legs and arms need bones longer than 1 mm, and its feet "
                    "must be above the ground (y = 0) in the default posture"
                )
            sides[letter] = Side(
                letter,
                sign,
                hip - centre[ROOT],
                Limb(knee - hip, ankle - knee, KNEE),
                ankle,
                subtalar - ankle,
                np.array([ankle[0], 0.0, ankle[2] - HEEL_BEHIND * scale]) - subtalar,
                toe - subtalar,
                np.array([0.0, -toe[1], TOES_AHEAD * scale]),
                Limb(elbow - shoulder, palm - elbow, ELBOW),
            )
        return cls(skeleton, sides, scale, centre["sacroiliac"] - centre[ROOT])


def body_values(animation: Animation) -> Int32:
    """Return the BAPs (T, 296) of an animation; ValueError without a body track."""
    if animation.body is None:
        raise ValueError("gait: the animation has no body track")
    return animation.body.values


class Writer:
    """Collects angles and positions as BAPs of a convention."""

    def __init__(self, frames: int, axes: Axes = "iso") -> None:
        from fba.parameters import BAP_COUNT

        self._rules = convention(axes)
        self.values = np.zeros((frames, BAP_COUNT))
        self.sent = np.zeros(BAP_COUNT, dtype=bool)

    @property
    def forward_column(self) -> int:
        """Column of the root's translation along z."""
        return int(self._rules.translation[2])

    def turn(self, joint: str, axis: int, radians: Float64 | float) -> None:
        """Set a joint's angle about x, y or z of the body's frame; KeyError where it does not turn so."""
        rules = self._rules
        row = rules.joints.index(joint)
        for slot in range(3):
            if rules.axis[row, slot] == axis and rules.bap[row, slot] >= 0:
                column = rules.bap[row, slot]
                self.values[:, column] = np.asarray(radians) * rules.sign[row, slot] * 1e5
                self.sent[column] = True
                return
        raise KeyError(f"{joint} does not turn about {'xyz'[axis]}")

    def move(self, metres: Float64) -> None:
        """Set the root's translation, (T, 3) metres from the default posture, rounded to mm."""
        for axis in range(3):
            column = self._rules.translation[axis]
            self.values[:, column] = np.rint(metres[:, axis] * self._rules.translation_sign[axis] * 1e3)
            self.sent[column] = True
