"""Synthesis of walks from four poses: `walk`.

Inverse kinematics bring the palms to their positions in the poses, as in the source.
"""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from fba.animation import Animation, BodyTrack
from fba.arrays import Float64
from fba.body._skeleton import Skeleton
from fba.body.gait import _ground as ground
from fba.body.gait._anatomy import Anatomy, Side, Writer, limb_angles
from fba.body.gait._characters import Character
from fba.body.gait._curves import Interpolation, check_interpolation, cosine_wave, periodic_curve
from fba.body.gait._plan import KNOTS, MIN_STRIDE, Plan, make_plan
from fba.body.solve.solver import BapSolver
from fba.errors import ModelError

MIN_CYCLE_FRAMES = 8
"""Smallest number of frames of a cycle: one for each of its poses."""
MAX_FRAMES = 100_000
"""Largest number of frames of a walk."""
LUMBAR = tuple(f"vl{n}" for n in (5, 4, 3, 2, 1))
THORAX = tuple(f"vt{n}" for n in range(12, 0, -1))
NECK = tuple(f"vc{n}" for n in range(7, 0, -1))
HEAD = ("skullbase",)
FINGERS = ("index", "middle", "ring", "pinky")
_MORE_CURL = {"index": 0.85, "middle": 0.95, "ring": 1.1, "pinky": 1.2}
"""Factors of the curl of each finger: a hand at rest closes towards the little finger."""
_JOINT_CURL = {1: 0.75, 2: 1.4, 3: 0.85}
"""Factors of the curl of the joints along a finger: the middle one bends most."""
_SPREAD = {"index": -4.0, "middle": -1.0, "ring": 2.0, "pinky": 5.0}
"""Degrees by which fingers at rest are apart."""
_GIRDLE = 0.7
"""Turn of the shoulder girdles relative to that of the chest, which they continue."""
_LATE = 0.02
"""Fraction of the cycle by which arms lag behind the legs."""
_REACH = 0.995
"""Share of its length to which an arm may stretch."""


def walk(
    stride: float | None = None,
    character: str | Character = "normal",
    *,
    cycles: float | None = None,
    seconds: float | None = None,
    rate: Fraction | int | str = 30,
    interpolation: Interpolation = "smooth",
    in_place: bool = False,
    skeleton: Skeleton | None = None,
) -> Animation:
    """Return a walk along +z that begins with the contact of the right foot: legs, arms, spine and root.

    stride: metres from one contact of a foot to its next, two steps, rounded to mm; where None, that of the
        character, scaled to the skeleton. The character sets the time of a cycle, so the stride sets the
        speed.
    character: a name of `characters()`, or a `Character`.
    cycles: their number, 4 by default; the last frame is the first pose again, one stride further.
    seconds: duration, in place of cycles, without that last frame.
    rate: frames a second; a cycle has a whole number of frames, 32 of the normal character at 30.
    interpolation: between the poses "smooth", by cubic curves, or "linear", as in the source.
    in_place: walk on the spot, as on a treadmill.
    skeleton: the default body where None.

    ModelError for a stride too long for the legs, or a character or skeleton that cannot walk; ValueError for
    other wrong arguments.
    """
    if not isinstance(character, Character):
        character = Character.named(character)
    anatomy = Anatomy.measure(Skeleton.default() if skeleton is None else skeleton)
    stride = _check_stride(stride, character, anatomy)
    rate = Fraction(rate)
    if rate <= 0:
        raise ValueError(f"walk: the frame rate must be positive, not {rate}")
    period = round(float(character.seconds * rate)) if rate < MAX_FRAMES else 0
    if not MIN_CYCLE_FRAMES <= period <= MAX_FRAMES:
        raise ValueError(
            f"walk: {rate} frames/s make {float(character.seconds * rate):.4g} frames of a cycle of "
            f"{character.seconds:g} s; it needs {MIN_CYCLE_FRAMES} to {MAX_FRAMES}: change the rate"
        )
    count = _frame_count(cycles, seconds, rate, period)
    cycle = write_cycle(make_plan(anatomy, character, stride, check_interpolation(interpolation)), period)
    frames = np.arange(count)
    values = cycle.values[frames % period]
    forward = cycle.forward_column
    if not in_place:
        values[:, forward] += frames // period * round(1000.0 * stride)
    else:
        share = np.arange(period) / period * 1000.0 * stride
        values[:, forward] -= np.rint(share[frames % period])
    integers = np.rint(values).astype(np.int32)
    mask = np.broadcast_to(cycle.sent, integers.shape)
    name = f"{character.name} walk"
    return Animation(rate, frames, None, BodyTrack(integers, mask), name)


