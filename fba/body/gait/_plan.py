"""One walking cycle of a character on a body: root, pelvis and feet at any phase.

Phases are fractions of the cycle, from the contact of the right foot on. The body walks along +z.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fba.arrays import Float64
from fba.body.gait import _ground as ground
from fba.body.gait._anatomy import Anatomy, Side, limb_angles
from fba.body.gait._characters import CYCLE, PHASES, Character
from fba.body.gait._curves import Interpolation, cosine_wave, periodic_curve, spline
from fba.body.gait._ground import Footing, Leg
from fba.errors import ModelError
from fba.rotations import axis_matrices
from fba.sampling import smoothstep

KNOTS = np.array([*PHASES, *(phase + 0.5 for phase in PHASES)])
MIN_STRIDE = 0.1
"""Shortest stride of a body of standard size, metres."""
_STRAIGHT = 0.9993
"""Share of its length to which a leg may stretch: a knee is never locked."""
_STRAIN = 0.03
"""Largest lowering of the body by a long stride, as a share of the legs' length."""
_RELEASE_RATE = 4.0
"""Metres per cycle at which the height limit of a leg rises once it has left the ground."""
_SOFT = 0.85
"""Softness of a landing: at 1 the leg has the speed of the standing leg already, at 0 that of the swing."""
_CLEAR = 0.012
"""Smallest height of a swinging foot above the ground, metres."""
_PHASE_STEP = 1e-4
"""Difference of phase, a share of the cycle, over which slopes are measured."""


