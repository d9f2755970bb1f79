"""Bodies whose joints and feet rest after decoding as they do in the capture, measured on decoded streams."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fba
from fba.body import BapSolver, find_stance
from fba.body.stance import sole_points
from fba.codec import EncoderOptions, decode, quantise, step_scale
from fba.parameters import BAP_COUNT, bap_steps, baps
from fba.planning import encode_planned, hold_still

VISAGE = EncoderOptions(bap_steps="visage", clamp=True)
WRIST, TURN = (
    next(bap.number - 1 for bap in baps() if bap.name == name)
    for name in ("l_wrist_flexion", "HumanoidRoot_rt_body_turn")
)
STEP = int(bap_steps("visage")[WRIST])

REAL = ("greta/Fluid_gesture.bvh", "greta/fast_gesture.bvh", "greta/sad_walk_rd.bvh",
        "foreign/bodies/performs_Idle.bvh", "foreign/bodies/vroid_squat.vrma")  # fmt: skip


def body(values: np.ndarray, rate: int = 30) -> fba.Animation:
    """An animation that sends every BAP that moves."""
    mask = np.broadcast_to(values.any(axis=0), values.shape)
    return fba.Animation(rate, np.arange(len(values)), None, fba.BodyTrack(values.astype(np.int32), mask))


def one_bap(values: np.ndarray, column: int = WRIST) -> fba.Animation:
    """An animation of one BAP (T,)."""
    return body(np.where(np.arange(BAP_COUNT) == column, values[:, None], 0))


def held(animation: fba.Animation, options: EncoderOptions = VISAGE) -> np.ndarray:
    """What `hold_still` makes of the BAPs, (T, 296)."""
    return hold_still(animation, options).body.values


def steps_of(options: EncoderOptions) -> np.ndarray:
    return bap_steps(options.bap_steps) * step_scale(options, body=True)


def standing_soles(animation: fba.Animation) -> tuple[np.ndarray, np.ndarray]:
    """Places (2, 2, T, 3) of heels and balls, metres; bool (2, 2, T - 1), between which frames they stand.

    They stand where the foot does and goes by less than 12 mm in 0.2 s.
    """
    solver, rate = BapSolver(), float(animation.rate)
    skeleton, matrices = solver.skeleton, solver.pose(animation.body.values.astype(float))
    points = []
    for side in "lr":
        for joint, point in (sole_points(skeleton, side) or {}).items():
            own = matrices[:, skeleton.number(joint)]
            points.append(own[:, :3, 3] + own[:, :3, :3] @ (point - skeleton.centres[skeleton.number(joint)]))
    soles = np.array(points).reshape(2, 2, -1, 3)
    half = max(round(0.1 * rate), 1)
    around = np.pad(soles, ((0, 0), (0, 0), (half, half), (0, 0)), mode="edge")
    slow = np.linalg.norm(around[:, :, 2 * half :] - around[:, :, : -2 * half], axis=3) < 0.012
    stands = find_stance(skeleton, matrices, rate)[:, None] & slow
    return soles, stands[:, :, 1:] & stands[:, :, :-1]


def speed(animation: fba.Animation, stands: np.ndarray) -> float:
    """Metres per second at which soles go while they stand, root mean square."""
    soles, _ = standing_soles(animation)
    ways = np.linalg.norm(np.diff(soles, axis=2), axis=3)[stands]
    return float(np.sqrt((ways**2).mean()) * float(animation.rate))


def test_a_joint_that_rests_between_two_levels_stays_on_one() -> None:
    """At more than one length: longer motions are searched in blocks, which must not show."""
    rng = np.random.default_rng(1)
    for count in (200, 5000):
        animation = one_bap(np.rint(20.45 * STEP + rng.normal(0, 0.05 * STEP, count)))
        assert np.count_nonzero(np.diff(quantise(animation, VISAGE).body.values[:, WRIST])) > count / 10
        assert not np.diff(held(animation)[:, WRIST]).any()


def test_a_level_changes_at_the_best_time() -> None:
    """A joint that goes on after a rest is not late, as it would be with a dead zone."""
    ramp = np.concatenate([np.full(30, 10.4), np.linspace(10.4, 14.4, 40), np.full(30, 14.4)])
    assert (held(one_bap(ramp * STEP))[:, WRIST] == np.rint(np.rint(ramp * STEP) / STEP) * STEP).all()


def test_a_short_bump_is_left_out_and_a_long_one_is_not() -> None:
    short, long = np.full(60, 10.0), np.full(60, 10.0)
    short[20], long[20:30] = 10.9, 10.9
    assert not np.diff(held(one_bap(short * STEP))[:, WRIST]).any()
    assert np.count_nonzero(np.diff(held(one_bap(long * STEP))[:, WRIST])) == 2


@pytest.mark.parametrize("table", ["iso", "visage"])
@pytest.mark.parametrize("quant", [1, 3])
def test_values_are_multiples_less_than_a_step_off(table: str, quant: int) -> None:
    options = EncoderOptions(bap_steps=table, bap_quant=quant, clamp=True)
    rng = np.random.default_rng(quant)
    values = np.zeros((300, BAP_COUNT))
    moving = [*range(0, 180, 3), 180, 181, 182]
    speeds = rng.choice([1, 10, 300], len(moving))
    values[:, moving] = np.cumsum(rng.normal(0, 1, (300, len(moving))) * speeds, axis=0)
    animation = body(np.rint(values))
    result, steps = held(animation, options), steps_of(options)
    assert not (result % steps).any()
    assert (np.abs(result - np.rint(values)) < steps).all()


def test_angles_continue_past_half_a_turn() -> None:
    turn = 2 * np.pi * 1e5
    values = np.linspace(0, 1.5 * turn, 300)
    animation = one_bap(np.rint((values + turn / 2) % turn - turn / 2), TURN)
    assert np.abs(held(animation)[:, TURN] - values).max() < 2 * STEP
    literal = replace(VISAGE, clamp=False)  # each value as it is
    assert np.abs(held(animation, literal) - animation.body.values).max() < STEP


def test_animations_without_quantised_bodies_stay_as_they_are() -> None:
    values = np.zeros((4, 68), dtype=np.int32)
    face = fba.Animation(25, np.arange(4), fba.FaceTrack(values, np.ones((4, 68), dtype=bool)))
    unquantised = one_bap(np.arange(4) + 100)
    assert hold_still(face) is face
    assert hold_still(unquantised, EncoderOptions(bap_quant=0)) is unquantised


def test_unsent_values_do_not_matter() -> None:
    """A hand that is sent for half of the time only is held as long as it is, and its mask stays."""
    animation = one_bap(np.full(10, 1000.0))
    mask = animation.body.mask.copy()
    mask[5:] = False
    result = hold_still(replace(animation, body=fba.BodyTrack(animation.body.values, mask)), VISAGE).body
    assert (result.values[:, WRIST] == np.where(np.arange(10) < 5, round(1000 / STEP) * STEP, 0)).all()
    assert (result.mask == mask).all()


@pytest.mark.parametrize("name", REAL)
def test_feet_of_captures_that_stand_do_not_tremble(shared: Path, name: str) -> None:
    """They stir half as much as with rounding at most, little more than in the capture, in fewer bits."""
    path = shared / "data" / name
    if not path.exists():
        pytest.skip(f"{path} is missing")
    capture = replace(fba.read(path), face=None)
    soles, stands = standing_soles(capture)
    streams = [encode_planned(one, VISAGE)[0] for one in (capture, hold_still(capture, VISAGE))]
    rounded, still = (decode(data, bap_steps="visage") for data in streams)
    assert len(streams[1]) <= len(streams[0])
    assert speed(still, stands) < 0.5 * speed(rounded, stands)
    assert speed(still, stands) < 1.2 * speed(capture, stands)
    apart = [
        np.linalg.norm(standing_soles(one)[0] - soles, axis=3)[:, :, 1:][stands] for one in (rounded, still)
    ]
    assert apart[1].mean() < 0.8 * apart[0].mean()