def write_cycle(plan: Plan, period: int) -> Writer:
    """Return the BAPs of one cycle of `period` frames."""
    anatomy, character = plan.anatomy, plan.character
    phase = np.arange(period) / period
    writer = Writer(period)
    write_posture(writer, anatomy.skeleton, plan, phase)
    writer.turn("HumanoidRoot", 0, np.full(period, np.radians(character.pelvis.tilt)))
    turn, roll = plan.pelvis_angles(phase)
    writer.turn("sacroiliac", 1, turn)
    writer.turn("sacroiliac", 2, roll)
    swing_arms(writer, plan, phase)
    rest = anatomy.skeleton.centres[0]
    root = plan.root(phase) - rest
    start = root[0, 2]
    root[:, 2] -= start  # the walk begins where the body stands by default
    writer.move(root)
    # The root is sent in whole millimetres; legs that start from the rounded root keep feet from slipping.
    # Its height is not rounded here: half a millimetre would bend a nearly straight knee by degrees.
    root[:, [0, 2]] = np.rint(root[:, [0, 2]] * 1e3) / 1e3
    pelvis = plan.lean(phase) @ plan.pelvis(phase)
    for side in anatomy.sides.values():
        leg = plan.leg(side, phase, root + rest + (0.0, 0.0, start))
        _write_leg(writer, side.letter, pelvis, leg)
        toes = plan.toes(plan.side_phase(side, phase))
        writer.turn(f"{side.letter}_metatarsal", 0, -toes)
    return writer


def _write_leg(writer: Writer, letter: str, pelvis: Float64, leg: ground.Leg) -> None:
    for axis, angle in enumerate(ground.hip_angles(pelvis, leg.thigh)):
        writer.turn(f"{letter}_hip", axis, angle)
    writer.turn(f"{letter}_knee", 0, leg.bend)
    x, y, z = leg.ankle()
    writer.turn(f"{letter}_ankle", 0, x)
    writer.turn(f"{letter}_ankle", 1, y)
    writer.turn(f"{letter}_subtalar", 2, z)


def _check_stride(stride: float | None, character: Character, anatomy: Anatomy) -> float:
    if stride is None:
        return round(character.stride * anatomy.scale, 3)
    try:
        metres = float(stride)
    except (TypeError, ValueError) as error:
        raise ValueError(f"walk: the stride must be a number of metres, not {stride!r}") from error
    if not (np.isfinite(metres) and metres >= MIN_STRIDE * anatomy.scale):
        raise ModelError(
            f"gait: the stride must be at least {MIN_STRIDE * anatomy.scale:.2g} m, not {stride!r}; "
            "it is the distance from one contact of a foot to its next, two steps: 1.4 m in an even walk"
        )
    if metres > 4.0 * anatomy.sides["r"].leg.reach:
        raise ModelError(
            f"gait: a stride of {metres:g} m is too long on legs of {anatomy.sides['r'].leg.reach:.2f} m; it "
            "is given in metres, and 1.4 m in an even walk"
        )
    return round(metres, 3)


def _frame_count(cycles: float | None, seconds: float | None, rate: Fraction, period: int) -> int:
    """Return the number of frames of a walk; ValueError where its length is not positive or too long."""
    if cycles is not None and seconds is not None:
        raise ValueError("walk: give either cycles or seconds, not both")
    wanted = seconds if seconds is not None else 4 if cycles is None else cycles
    what = "seconds" if seconds is not None else "cycles"
    if not (np.isfinite(wanted) and wanted > 0):
        raise ValueError(f"walk: {what} must be a positive number, not {wanted!r}")
    frames = float(wanted) * float(rate) if seconds is not None else float(wanted) * period + 1
    if frames > MAX_FRAMES:
        raise ValueError(f"walk: {wanted:g} {what} would be {frames:.3g} frames (at most {MAX_FRAMES})")
    return max(1, round(frames))


def _turn_spine(
    writer: Writer, skeleton: Skeleton, joints: tuple[str, ...], axis: int, angle: Float64
) -> None:
    """Turn a part of the spine by an angle, radians, shared evenly among those joints the skeleton has."""
    present = [joint for joint in joints if joint in skeleton]
    for joint in present:
        writer.turn(joint, axis, angle / len(present))


