"""Walks beside measured people: winter_natural_cadence.csv says where its figures come from."""

import csv
from pathlib import Path

import numpy as np
import pytest

from fba.body import BapSolver, Skeleton, gait

MEASURED = Path(__file__).with_name("winter_natural_cadence.csv")


def degrees(bone: np.ndarray) -> np.ndarray:
    """Forward angle of a hanging bone (T, 3) against the vertical."""
    return np.degrees(np.arctan2(bone[:, 2], -bone[:, 1]))


def test_a_normal_walk_is_like_that_of_people() -> None:
    """Hip and knee stay within 1.1 standard deviations of the means, the ankle within 1 for 86 % of the time.

    Angles between the centres of the joints of the right leg, in the sagittal plane.
    """
    _, apart = deviations_of_normal_walk()
    for deviations, share, most in zip(np.abs(apart), (0.96, 0.98, 0.86), (1.1, 1.1, 1.5), strict=True):
        assert deviations.max() < most
        assert (deviations <= 1.0).mean() >= share


def deviations_of_normal_walk() -> tuple[np.ndarray, np.ndarray]:
    """Winter's table (51, 7), and how many deviations hip, knee and ankle are from its means (3, 51)."""
    lines = [line for line in MEASURED.read_text(encoding="utf-8").splitlines() if line[0] != "#"]
    table = np.array(list(csv.reader(lines))[1:], dtype=np.float64)
    walk = gait.walk(cycles=1, rate=60)
    solver, skeleton = BapSolver(), Skeleton.default()
    matrices = solver.pose(np.vstack([walk.body.values, np.zeros((1, 296), dtype=np.int32)]))
    hip, knee, ankle = (matrices[:, skeleton.number(f"r_{name}"), :3, 3] for name in ("hip", "knee", "ankle"))
    toes = matrices[:, skeleton.number("r_subtalar"), :3, 2]
    thigh, shank = degrees(knee - hip), degrees(ankle - knee)
    foot = np.degrees(np.arctan2(toes[:, 1], toes[:, 2])) - shank
    percent = np.linspace(0, 100, len(walk))
    ours = (thigh[:-1], (thigh - shank)[:-1], (foot - foot[-1])[:-1])
    apart = [
        (np.interp(table[:, 0], percent, values) - table[:, column]) / table[:, column + 3]
        for column, values in enumerate(ours, 1)
    ]
    return table, np.array(apart)


def test_a_leg_that_swings_is_within_one_deviation() -> None:
    """From the phase at which its toes have left the ground on; hip, knee and ankle."""
    table, apart = deviations_of_normal_walk()
    assert np.abs(apart[:, table[:, 0] > 65]).max() < 1.0


def test_the_pelvis_is_lowest_on_two_feet_and_highest_on_one() -> None:
    """The second half of the cycle repeats the first; the other foot stands until 7 % of it and from 50 %."""
    walk = gait.walk(cycles=1, rate=60)
    height = walk.body.values[:32, 180]
    assert 0 <= np.argmin(height) <= 4
    assert 16 <= np.argmax(height) <= 24
    assert np.diff(height[4:20]).min() >= -2


@pytest.mark.parametrize(("character", "low", "high"), [("normal", 4.0, 5.0), ("bored", 2.0, 3.0)])
def test_the_pelvis_rises_and_falls(character: str, low: float, high: float) -> None:
    """Centimetres: 4 to 5 at 1.3 m/s, less at 0.8 m/s."""
    walk = gait.walk(character=character, cycles=1, rate=60)
    assert low <= np.ptp(walk.body.values[:, 180]) / 10 <= high


def test_a_sneaking_foot_lands_softly() -> None:
    """Its knee slows down by at most 12 mm a frame, at 30 frames/s, when the foot touches the ground."""
    walk = gait.walk(character="sneaking", cycles=2)
    knee = BapSolver().pose(walk.body.values)[:, Skeleton.default().number("r_knee"), :3, 3]
    change = 1000 * np.linalg.norm(np.diff(knee, 2, axis=0), axis=1)
    assert change[50:62].max() < 12  # about frame 56, the contact


def test_whole_numbers_are_degrees_too() -> None:
    """An edited character may have nothing but integers in its poses."""
    edited = gait.Character.named("normal")
    for (pose, leg), given in gait.Character.named("normal").poses.items():
        edited = edited.edited(pose, leg, knee=round(given.knee), foot=round(given.foot))
    assert len(gait.walk(character=edited, cycles=1)) == 33
