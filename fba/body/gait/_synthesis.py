"""Synthesis of walks from four poses: `walk`."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from fba.animation import Animation, BodyTrack
from fba.arrays import Float64
from fba.body.gait import _ground as ground
from fba.body.gait._anatomy import Anatomy, Writer
from fba.body.gait._characters import Character
from fba.body.gait._curves import Interpolation, check_interpolation
from fba.body.gait._plan import SHORTEST, Plan, make_plan
from fba.body.gait._posture import swing_arms, write_posture
from fba.body.skeleton import Skeleton
from fba.errors import ModelError

FEWEST = 8
"""Fewest frames of a cycle: one for each of its poses."""
MOST = 100_000
"""Most frames of one walk: over half an hour."""


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
    cycles: how many, 4 where seconds is None, too; the last frame is the first pose again, one stride on.
    seconds: how long, in place of cycles, and without that last frame.
    rate: frames a second; a cycle has a whole number of frames, 32 of the normal character at 30.
    interpolation: between the poses "smooth", by cubic curves, or "linear", as in the thesis.
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
    period = round(float(character.seconds * rate)) if rate < MOST else 0
    if not FEWEST <= period <= MOST:
        raise ValueError(
            f"walk: {rate} frames/s make {float(character.seconds * rate):.4g} frames of a cycle of "
            f"{character.seconds:g} s; it needs {FEWEST} to {MOST}: change the rate"
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
    if not (np.isfinite(metres) and metres >= SHORTEST * anatomy.scale):
        raise ModelError(
            f"gait: the stride must be at least {SHORTEST * anatomy.scale:.2g} m, not {stride!r}; it is the "
            "distance from one contact of a foot to its next, two steps: 1.4 m in an even walk"
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
    if frames > MOST:
        raise ValueError(f"walk: {wanted:g} {what} would be {frames:.3g} frames (at most {MOST})")
    return max(1, round(frames))
