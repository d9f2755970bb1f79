"""Walks beside measured people: winter_natural_cadence.csv says where its figures come from."""

from __future__ import annotations

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
    """Angles between the centres of the joints of the right leg, in the sagittal plane.

    The deviations of people from these means are in no public source that was found, so the bounds are those
    that the walk keeps: 5, 7 and 4 degrees on average.
    """
    lines = [line for line in MEASURED.read_text(encoding="utf-8").splitlines() if line[0] != "#"]
    table = np.array(list(csv.reader(lines))[1:], dtype=np.float64)
    walk = gait.walk(cycles=1, rate=60)
    assert walk.body is not None
    solver, skeleton = BapSolver(), Skeleton.default()
    matrices = solver.pose(np.vstack([walk.body.values, np.zeros((1, 296), dtype=np.int32)]))
    hip, knee, ankle = (matrices[:, skeleton.number(f"r_{name}"), :3, 3] for name in ("hip", "knee", "ankle"))
    toes = matrices[:, skeleton.number("r_subtalar"), :3, 2]
    thigh, shank = degrees(knee - hip), degrees(ankle - knee)
    foot = np.degrees(np.arctan2(toes[:, 1], toes[:, 2])) - shank
    percent = np.linspace(0, 100, len(walk))
    for ours, theirs, bound in (
        (thigh[:-1], table[:, 1], 5.0),
        ((thigh - shank)[:-1], table[:, 2], 7.0),
        ((foot - foot[-1])[:-1], table[:, 3], 4.0),
    ):
        apart = ours - np.interp(percent, table[:, 0], theirs)
        assert np.sqrt((apart**2).mean()) < bound
        assert np.abs(apart).max() < 2.1 * bound


@pytest.mark.parametrize(("character", "low", "high"), [("normal", 4.0, 5.0), ("bored", 2.0, 3.0)])
def test_the_pelvis_rises_and_falls(character: str, low: float, high: float) -> None:
    """Centimetres: 4 to 5 at 1.3 m/s, less at 0.8 m/s."""
    walk = gait.walk(character=character, cycles=1, rate=60)
    assert walk.body is not None
    assert low <= np.ptp(walk.body.values[:, 180]) / 10 <= high


def test_a_sneaking_foot_lands_softly() -> None:
    """Its knee slows down by at most 18 mm a frame, at 30 frames/s, when the foot touches the ground."""
    walk = gait.walk(character="sneaking", cycles=2)
    assert walk.body is not None
    knee = BapSolver().pose(walk.body.values)[:, Skeleton.default().number("r_knee"), :3, 3]
    change = 1000 * np.linalg.norm(np.diff(knee, 2, axis=0), axis=1)
    assert change[55] < 18  # about frame 56, the contact


def test_whole_numbers_are_degrees_too() -> None:
    """An edited character may have nothing but integers in its poses."""
    edited = gait.Character.named("normal")
    for (pose, leg), given in gait.Character.named("normal").poses.items():
        edited = edited.edited(pose, leg, knee=round(given.knee), foot=round(given.foot))
    assert len(gait.walk(character=edited, cycles=1)) == 33
