"""The bones of legs and arms that a walk needs, and the points at which soles touch the ground."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.animation import Animation
from fba.arrays import Float64, Int32
from fba.body._skeleton import ROOT, Skeleton
from fba.body.solve.conventions import convention
from fba.choices import Axes
from fba.errors import ModelError
from fba.rotations import apply, axis_matrices

KNEE = 1.0
"""Sense in which a knee bends: about +x, backward."""
ELBOW = -1.0
"""Sense in which an elbow bends: about -x, forward."""
HEEL_BEHIND = 0.054
"""Metres from the ankle's centre back to where the heel touches, for the default body."""
TOES_AHEAD = 0.062
"""Metres from the metatarsal joint to the tip of the toes, for the default body."""
HIP_HEIGHT = 0.9364
"""Height of the default body's hips, metres; a body's scale is the height of its hips divided by this."""
PALMS = ("middle0", "middle1", "index0", "wrist")
"""Joints that may represent the palm; the first that the skeleton has is used."""


@dataclass(frozen=True, eq=False)
class Limb:
    """A limb of two bones (3,), in the default posture, metres. sense: `KNEE` or `ELBOW`."""

    upper: Float64
    lower: Float64
    sense: float

    def _hinge(self) -> tuple[float, float, float]:
        """Return constant, m, straight: the squared reach at a bend b is constant + 2 m cos(b - straight)."""
        u, w = self.upper, self.lower
        along, across = u[1] * w[1] + u[2] * w[2], u[2] * w[1] - u[1] * w[2]
        constant = float(u @ u + w @ w + 2.0 * u[0] * w[0])
        return constant, float(np.hypot(along, across)), float(np.arctan2(across, along))

    @property
    def reach(self) -> float:
        """Length of the straight limb from end to end, metres."""
        constant, m, _ = self._hinge()
        return float(np.sqrt(constant + 2.0 * m))

    def length(self, bend: npt.ArrayLike) -> Float64:
        """Return metres from end to end at a bend, radians (the rotation about x, times `sense`)."""
        constant, m, straight = self._hinge()
        return np.sqrt(
            constant + 2.0 * m * np.cos(self.sense * np.asarray(bend, dtype=np.float64) - straight)
        )

    def bend(self, length: npt.ArrayLike) -> Float64:
        """Return the bend, radians, at which the ends are `length` metres apart, or as nearly as possible."""
        constant, m, straight = self._hinge()
        cosine = (np.square(np.asarray(length, dtype=np.float64)) - constant) / (2.0 * m)
        return self.sense * straight + np.arccos(np.clip(cosine, -1.0, 1.0))

    def solve(self, target: Float64, twist: npt.ArrayLike) -> tuple[Float64, Float64]:
        """Return rotations (..., 3, 3) of the upper bone, and bends (...), that bring the end to a target.

        target: (..., 3), from the limb's root, in the frame of its parent. twist: angle about the upper bone
        itself, the innermost of its rotations (abduction, then flexion follow). The limb points at a target
        that is out of reach.
        """
        twist = np.asarray(twist, dtype=np.float64)
        bend = self.bend(np.linalg.norm(target, axis=-1))
        end = self.upper + apply(axis_matrices(0, self.sense * bend), self.lower)
        end = apply(axis_matrices(1, twist), end)
        scale = np.linalg.norm(end, axis=-1) / np.linalg.norm(target, axis=-1)
        wanted = target * scale[..., None]
        flat = np.hypot(end[..., 0], end[..., 1])
        abduction = -np.arccos(np.clip(wanted[..., 0] / flat, -1.0, 1.0)) - np.arctan2(
            end[..., 1], end[..., 0]
        )
        abducted = apply(axis_matrices(2, abduction), end)
        flexion = np.arctan2(wanted[..., 2], wanted[..., 1]) - np.arctan2(abducted[..., 2], abducted[..., 1])
        return axis_matrices(0, flexion) @ axis_matrices(2, abduction) @ axis_matrices(1, twist), bend


def limb_angles(rotation: Float64) -> tuple[Float64, Float64, Float64]:
    """Return angles x, y, z of rotations (..., 3, 3) = Rx . Rz . Ry, of a limb: flexion is outermost."""
    z = np.arcsin(np.clip(-rotation[..., 0, 1], -1.0, 1.0))
    x = np.arctan2(rotation[..., 2, 1], rotation[..., 1, 1])
    y = np.arctan2(rotation[..., 0, 2], rotation[..., 0, 0])
    return x, y, z


def foot_angles(rotation: Float64) -> tuple[Float64, Float64, Float64]:
    """Return angles x, y, z of rotations (..., 3, 3) = Rx . Ry . Rz, of a foot: ankle, then subtalar."""
    y = np.arcsin(np.clip(rotation[..., 0, 2], -1.0, 1.0))
    x = np.arctan2(-rotation[..., 1, 2], rotation[..., 2, 2])
    z = np.arctan2(-rotation[..., 0, 1], rotation[..., 0, 0])
    return x, y, z


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
