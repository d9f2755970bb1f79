"""Steps found in walks, made and captured; each decision constant has a test here that dies with it."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import Animation, BodyTrack, FaceTrack
from fba.body import gait
from fba.body.gait import _detection as detection
from fba.body.gait._detection import Curves
from fba.parameters import bap_numbers

NUMBERS = bap_numbers()


def turned(animation: Animation, degrees_per_frame: float) -> Animation:
    """The same walk on a curve: the whole body turned, its path bent."""
    values = animation.body.values.astype(float)
    x, z, y = (NUMBERS[f"HumanoidRoot_{n}"] - 1 for n in ("tr_lateral", "tr_frontal", "rt_body_turn"))
    angle = np.radians(degrees_per_frame) * np.arange(len(values))
    forward, aside = np.gradient(values[:, z]), np.gradient(values[:, x])
    values[:, z] = np.cumsum(np.cos(angle) * forward - np.sin(angle) * aside)
    values[:, x] = np.cumsum(np.sin(angle) * forward + np.cos(angle) * aside)
    values[:, y] = angle * 1e5
    track = BodyTrack(np.rint(values).astype(np.int32), np.ones(values.shape, dtype=bool))
    return Animation(animation.rate, animation.index, None, track)


@pytest.mark.parametrize("character", ["normal", "bored", "proud", "hurried"])
def test_poses_of_a_made_walk_are_found(character: str) -> None:
    """They come at 0, 12.5, 25 and 37.5 % and the same after half a cycle."""
    walk = gait.walk(character=character, cycles=4, rate=60)
    found = gait.detect(walk)
    assert [step.side for step in found.steps] == ["right", "left"] * 4
    assert len(found.cycles) == 7
    frames = (len(walk) - 1) / 4
    for cycle in found.cycles:
        assert cycle.seconds == pytest.approx(frames / 60, rel=0.05)
        assert cycle.stride == pytest.approx(gait.Character.named(character).stride, rel=0.05)
        assert cycle.stance == pytest.approx(0.6, abs=0.05)
        assert not cycle.running
        assert abs(cycle.turn) < 4.0  # the pelvis itself turns more than that
    for number, step in enumerate(found.steps):
        wanted = (0.5 * number + np.array([0.0, 0.125, 0.25, 0.375])) * frames
        assert np.abs(np.array(step.poses) - wanted).max() <= 0.045 * frames


def test_walking_in_place_and_backwards_in_the_file() -> None:
    walk = gait.walk(cycles=3, in_place=True)
    found = gait.detect(walk)
    assert len(found.steps) == 6
    assert found.cycles[0].stride < 0.05


def test_a_walk_on_a_curve() -> None:
    found = gait.detect(turned(gait.walk(cycles=4), 1.5))
    assert len(found.steps) >= 7
    for cycle in found.cycles:
        assert cycle.turn == pytest.approx(32 * 1.5, abs=8)


def test_sparse_times() -> None:
    walk = gait.walk(cycles=3, rate=60)
    thin = Animation(walk.rate, walk.index[::2], None, walk.body[::2])
    one, other = gait.detect(walk), gait.detect(thin)
    assert len(one.steps) == len(other.steps)
    for a, b in zip(one.steps, other.steps, strict=True):
        assert np.abs(np.array(a.poses) - 2 * np.array(b.poses)).max() <= 3
    assert one.cycles[0].seconds == pytest.approx(other.cycles[0].seconds, abs=0.07)


def test_nobody_walks() -> None:
    for count in (0, 1, 3, 100):
        assert gait.detect(Animation(30, np.arange(count), None, BodyTrack.empty(count))).steps == ()
    nodding = np.zeros((90, 296), dtype=np.int32)
    nodding[:, NUMBERS["skullbase_tilt"] - 1] = (20000 * np.sin(np.arange(90) / 5)).astype(int)
    still = Animation(30, np.arange(90), None, BodyTrack(nodding, nodding != 0))
    found = gait.detect(still)
    assert found.keys == ()
    assert "no steps" in found.lines()[0]
    with pytest.raises(ValueError, match="no steps"):
        gait.reduce(still)
    face = Animation(30, np.arange(2), FaceTrack(np.zeros((2, 68), np.int32), np.zeros((2, 68), bool)))
    for look in (gait.detect, gait.reduce, gait.soles, gait.advance):
        with pytest.raises(ValueError, match="no body"):
            look(face)


def test_noise_does_not_crash() -> None:
    noise = np.random.default_rng(7)
    for size in (1e3, 1e5, 2e9):
        values = noise.uniform(-size, size, (200, 296)).astype(np.int32)
        animation = Animation(30, np.arange(200), None, BodyTrack(values, np.ones(values.shape, dtype=bool)))
        found = gait.detect(animation)
        assert all(0 <= frame < 200 for frame in found.keys)


def test_running_is_told_from_walking() -> None:
    """Thighs that swing back for 36 % of the cycle: between, both feet are in the air."""
    frames = np.arange(150)
    values = np.zeros((150, 296), dtype=np.int32)
    for side, shift in (("r", 0.0), ("l", 0.5)):
        phase = np.mod(frames / 25 + shift, 1.0)
        back = np.where(phase < 0.36, phase / 0.36, 1.0 - (phase - 0.36) / 0.64)
        values[:, NUMBERS[f"{side}_hip_flexion"] - 1] = 50000 * np.cos(np.pi * back) + 15000
    found = gait.detect(Animation(30, frames, None, BodyTrack(values, values != 0)))
    assert len(found.cycles) >= 5
    assert all(cycle.running for cycle in found.cycles[1:])
    assert all(cycle.stance < 0.5 for cycle in found.cycles[1:])
    assert not any(cycle.running for cycle in gait.detect(gait.walk()).cycles)


@pytest.mark.parametrize(
    ("name", "steps", "seconds", "stride"),
    [
        ("vreng/cmu_walk.bvh", (5, 5), (1.0, 1.2), (1.2, 1.45)),
        ("greta/sad_walk_rd.bvh", (22, 26), (1.3, 1.75), (0.25, 1.1)),
        ("greta/c-Walkaround.bvh", (8, 9), (1.1, 1.4), (0.2, 1.2)),
    ],
)
def test_real_walks(
    shared: Path, name: str, steps: tuple[int, int], seconds: tuple[float, float], stride: tuple[float, float]
) -> None:
    walk = fba.read(shared / "data" / name)
    found = gait.detect(walk)
    assert steps[0] <= len(found.steps) <= steps[1]
    sides = [step.side for step in found.steps]
    assert all(a != b for a, b in pairwise(sides))
    typical = found.cycles[1:-1]
    assert typical
    for cycle in typical:
        assert seconds[0] <= cycle.seconds <= seconds[1]
        assert stride[0] <= cycle.stride <= stride[1]
        assert 0.55 <= cycle.stance <= 0.8
        assert not cycle.running
    for step in found.steps:
        assert sorted({*step.poses, step.end}) == [*step.poses, step.end]


@pytest.mark.parametrize(
    ("name", "factor", "degrees", "centimetres"),
    [
        ("vreng/cmu_walk.bvh", 14.0, 0.8, 1.5),
        ("greta/sad_walk_rd.bvh", 20.0, 1.2, 1.0),
        ("greta/c-Walkaround.bvh", 8.5, 2.5, 1.0),
    ],
)
def test_real_walks_reduced(
    shared: Path, name: str, factor: float, degrees: float, centimetres: float
) -> None:
    walk = fba.read(shared / "data" / name)
    reduced = gait.reduce(walk)
    assert reduced.factor > factor
    errors = {kind: gait.compare_walks(reduced.restore(kind), walk) for kind in ("linear", "smooth")}
    assert errors["smooth"].mean_degrees < degrees
    assert errors["smooth"].mean_cm < centimetres
    assert errors["smooth"].mean_cm < errors["linear"].mean_cm


def test_reduction_keeps_its_keys_and_counts() -> None:
    walk = gait.walk(cycles=4)
    reduced = gait.reduce(walk)
    keys = gait.detect(walk).keys
    assert len(reduced.keys) == reduced.poses == len(keys) == 33
    assert reduced.factor == pytest.approx(129 / 33)
    for kind in ("linear", "smooth"):
        restored = reduced.restore(kind)
        np.testing.assert_array_equal(restored.index, walk.index)
        np.testing.assert_array_equal(restored.body.values[list(keys)], walk.body.values[list(keys)])
    with pytest.raises(ValueError, match="linear or smooth"):
        reduced.restore("cubic")


def test_compare_measures_angles_and_places() -> None:
    bent = np.zeros((2, 296), dtype=np.int32)
    bent[1, NUMBERS["l_elbow_flexion"] - 1] = round(1e5 * np.radians(10))
    other = bent.copy()
    other[1, NUMBERS["l_elbow_flexion"] - 1] = round(1e5 * np.radians(40))
    other[1, NUMBERS["HumanoidRoot_tr_vertical"] - 1] = 20
    one, two = (Animation(30, np.arange(2), None, BodyTrack(v, v != 0)) for v in (bent, other))
    errors = gait.compare_walks(one, two)
    assert errors.worst_joint == "l_elbow"
    assert errors.worst_degrees == pytest.approx(30, abs=1e-3)
    assert errors.mean_degrees == pytest.approx(15, abs=1e-3)
    assert errors.worst_cm == pytest.approx(2.0, abs=1e-6)  # the elbow itself only rises with the body
    assert errors.worst_cm_local == pytest.approx(0.0, abs=1e-6)
    with pytest.raises(ValueError, match="rates differ"):
        gait.compare_walks(one, Animation(25, np.arange(2), None, two.body))
    with pytest.raises(ValueError, match="no frame in common"):
        gait.compare_walks(one, Animation(30, np.arange(5, 7), None, two.body))


def test_turns_past_half_a_turn_are_reduced_without_spinning() -> None:
    walk = turned(gait.walk(cycles=6), 2.0)  # 386 degrees in all
    reduced = gait.reduce(fba.Animation(walk.rate, walk.index, None, BodyTrack(
        fba.body.wrapped(walk.body.values), walk.body.mask)))  # fmt: skip
    errors = gait.compare_walks(reduced.restore("linear"), walk)
    assert errors.worst_degrees < 30


RATE = 100
LEG = 0.8
"""Metres."""


def curves(swing: float, lowest: np.ndarray | None = None, lead: float = 1.0) -> Curves:
    """Feet that swing by a share of the leg's length, in opposite phase, once a second for 4 s.

    lowest: (100,), heights of both feet in one second as shares of the leg's length, from the foremost
    position on. lead: how far the right foot is ahead in its foremost position, as a share of the swing.
    """
    times = np.arange(4 * RATE) / RATE
    wave = 0.5 * swing * LEG * np.cos(2 * np.pi * (times - 0.5))
    heel = {"r": wave, "l": (1.0 - 2.0 * lead) * wave}
    height = np.zeros(4 * RATE) if lowest is None else LEG * np.roll(np.tile(lowest, 4), RATE // 2)
    still = np.zeros(4 * RATE)
    both = {"r": still, "l": still}
    place = {"r": np.zeros((4 * RATE, 3)), "l": np.zeros((4 * RATE, 3))}
    low = {"r": height, "l": height}
    return Curves(times, heel, heel, both, both, place, low, still, LEG)


@pytest.mark.parametrize(
    ("seconds", "rate", "steps"), [(0.36, 100, 0), (0.42, 100, 8), (3.5, 15, 8), (3.7, 15, 0)]
)
def test_steps_take_a_fifth_of_a_second_to_one_and_four_fifths(seconds: float, rate: int, steps: int) -> None:
    walk = gait.walk(character=replace(gait.Character.named("normal"), seconds=seconds), cycles=4, rate=rate)
    assert len(gait.detect(walk).steps) in (steps, steps + 1)


@pytest.mark.parametrize(("swing", "is_step"), [(0.13, True), (0.11, False)])
def test_a_step_swings_a_foot_by_an_eighth_of_the_leg(swing: float, is_step: bool) -> None:
    assert (detection._step(curves(swing), "r", 50, 100, []) is not None) == is_step


@pytest.mark.parametrize(("ahead", "contacts"), [(0.09, 4), (0.07, 0)])
def test_a_step_ends_ahead_of_the_other_foot(ahead: float, contacts: int) -> None:
    """By a twelfth of the leg; a foot that only catches up makes no step."""
    assert len(curves(0.2, lead=ahead / 0.2).contacts("r")) == contacts


def test_a_foot_touches_the_ground_soon_after_it_was_foremost() -> None:
    """It sinks within 6 hundredths of a second; where the ground falls later, it stands already."""
    height = np.zeros(100)
    height[:5] = np.linspace(0.05, 0.012, 5)
    height[5:8], height[8:20] = 0.012, 0.0  # a slope that falls under the standing foot
    assert curves(0.3, height).contacts("r")[1] == 150 + 4
    assert curves(0.3, np.where(np.arange(100) < 6, 0.05, 0.0)).contacts("r")[1] == 150 + 6


def test_a_foot_within_eight_thousandths_of_the_leg_is_on_the_ground() -> None:
    height = np.zeros(100)
    height[:4] = 0.05, 0.009, 0.007, 0.0
    assert curves(0.3, height).contacts("r")[1] == 150 + 2


def test_a_foot_leaves_the_ground_about_its_hindmost_position() -> None:
    """At most 8 hundredths of a second before."""
    height = np.full(100, 0.05)
    height[:44] = 0.0
    assert curves(0.3, height).departures("r")[1] == 50 + 44
    height[30:44] = 0.004  # on its toes
    assert curves(0.3, height).departures("r")[1] == 50 + 44
    height[41:] = 0.05
    assert curves(0.3, height).departures("r")[1] == 50 + 50


@pytest.mark.parametrize(("slower", "cycles"), [(2, 7), (3, 0)])
def test_the_steps_of_a_cycle_take_about_as_long(slower: int, cycles: int) -> None:
    """The second of each pair takes 1.9 times as long as the first, and then 2.9 times: that is a halt."""
    walk = gait.walk(cycles=4)
    period = (len(walk) - 1) // 4
    frame = np.arange(len(walk)) % period - period // 2
    rows = np.repeat(np.arange(len(walk)), np.where((frame >= 0) & (frame < 15), slower, 1))
    body = BodyTrack(walk.body.values[rows], walk.body.mask[rows])
    detected = gait.detect(Animation(walk.rate, np.arange(len(rows)), None, body))
    assert len(detected.steps) == 8
    assert len(detected.cycles) == cycles


def test_points_up_to_two_millimetres_high_are_on_the_ground() -> None:
    points = np.zeros((2, 3, 2, 3))
    points[..., 1] = 0.0021
    points[0, 0, :, 1] = 0.0019
    points[:, :, 1, 0] = 0.01
    soles = gait.Soles(points)
    assert soles.touching.sum() == 2
    assert soles.slip == pytest.approx(0.01)
