"""Feet of the retargeted body: joints that turn them, and legs that take them where the source's stand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fba import rotations
from fba.capture.limbs import _leg_ik as leg_ik
from fba.capture.limbs import bone_ik, ground, soles

if TYPE_CHECKING:
    from fba.capture.retarget import Retarget

Float = npt.NDArray[np.float64]

STEPS = 4
"""Of finding the ankle and the roll that point a foot exactly."""
ROUNDS = 2
"""How often legs move for what their feet still lack."""
STIFFEST = 1.1
"""Say of a straight leg in how high the body is, which a bent one has less of, being able to give way."""


class Footing:
    """Works on the wanted rotations of a body that is being retargeted.

    rotations: side -> (T, 3, 3), of the whole foot, as the source's stands.
    """

    def __init__(self, body: Retarget) -> None:
        self.body = body
        self.rotations: dict[str, Float] = {}

    def turn(self, side: str) -> None:
        """The ankle lacks the roll of the foot: the subtalar joint, a little lower, takes it."""
        ankle, subtalar, toe = f"{side}_ankle", f"{side}_subtalar", f"{side}_metatarsal"
        if ankle not in self.body.wanted or subtalar not in self.body.skeleton:
            return
        foot = self.rotations.setdefault(side, self.body.wanted[ankle])
        if self.body.aims.get(ankle) != toe:
            self._split(ankle, subtalar, foot)
            return
        places = {j: self.body.skeleton.centres[self.body.skeleton.number(j)] for j in (ankle, subtalar, toe)}
        heel, sole = places[subtalar] - places[ankle], places[toe] - places[subtalar]
        direction = foot @ self.body.bone(ankle, toe)
        for _ in range(STEPS):  # what lies between the two joints turns with the ankle only
            self._split(ankle, subtalar, foot)
            foot = rotations.between_all(self.body.wanted[ankle] @ heel + foot @ sole, direction) @ foot
        self._split(ankle, subtalar, foot)

    def _split(self, ankle: str, subtalar: str, foot: Float) -> None:
        """Both joints together take the foot's rotation: flexion, twisting and roll make any of them."""
        above = self.body.before(ankle)
        own = self.body.turns(ankle)[0]
        axes = np.concatenate([own, self.body.turns(subtalar)[0]])
        self.body.wanted[subtalar] = foot
        handed = np.linalg.det(axes) if len(axes) == 3 else 0.0
        if abs(handed) < 0.5:
            return
        last = rotations.inside(above, foot @ axes[2]) @ axes.T  # the last axis, as the foot turns it
        outer = np.arctan2(-handed * last[:, 1], last[:, 2])
        inner = np.arctan2(handed * last[:, 0], np.hypot(last[:, 1], last[:, 2]))
        self.body.wanted[ankle] = above @ bone_ik.product(own, np.stack([outer, inner], axis=1))

    def stand(self, root: Float, floor: str, plant: bool) -> None:
        """Raises root (T, 3) until feet stand as the source's do; plant: legs move for what is lacking."""
        body = self.body
        toes = "l_metatarsal" in body.mapped
        rate = float(body.motion.rate)
        source = soles.source_soles(
            body.motion, body.mapped, body.upright, body.turned, body.places, body.scale
        )
        standing = soles.body_soles(body.skeleton, body.wanted, root, toes)
        if source is None or standing is None:
            return
        middles = source.points.mean(axis=1)
        level = ground.found(source.lowest, middles).under(middles)
        above = source.lowest - level
        under = np.zeros_like(level) if floor == "floor" else level
        stiff = np.ones_like(above)
        if plant and all(self.body.aims.get(f"{side}_hip") == f"{side}_knee" for side in "lr"):
            pliant = np.array([leg_ik.pliancy(self._leg(side, root)) for side in "lr"])
            stiff = STIFFEST - pliant
            raised = soles.lift(above, standing.lowest - under, stiff, rate)
            whole, along = soles.slips(source.points, standing.points, level, rate)
            root[:, [0, 2]] += whole
            ups = soles.heights(above, standing.lowest - under + raised, rate)
            for side, pitch in zip("lr", soles.pitches(standing.points, ups), strict=True):
                self.rotations[side] = pitch @ self.rotations[side]
                self.turn(side)
            for _ in range(ROUNDS):
                standing = soles.body_soles(body.skeleton, body.wanted, root, toes) or standing
                ups = soles.heights(above, standing.lowest - under + raised, rate)
                for side, up, course in zip("lr", ups, along, strict=True):
                    self._move(side, root, np.stack([course[:, 0], up, course[:, 1]], axis=1))
                along = np.zeros_like(along)
            standing = soles.body_soles(body.skeleton, body.wanted, root, toes) or standing
        root[:, 1] += soles.lift(above, standing.lowest - under, stiff, rate)

    def _move(self, side: str, root: Float, move: Float) -> None:
        """A leg takes its foot elsewhere, by move (T, 3), metres."""
        thigh, shank = leg_ik.reach(self._leg(side, root), move)
        self.body.wanted[f"{side}_hip"] = thigh @ self.body.wanted[f"{side}_hip"]
        self.body.wanted[f"{side}_knee"] = shank @ self.body.wanted[f"{side}_knee"]
        self.turn(side)

    def _leg(self, side: str, root: Float) -> leg_ik.Leg:
        """Where the joints of a leg are."""
        knee = f"{side}_knee"
        found = {
            name: (place, frame)
            for name, place, frame in soles.followed(
                self.body.skeleton, self.body.wanted, root, f"{side}_ankle"
            )
        }
        axes, *_ = self.body.turns(knee)
        bone = self.body.bone(knee, f"{side}_ankle")
        outermost = abs(axes[0] @ bone) < abs(axes[-1] @ bone)
        axis = found[f"{side}_hip"][1] @ axes[0] if outermost else found[knee][1] @ axes[-1]
        hip, middle, ankle = (found[f"{side}_{joint}"][0] for joint in ("hip", "knee", "ankle"))
        return leg_ik.Leg(hip, middle, ankle, axis)
