"""Angles that pass half a turn: coded the short way or by an I plane, and what cannot be sent is named."""

from fractions import Fraction

import numpy as np
import pytest

import fba
from fba import Animation
from fba.codec import EncoderOptions, EncoderStatistics, encode_animation
from fba.codec._ranges import _extremes
from fba.parameters import bap_numbers, bap_steps
from fba.tracks import BodyTrack

TURN, FORWARD, SIDEWAYS = (
    bap_numbers()[f"HumanoidRoot_{name}"] for name in ("rt_body_turn", "tr_frontal", "tr_lateral")
)
ELBOW, TWIST = (bap_numbers()[f"l_elbow_{name}"] for name in ("flexion", "twisting"))
SCALES = {0: 1, 1: 1, 5: 7, 31: 127}
"""bap_pred_scale of ISO/IEC 14496-2, for some bap_quant."""


def motion(columns: dict[int, list[int] | np.ndarray]) -> Animation:
    """An animation that sends these BAPs."""
    count = len(next(iter(columns.values())))
    values, mask = np.zeros((count, 296), dtype=np.int32), np.zeros((count, 296), dtype=bool)
    for number, column in columns.items():
        values[:, number - 1] = column
        mask[:, number - 1] = True
    return Animation(Fraction(30), np.arange(count), body=BodyTrack(values, mask))


def coded(animation: Animation, **options: object) -> tuple[np.ndarray, EncoderStatistics]:
    """The BAPs that a decoder returns, as int64, and what the encoder counted."""
    chosen = EncoderOptions(**options)  # type: ignore[arg-type]
    data, statistics = encode_animation(animation, chosen)
    return fba.decode(data, bap_steps=chosen.bap_steps).body.values.astype(np.int64), statistics