def write_posture(writer: Writer, skeleton: Skeleton, plan: Plan, phase: Float64) -> None:
    """Write the angles of spine, head, shoulder girdles and fingers at phases of the cycle.

    The shoulders turn against the pelvis; the neck turns back, so that the face keeps looking ahead.
    """
    spine, arms = plan.character.spine, plan.character.arms
    kind = plan.interpolation
    constant = np.ones(phase.shape)
    turn = -np.radians(spine.turn) * min(plan.stride_ratio, 1.5) * cosine_wave(KNOTS, phase, kind)
    # the right leg carries first, so the first lean is to the right
    lean = np.radians(spine.lean) * cosine_wave(KNOTS, phase - 0.25, kind)
    nod = np.radians(spine.nod) * np.cos(4.0 * np.pi * phase)
    for joints, x, y, z in (
        (LUMBAR, spine.lumbar, 0.35 * turn, 0.6 * lean),
        (THORAX, spine.thorax, 0.65 * turn, 0.4 * lean),
        (NECK, spine.neck, -0.7 * turn, -0.6 * lean),
        (HEAD, spine.head, -0.3 * turn, -0.4 * lean),
    ):
        bent = np.radians(x) * constant + (nod if joints is HEAD else -nod if joints is NECK else 0.0)
        for axis, values in ((0, bent), (1, y), (2, z)):
            _turn_spine(writer, skeleton, joints, axis, values)
    for letter, sign in (("l", 1.0), ("r", -1.0)):
        girdle = f"{letter}_sternoclavicular"
        if girdle in skeleton:
            writer.turn(girdle, 2, sign * np.radians(arms.up) * constant)
            writer.turn(girdle, 1, _GIRDLE * turn - sign * np.radians(arms.forward) * constant)
        for finger, degrees in _SPREAD.items():
            if (joint := f"{letter}_{finger}1") in skeleton:
                writer.turn(joint, 0, np.radians(degrees) * constant)
        curl = np.radians(arms.curl) * constant
        for number in (1, 2, 3):
            for finger in FINGERS:
                if (joint := f"{letter}_{finger}{number}") in skeleton:
                    # fingers flex about z: they curl inward, towards the thigh
                    writer.turn(joint, 2, -sign * curl * _MORE_CURL[finger] * _JOINT_CURL[number])


def _palm_goals(side: Side, character: Character, size: float) -> Float64:
    """Return (8, 3), vectors from the shoulder to the palm in the eight poses of this side's leg, metres."""
    out, down, forward = (np.array(character.curve(field)) for field in ("out", "down", "forward"))
    swing = forward - forward.mean()
    forward = forward.mean() + swing * np.clip(size, 0.0, 1.4)
    goal = np.stack([side.sign * out, -down, forward], axis=-1) * side.arm.reach
    length = np.linalg.norm(goal, axis=-1, keepdims=True)
    return np.asarray(goal * np.minimum(1.0, _REACH * side.arm.reach / length))


def swing_arms(writer: Writer, plan: Plan, phase: Float64) -> None:
    """Write the angles of shoulders and elbows; writer.values must already hold the spine.

    In the poses the palms are where the character has them; in between, angles are interpolated.
    """
    anatomy, character = plan.anatomy, plan.character
    solver = BapSolver(anatomy.skeleton)
    parents = anatomy.skeleton.parents
    for letter, side in anatomy.sides.items():
        start = 0.0 if letter == "r" else 0.5
        poses = np.mod(KNOTS + start + _LATE, 1.0)
        nearest = np.array([np.argmin(np.abs(np.mod(phase - p + 0.5, 1.0) - 0.5)) for p in poses])
        shoulder = anatomy.skeleton.number(f"{letter}_shoulder")
        matrices = solver.pose(writer.values[nearest])[:, parents[shoulder], :3, :3]
        # goals are relative to a frame that moves with the body, level and facing ahead
        local = np.einsum("tji,tj->ti", matrices, _palm_goals(side, character, plan.stride_ratio))
        twist = -side.sign * np.radians(character.arms.twist)
        upper, bend = side.arm.solve(local, np.full(len(KNOTS), twist))
        x, y, z = limb_angles(upper)
        arm_phase = phase - start - _LATE
        for axis, angle in ((0, x), (1, y), (2, z)):
            writer.turn(
                f"{letter}_shoulder", axis, periodic_curve(KNOTS, angle, arm_phase, plan.interpolation)
            )
        writer.turn(f"{letter}_elbow", 0, -periodic_curve(KNOTS, bend, arm_phase, plan.interpolation))
        wrist = -side.sign * np.radians(character.arms.wrist)
        writer.turn(f"{letter}_wrist", 2, np.full(phase.shape, wrist))
        # the hand trails behind the arm, which is fastest halfway
        trail = np.radians(character.arms.trail) * np.clip(plan.stride_ratio, 0.0, 1.4)
        writer.turn(
            f"{letter}_wrist", 0, trail * cosine_wave(KNOTS, arm_phase - 0.25 - _LATE, plan.interpolation)
        )
        inwards = -side.sign * np.radians(character.arms.pronation)
        writer.turn(f"{letter}_elbow", 1, np.full(phase.shape, inwards))
