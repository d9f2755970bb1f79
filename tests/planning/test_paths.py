"""Paths of one parameter: within their bounds, and never costlier than a dead zone."""

from itertools import product

import numpy as np
import pytest

import fba
from fba import Animation, EncoderOptions, FaceTrack
from fba.planning._code_lengths import level_bits
from fba.planning._paths import Bounds, find_path


def made_bounds(seed: int, *, gaps: bool) -> tuple[Bounds, np.ndarray]:
    """Return bounds around a motion, and levels at the keys that keep within them."""
    rng = np.random.default_rng(seed)
    count, step = int(rng.integers(2, 160)), int(rng.choice([1, 2, 12, 170]))
    keys = np.arange(count)
    if gaps:
        keys = np.flatnonzero(rng.random(count) < 0.5)
        keys = np.union1d(keys, [0, count - 1])
    path = np.cumsum(rng.integers(-3, 4, len(keys)) * (rng.random(len(keys)) < 0.7))
    shown = np.interp(np.arange(count), keys, path) * step
    room = rng.random((2, count)) * step * rng.choice([0.1, 1, 4])
    return Bounds(shown - room[0], shown + room[1], keys, step, int(rng.choice([1, 3]))), path


def hold_until_forced(bounds: Bounds) -> np.ndarray:
    """Return the levels of a dead zone: held until a bound forces the next ones."""
    low = np.ceil(bounds.lower[bounds.keys] / bounds.step - 1e-6)
    high = np.floor(bounds.upper[bounds.keys] / bounds.step + 1e-6)
    level, result = 0.0, []
    for one in range(len(low)):
        level = min(max(level, low[one]), high[one])
        result.append(int(level))
    return np.array(result)


@pytest.mark.parametrize("gaps", [False, True])
def test_paths_stay_within_their_bounds_and_are_no_costlier_than_a_dead_zone(gaps: bool) -> None:
    before = after = 0.0
    for seed in range(60):
        bounds, start = made_bounds(seed, gaps=gaps)
        path = find_path(bounds, start)
        shown = np.interp(np.arange(len(bounds.lower)), bounds.keys, path) * bounds.step
        slack = 1e-5 * bounds.step
        assert (shown >= bounds.lower - slack).all()
        assert (shown <= bounds.upper + slack).all()
        assert level_bits(path, bounds.scale) <= level_bits(start, bounds.scale)
        before, after = before + level_bits(start, bounds.scale), after + level_bits(path, bounds.scale)
        if not gaps:
            alone = find_path(bounds)
            assert (alone * bounds.step >= bounds.lower - slack).all()
            assert (alone * bounds.step <= bounds.upper + slack).all()
            assert level_bits(alone, bounds.scale) <= level_bits(hold_until_forced(bounds), bounds.scale)
    assert after < 0.97 * before


def test_paths_are_cheaper_than_a_dead_zone_on_the_whole() -> None:
    """By a tenth: the trellis finds few different changes, and few frames that have any."""
    found = held = 0.0
    for seed in range(40):
        rng = np.random.default_rng(seed)
        motion = np.cumsum(rng.normal(0, 0.7, 120)) + 5 * np.sin(np.arange(120) / 9)
        bounds = Bounds(motion - 1.5, motion + 1.5, np.arange(120), 1, 3)
        found += level_bits(find_path(bounds), 3)
        held += level_bits(hold_until_forced(bounds), 3)
    assert found < 0.9 * held


def test_paths_follow_their_source_without_jerks() -> None:
    """A change that goes two steps further than the source is one."""
    jerks = []
    for jump in (np.inf, 1.0):
        count = 0
        for seed in range(30):
            motion = np.cumsum(np.random.default_rng(seed).normal(0, 0.4, 120))
            keys = np.arange(0, 120, 2)
            keys[-1] = 119
            bounds = Bounds(motion - 2.5, motion + 2.5, keys, 1, 3, motion, jump)
            changes, moved = np.diff(find_path(bounds)), np.diff(motion[keys])
            count += int((np.abs(changes) > np.abs(moved) + 1).sum())
        jerks.append(count)
    assert jerks[1] < 0.2 * jerks[0]


def test_short_paths_are_nearly_the_cheapest_of_all() -> None:
    for seed in range(30):
        rng = np.random.default_rng(seed)
        low = rng.integers(-2, 3, 6).astype(float)
        bounds = Bounds(low, low + rng.integers(0, 3, 6), np.arange(6), 1, 20)
        ways = product(*(range(int(a), int(b) + 1) for a, b in zip(low, bounds.upper, strict=True)))
        least = min(level_bits(np.array(one), 20) for one in ways)
        assert level_bits(find_path(bounds), 20) <= least + 4


def test_a_parameter_that_may_rest_at_0_is_not_sent() -> None:
    rng = np.random.default_rng(1)
    motion = rng.normal(0, 2, 50)
    bounds = Bounds(motion - 10, motion + 10, np.arange(50), 2, 1)
    assert not find_path(bounds).any()


def test_one_frame_and_bounds_without_a_level() -> None:
    one = Bounds(np.array([4.0]), np.array([9.0]), np.array([0]), 3, 1)
    assert find_path(one).tolist() == [2]
    between = Bounds(np.array([1.0, 4.0]), np.array([2.0, 4.9]), np.array([0, 1]), 3, 1)
    assert find_path(between).tolist() == [0, 1]  # 0.5 and 1.48 steps: the nearest
    assert find_path(Bounds(np.array([1.2]), np.array([2.9]), np.array([0]), 3, 1)).tolist() == [1]


def test_bits_of_levels_are_those_of_the_coder() -> None:
    rng = np.random.default_rng(5)
    walks = np.cumsum(rng.integers(-2, 3, (500, 8)), axis=0)
    values = np.zeros((500, 68), dtype=np.int32)
    values[:, 30:38] = walks * 2 * 3  # eyebrows and cheeks: steps of 2
    face = FaceTrack(values, np.tile(values.any(axis=0), (500, 1)))
    length = len(fba.encode(Animation(25, np.arange(500), face), EncoderOptions(fap_quant=3)))
    estimated = sum(level_bits(walks[:, one].copy(), 3) for one in range(8)) / 8 + 499 * 6 / 8
    assert length == pytest.approx(estimated, rel=0.02)