@dataclass(frozen=True, eq=False)
class Plan:
    """The plan of one cycle; `make_plan` makes it. stride: metres."""

    anatomy: Anatomy
    character: Character
    stride: float
    interpolation: Interpolation

    @cached_property
    def stride_ratio(self) -> float:
        """The stride divided by the character's usual one, at this scale."""
        return self.stride / (self.character.stride * self.anatomy.scale)

    @cached_property
    def _foot(self) -> Float64:
        """(8,) pitch of the foot in the poses, radians."""
        ratio = np.clip(self.stride_ratio, 0.0, 1.3)
        foot = np.array(self.character.curve("foot"), dtype=np.float64)
        foot[0] *= ratio
        foot[4:6] *= 0.3 + 0.7 * ratio
        foot[6:] *= 0.6 + 0.4 * ratio
        return np.radians(foot)

    @cached_property
    def _knee(self) -> Float64:
        """(8,) bend of the knee in the poses, radians."""
        knee = np.array(self.character.curve("knee"), dtype=np.float64)
        knee[5:7] *= 0.55 + 0.45 * np.clip(self.stride_ratio, 0.0, 1.3)
        return np.radians(knee)

    @property
    def _toe_off(self) -> float:
        return self.character.feet.leaves

    @property
    def _yaw(self) -> float:
        return float(np.radians(self.character.toes_out))

    def pitch(self, phase: Float64) -> Float64:
        """Return (T,) pitch of a foot at phases of its own leg, radians."""
        phase = np.mod(phase, 1.0)
        # from its contact until it lies flat, a foot falls freely
        flat = min(self._foot[0], self._foot[1])
        landing = (
            flat + (self._foot[0] - flat) * np.maximum(1.0 - phase / self.character.feet.flat, 0.0) ** 1.5
        )
        knots, values = (
            np.array([0.0, self.character.feet.flat, *KNOTS[1:]]),
            np.array([self._foot[0], flat, *self._foot[1:]]),
        )
        later = periodic_curve(knots, values, phase, self.interpolation)
        pitch = np.where(phase < self.character.feet.flat, landing, later)
        return pitch + np.radians(self._correction("foot", phase))

    def _correction(self, part: str, phase: Float64) -> Float64:
        """Return degrees (T,) added to a curve at phases of a leg: see `CORRECTED`; 0 for a standing foot."""
        points = self.character.corrections.get(part, ())
        if not points:
            return np.zeros_like(phase)
        knots, values = np.array([(0.0, 0.0), (self._toe_off, 0.0), *points]).T
        share = np.clip(self.stride_ratio, 0.0, 1.0)
        degrees = periodic_curve(knots, values, np.mod(phase, 1.0), self.interpolation)
        return np.asarray(share * degrees)

    def knee(self, phase: Float64) -> Float64:
        """Return (T,) bend of the knee by the poses, at phases of its own leg, radians."""
        return periodic_curve(KNOTS, self._knee, phase, self.interpolation)

    def toes(self, phase: Float64) -> Float64:
        """Return (T,) bend of the toes upward, radians: they lie flat until they leave the ground."""
        phase = np.mod(phase, 1.0)
        flat = np.maximum(-self.pitch(np.minimum(phase, self._toe_off)), 0.0)
        return np.where(phase < 0.9, flat * (1.0 - smoothstep((phase - self._toe_off) / 0.15)), 0.0)

    def lean(self, phase: Float64) -> Float64:
        """Return (T, 3, 3) rotation of the root."""
        return axis_matrices(0, np.full(phase.shape, np.radians(self.character.pelvis.tilt)))

    def pelvis_angles(self, phase: Float64) -> tuple[Float64, Float64]:
        """Return (torsion about y, roll about z) of the pelvis relative to the root, each (T,), radians."""
        pelvis = self.character.pelvis
        turn = np.radians(pelvis.turn) * np.clip(self.stride_ratio, 0.0, 1.5)
        torsion = turn * cosine_wave(KNOTS, phase, self.interpolation)
        return torsion, -np.radians(pelvis.list) * cosine_wave(KNOTS, phase - 0.25, self.interpolation)

    def pelvis(self, phase: Float64) -> Float64:
        """Return (T, 3, 3) rotation of the pelvis relative to the root."""
        turn, roll = self.pelvis_angles(phase)
        return axis_matrices(1, turn) @ axis_matrices(2, roll)

    def side_phase(self, side: Side, phase: Float64) -> Float64:
        """Return the phase of one leg's own cycle, from the contact of its foot on."""
        return phase if side.letter == "r" else phase - 0.5

    def footprint(self, side: Side, phase: Float64) -> Float64:
        """Return (T, 3) footprint, metres, on which a foot stands or stood last."""
        leg_phase = self.side_phase(side, phase)
        result = np.zeros((*phase.shape, 3))
        result[..., 0] = side.sign * self.character.width / 2.0 * self.anatomy.scale
        result[..., 2] = self.stride * (np.floor(leg_phase + 1e-9) + (0.0 if side.letter == "r" else 0.5))
        return result

    def footing(self, side: Side, phase: Float64) -> Footing:
        """Return the poses of the standing foot; meaningless while it swings."""
        leg_phase = np.mod(self.side_phase(side, phase) + 1e-9, 1.0) - 1e-9
        return ground.place_standing_foot(
            side, self.footprint(side, phase), self.pitch(leg_phase), side.sign * self._yaw
        )

    def _root_along(self, phase: Float64) -> Float64:
        """Return (T, 3) position of the root over the ground, metres, with height 0."""
        pelvis, scale = self.character.pelvis, self.anatomy.scale
        result = np.zeros((*phase.shape, 3))
        result[..., 0] = -pelvis.sway * scale * np.sin(2.0 * np.pi * (phase - 0.02))
        wave = np.sin(4.0 * np.pi * (phase - 0.05)) + np.sin(4.0 * np.pi * 0.05)
        result[..., 2] = self.stride * (phase + pelvis.surge / (4.0 * np.pi) * wave)
        return result

    def hip(self, side: Side, root: Float64, phase: Float64) -> Float64:
        """Return (T, 3) position of a hip for positions (T, 3) of the root, metres."""
        return ground.hip_position(side, self.anatomy.pelvis, root, self.lean(phase), self.pelvis(phase))

    def _root_height(self, side: Side, root: Float64, phase: Float64, bend: Float64 | None = None) -> Float64:
        """Return (T,) height of the root at which a standing leg bends as in the poses, or by `bend`."""
        leg_phase = self.side_phase(side, phase)
        hip = self.hip(side, root, phase)
        ankle = ground.ankle_position(side, self.footing(side, phase))
        bend = self.knee(leg_phase) if bend is None else bend
        return ground.hip_height(side, hip, ankle, bend) - (hip[..., 1] - root[..., 1])

    @cached_property
    def _ahead(self) -> float:
        """Metres that the front foot is ahead of the root in the extended pose.

        Both feet are on the ground, so both legs must give the root the same height. ModelError if
        the stride is too long.
        """
        right, left = self.anatomy.sides["r"], self.anatomy.sides["l"]
        start = np.zeros(1)
        legs = right.leg.reach + left.leg.reach

        def gap(ahead: float) -> float:
            root = self._root_along(start) - (0.0, 0.0, ahead)
            front = self._root_height(right, root, start)
            rear = self._root_height(left, root, start)
            return float((front - rear)[0])

        low, high = -0.25 * legs, 0.5 * self.stride + 0.25 * legs
        if not gap(low) > 0.0 > gap(high):
            raise self.too_long()
        for _ in range(60):
            middle = (low + high) / 2.0
            low, high = (middle, high) if gap(middle) > 0.0 else (low, middle)
        root = self._root_along(start) - (0.0, 0.0, low)
        root[..., 1] = self._root_height(right, root, start)
        if float(root[0, 1]) < 0.45 * self.anatomy.skeleton.centres[0][1]:
            raise self.too_long()
        return low

    def too_long(self) -> ModelError:
        """Return the error of a stride that is too long for the legs."""
        return ModelError(
            f"gait: a stride of {self.stride:g} m is too long for {self.character.name!r} on legs of "
            f"{self.anatomy.sides['r'].leg.reach:.2f} m; a stride is two steps, from the contact of a foot "
            f"to its next, and {self.character.stride * self.anatomy.scale:.2f} m of this character's own"
        )

    def root(self, phase: Float64) -> Float64:
        """Return (T, 3) position of the root, metres, at the height that the standing leg gives it."""
        root, wanted, limit = self._heights(phase)
        root[..., 1] = np.minimum(wanted, limit)
        return root

    def _heights(self, phase: Float64) -> tuple[Float64, Float64, Float64]:
        """Return the root over the ground (T, 3), its height (T,) by the poses, and its largest one (T,)."""
        root = self._root_along(phase) - (0.0, 0.0, self._ahead)
        share = smoothstep(np.mod(phase, 0.5) / (self._toe_off - 0.5))
        right_leads = np.mod(phase, 1.0) < 0.5
        heights, limits = {}, []
        for letter, side in self.anatomy.sides.items():
            heights[letter] = self._root_height(side, root, phase)
            limit = self._root_height(side, root, phase, side.leg.bend(_STRAIGHT * side.leg.reach))
            leg_phase = np.mod(self.side_phase(side, phase) + 1e-9, 1.0)
            released = np.maximum(leg_phase - self._toe_off, 0.0) * _RELEASE_RATE * self.anatomy.scale
            limits.append(np.where(leg_phase < KNOTS[6], limit + released, np.inf))
        front = np.where(right_leads, heights["r"], heights["l"])
        rear = np.where(right_leads, heights["l"], heights["r"])
        return root, share * front + (1.0 - share) * rear, np.minimum(*limits)

    def largest_lowering(self) -> float:
        """Return the largest lowering of the body, metres, by a stride that is long for the legs."""
        _, wanted, limit = self._heights(np.arange(2 * CYCLE) / (2 * CYCLE))
        return float((wanted - limit).max())

    def standing_leg(self, side: Side, phase: Float64, root: Float64 | None = None) -> Leg:
        """Return the leg while its foot is on the ground."""
        root = self.root(phase) if root is None else root
        footing = self.footing(side, phase)
        yaw, roll = side.sign * self._yaw, side.sign * self._level_roll
        return ground.solve_leg(side, self.hip(side, root, phase), footing, yaw, roll)

    @cached_property
    def _level_roll(self) -> float:
        """Roll of the left subtalar joint when the heel begins to rise, radians."""
        side, phase = self.anatomy.sides["l"], np.array([0.5 + self.character.feet.rises])
        hip = self.hip(side, self.root(phase), phase)
        leg = ground.solve_leg(side, hip, self.footing(side, phase), self._yaw)
        return float(leg.ankle()[2][0])

    @cached_property
    def _swings(self) -> dict[str, tuple[Float64, Float64, Float64, Float64]]:
        """By side: knots, values and end slopes of the angles of thigh (x, z, in the world) and knee."""
        return {letter: self._swing(side) for letter, side in self.anatomy.sides.items()}

    def _swing(self, side: Side) -> tuple[Float64, Float64, Float64, Float64]:
        """Return the entry of `_swings` for one side."""
        start = 0.0 if side.letter == "r" else 0.5
        ends = start + np.array([self._toe_off - _PHASE_STEP, self._toe_off, 1.0, 1.0 + _PHASE_STEP])
        leg = self.standing_leg(side, ends)
        x, _, z = limb_angles(leg.thigh)
        solved = np.stack([x, z, leg.bend], axis=-1)
        off, on = (solved[1] - solved[0]) / _PHASE_STEP, (solved[3] - solved[2]) / _PHASE_STEP
        knots = np.array([self._toe_off, KNOTS[6], KNOTS[7], 1.0])
        poses = self.character.poses
        landing = -np.degrees(solved[2][0])
        usual = landing if abs(self.stride_ratio - 1.0) < 1e-9 else self._usual_landing(side)
        values = [solved[1]]
        # a swinging thigh follows a longer or shorter stride, the more the nearer the foot is to its contact
        for number, (pose, follow) in enumerate((("passing", 0.6), ("anticipation", 1.0))):
            thigh = poses[pose, "swing"].thigh + follow * (landing - usual)
            share = (knots[number + 1] - self._toe_off) / (1.0 - self._toe_off)
            aside = solved[1][1] + share * (solved[2][1] - solved[1][1])
            values.append(np.array([-np.radians(thigh), aside, self._knee[6 + number]]))
        values.append(solved[2])
        slope = 1.5 * (values[3] - values[2]) / (knots[3] - knots[2])
        slope -= 0.5 * (values[3] - values[1]) / (knots[3] - knots[1])
        return knots, np.stack(values), off, (1.0 - _SOFT) * slope + _SOFT * on

    def _usual_landing(self, side: Side) -> float:
        """Return degrees of the thigh at the contact of the foot, in the character's own stride."""
        usual = self.character.stride * self.anatomy.scale
        plan = make_plan(self.anatomy, self.character, usual, self.interpolation)
        start = np.array([0.0 if side.letter == "r" else 0.5])
        return float(-np.degrees(limb_angles(plan.standing_leg(side, start).thigh)[0][0]))

    def leg(self, side: Side, phase: Float64, root: Float64) -> Leg:
        """Return the leg at any phase, standing or swinging, for positions (T, 3) of the root."""
        leg_phase = np.mod(self.side_phase(side, phase) + 1e-9, 1.0) - 1e-9
        stands = leg_phase <= self._toe_off
        yaw = side.sign * self._yaw
        knots, values, off, on = self._swings[side.letter]
        swing = np.clip(leg_phase, self._toe_off, 1.0)
        if self.interpolation == "linear":
            x, z, bend = (np.interp(swing, knots, column) for column in values.T)
        else:
            x, z, bend = np.moveaxis(spline(knots, values, off, on, swing), -1, 0)
        x = x - np.radians(self._correction("thigh", swing))
        bend = bend + np.radians(self._correction("knee", swing))
        thigh = axis_matrices(0, x) @ axis_matrices(2, z) @ axis_matrices(1, np.full(x.shape, yaw))
        hip = self.hip(side, root, phase)
        foot = ground.foot_turn(self.pitch(leg_phase), yaw)
        swinging = ground.place_swinging_foot(side, hip, thigh, bend, foot)
        rise = np.minimum((leg_phase - self._toe_off) / 0.03, (1.0 - leg_phase) / 0.06)
        room = _CLEAR * self.anatomy.scale * np.clip(rise, 0.0, 1.0)
        lift = np.maximum(room - ground.lowest_height(side, swinging, self.toes(leg_phase)), 0.0)
        swinging.subtalar[..., 1] += lift
        standing = self.footing(side, phase)
        footing = Footing(
            np.where(stands[..., None, None], standing.turn, swinging.turn),
            np.where(stands[..., None], standing.subtalar, swinging.subtalar),
        )
        return ground.solve_leg(side, hip, footing, yaw, side.sign * self._level_roll)


def make_plan(anatomy: Anatomy, character: Character, stride: float, interpolation: Interpolation) -> Plan:
    """Return the plan of one cycle. stride: metres; ModelError if it is too long for the legs."""
    plan = Plan(anatomy, character, stride, interpolation)
    if plan.largest_lowering() > _STRAIN * anatomy.sides["r"].leg.reach:
        raise plan.too_long()
    return plan