def angle_between(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Angles in 1e-5 rad between directions, which full turns do not change."""
    return np.abs(np.angle(np.exp(1e-5j * (one - other)))) * 1e5


@pytest.mark.parametrize("far", [4539, 0])
@pytest.mark.parametrize("clamp", [True, False])
def test_a_turn_past_half_a_turn_keeps_its_direction(clamp: bool, far: int) -> None:
    """Frames 57 to 61 of a capture that came out turned round: no I plane carries a root 4.5 m away."""
    turn = [312233, 313766, -313255, -312200, -311524]
    walk = [0, 0, 3000, *[far] * 5]
    animation = motion({TURN: [0, 150_000, 300_000, *turn], FORWARD: walk})
    if far and not clamp:
        with pytest.raises(fba.RangeError, match="HumanoidRoot_tr_frontal"):
            coded(animation, bap_steps="visage")
        return
    got, statistics = coded(animation, bap_steps="visage", clamp=clamp)
    assert angle_between(got[3:, TURN - 1], np.array(turn)).max() <= 85 + 1  # half a step, and a rounded turn
    assert np.abs(got[:, FORWARD - 1] - walk).max() <= 1
    assert statistics.clamped == 0
    assert statistics.intra_planes == (1 if clamp else 2)


def test_a_first_angle_beyond_half_a_turn_is_moved_within() -> None:
    """No I plane carries 7 rad; 7 - 2 pi is the same direction."""
    got, statistics = coded(motion({TURN: [700_000, 710_000]}), bap_steps="visage", clamp=True)
    assert angle_between(got[:, TURN - 1], np.array([700_000, 710_000])).max() <= 86
    assert abs(got[0, TURN - 1]) < 314_159
    assert statistics.clamped == 0


def test_i_planes_that_are_due_are_written_where_a_person_turns_round_and_round() -> None:
    turn = np.arange(0, 3_000_000, 10_000)
    got, statistics = coded(motion({TURN: turn}), bap_steps="visage", clamp=True, intra_period=1)
    assert angle_between(got[:, TURN - 1], turn).max() <= 90  # half a step, and half a unit for each turn
    assert (statistics.intra_planes, statistics.clamped) == (10, 0)


def test_the_plane_with_the_smaller_error_is_chosen() -> None:
    """A root that is 4 mm, or 2 m, beyond what I planes carry, and that jumps sideways by 5 m."""
    near = motion({FORWARD: [3000, 3724, 3724], SIDEWAYS: [-2000, 3000, 3000]})
    got, statistics = coded(near, bap_steps="visage", clamp=True)
    assert got[:, FORWARD - 1].tolist() == [3000, 3720, 3724]
    assert got[:, SIDEWAYS - 1].tolist() == [-2000, 3000, 3000]
    assert list(statistics.clamped_parameters) == [f"BAP {FORWARD} HumanoidRoot_tr_frontal"]
    far = motion({FORWARD: [3000, 6000, 6000], SIDEWAYS: [-2000, 3000, 3000]})
    got, statistics = coded(far, bap_steps="visage", clamp=True)
    assert got[:, FORWARD - 1].tolist() == [3000, 6000, 6000]
    assert got[:, SIDEWAYS - 1].tolist() == [-2000, -2000 + 3720, 3000]
    (named,) = statistics.clamped_parameters.values()
    assert (named.count, named.first, named.frame, named.value, named.sent) == (1, 1, 1, 3000, 1720)
    assert named.off == 1280


def test_a_value_out_of_reach_is_reported_with_its_worst_frame() -> None:
    got, statistics = coded(motion({FORWARD: [5000, 6000, 6000, 6000]}), bap_steps="visage", clamp=True)
    assert got[:, FORWARD - 1].tolist() == [3720, 6000, 6000, 6000]
    named = statistics.clamped_parameters[f"BAP {FORWARD} HumanoidRoot_tr_frontal"]
    assert (named.count, named.first, named.frame, named.value, named.sent) == (1, 0, 0, 5000, 3720)


@pytest.mark.parametrize("table", ["iso", "visage"])
@pytest.mark.parametrize("quant", SCALES)
@pytest.mark.parametrize("period", [None, 0.5])
def test_every_value_is_sent_or_reported(table: str, quant: int, period: float | None) -> None:
    """Angles that wander through many turns, written within +-pi, and a root that wanders off."""
    random = np.random.default_rng(3)
    angles = np.cumsum(random.normal(0, 20_000, (150, 3)), axis=0) + random.normal(0, 200_000, (1, 3))
    angles = (np.angle(np.exp(1e-5j * angles)) * 1e5).astype(np.int32)
    root = np.cumsum(random.normal(20, 20, 150)).astype(np.int32)
    columns = {TURN: angles[:, 0], ELBOW: angles[:, 1], TWIST: angles[:, 2], FORWARD: root}
    got, statistics = coded(
        motion(columns), bap_steps=table, bap_quant=quant, clamp=True, intra_period=period
    )
    for number, column in columns.items():
        step = bap_steps(table)[number - 1] * SCALES[quant] if quant else 1
        sent = got[:, number - 1]
        off = np.abs(sent - column) if number == FORWARD else angle_between(sent, column)
        missed = np.flatnonzero(off > step / 2 + 10)  # a full turn is rounded by half a unit
        name = next((one for one in statistics.clamped_parameters if one.startswith(f"BAP {number} ")), None)
        assert len(missed) == (statistics.clamped_parameters[name].count if name else 0)
        if name:
            named = statistics.clamped_parameters[name]
            assert named.first == missed[0]
            assert named.frame == int(off.argmax())
    if quant in (1, 5) and table == "visage":
        assert statistics.clamped == 0


def test_without_clamp_values_do_not_change() -> None:
    """Only the pose must be kept with clamp; without, a decoder returns the very numbers."""
    turn = [0, 170_000, 312_800, -312_800, -170_000]
    got, statistics = coded(motion({TURN: turn}), bap_steps="visage")
    assert got[:, TURN - 1].tolist() == turn
    assert statistics.intra_planes == 2


def test_ranges_of_angles_fit_the_shorter_turns() -> None:
    """From 310,000 to -308,318 it is 10,000, as before: 618,318 would cost bits in every frame."""
    values = np.array([[300_000], [310_000], [-308_318]], dtype=np.int32)
    extremes = np.zeros((4, 1), dtype=np.int64)
    one, last, sent = np.ones(1, dtype=np.int64), np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.bool_)
    _extremes(values, np.ones((3, 1), dtype=np.bool_), one, one * 628_318, extremes, last, sent)
    assert extremes[2:, 0].tolist() == [10_000, 0]


@pytest.mark.parametrize("before", [[], [300_000]])
def test_angles_are_not_turned_unless_asked(before: list[int]) -> None:
    with pytest.raises(fba.RangeError, match="rt_body_turn: the value 4000000"):
        coded(motion({TURN: [*before, 4_000_000]}), bap_steps="visage", intra_period=1)
