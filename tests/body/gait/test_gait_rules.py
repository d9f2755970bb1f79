"""Decision constants of the detection of steps: each has a test here that dies with it."""

from dataclasses import replace

import numpy as np
import pytest

from fba import Animation, BodyTrack
from fba.body import gait
from fba.body.gait import _detection as detection
from fba.body.gait._detection import Curves

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
    assert walk.body is not None
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
