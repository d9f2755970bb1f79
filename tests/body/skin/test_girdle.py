"""Skin of the shoulders that goes with the arms: against turns worked out by scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fba.body import BapSolver, BodyModel, BodyPart, Skeleton
from fba.parameters import baps
from small_bodies import Float64

SHARE = 0.16
"""As docs/body-models.md says."""
JOINTS = ("trunk", "?_sternoclavicular", "?_acromioclavicular", "?_shoulder", "?_elbow")
PLACES = np.array([(0, 1.2, 0), (0.02, 1.42, 0), (0.13, 1.41, 0), (0.18, 1.40, 0), (0.18, 1.12, 0)], float)
TRUNK, COLLAR, BLADE, SHOULDER, ELBOW = range(5)
UP = np.array([0, 0.05, 0])


def half(side: str) -> BodyModel:
    """One side of a trunk, a vertex on every joint, 5 cm above it."""
    sign = np.array([1.0 if side == "l" else -1.0, 1, 1])
    names = tuple(name.replace("?", side) for name in JOINTS)
    places = PLACES * sign
    bind = np.tile(np.eye(4), (5, 1, 1))
    bind[:, :3, 3] = places
    joints = np.zeros((5, 4), dtype=np.int32)
    joints[:, 0] = np.arange(5)
    part = BodyPart("dots", "skin", places + UP, [[0, 1, 2], [2, 3, 4]], joints,
                    np.tile([1.0, 0, 0, 0], (5, 1)))  # fmt: skip
    return BodyModel((part,), Skeleton(names, np.array([-1, 0, 1, 2, 3]), places), bind)


def posed(body: BodyModel, turns: dict[int, Rotation]) -> Float64:
    """Joint matrices with some joints turned, each relative to its parent."""
    result = np.tile(np.eye(4), (5, 1, 1))
    for joint in range(5):
        step = np.eye(4)
        above = body.skeleton.parents[joint]
        step[:3, 3] = body.bind[joint, :3, 3] - (body.bind[above, :3, 3] if joint else 0)
        if joint in turns:
            step[:3, :3] = turns[joint].as_matrix()
        result[joint] = step if not joint else result[above] @ step
    return result


def about(place: Float64, turn: Rotation, point: Float64) -> Float64:
    return turn.apply(point - place) + place


@pytest.mark.parametrize(("side", "sign"), [("l", 1), ("r", -1)])
@pytest.mark.parametrize("angle", [-30.0, 40.0, 90.0, 140.0])
def test_a_lifted_arm_turns_blade_and_collar_bone(side: str, sign: int, angle: float) -> None:
    body = half(side)
    lift = Rotation.from_euler("z", sign * angle, degrees=True)  # sideways, then up
    found = body.skin(posed(body, {SHOULDER: lift}))
    dots, joint = body.vertices.astype(np.float64), body.bind[:, :3, 3]
    part, less = (Rotation.from_euler("z", sign * angle * s, degrees=True) for s in (SHARE, SHARE / 2))
    expected = np.array([
        dots[TRUNK],
        about(joint[COLLAR], less, dots[COLLAR]),
        about(joint[COLLAR], part, dots[BLADE]),
        about(joint[SHOULDER], lift, dots[SHOULDER]),
        about(joint[SHOULDER], lift, dots[ELBOW]),
    ])  # fmt: skip
    np.testing.assert_allclose(found, expected, atol=2e-6)


def test_forwards_too() -> None:
    body = half("l")
    reach = Rotation.from_euler("x", -90, degrees=True)
    found = body.skin(posed(body, {SHOULDER: reach}))
    part = Rotation.from_euler("x", -90 * SHARE, degrees=True)
    expected = about(body.bind[COLLAR, :3, 3], part, body.vertices[BLADE].astype(np.float64))
    np.testing.assert_allclose(found[BLADE], expected, atol=2e-6)


def test_a_turn_of_the_arm_about_itself_lifts_nothing() -> None:
    body = half("l")
    found = body.skin(posed(body, {SHOULDER: Rotation.from_euler("y", 80, degrees=True)}))
    np.testing.assert_allclose(found[[COLLAR, BLADE]], body.vertices[[COLLAR, BLADE]], atol=1e-6)


def test_what_the_girdle_does_itself_counts() -> None:
    """Lifted by as much as the arm would take it, or more, it stays where it was put; lifted by less, the
    rest is added."""
    body = half("l")
    place, dot = body.bind[COLLAR, :3, 3], body.vertices[BLADE].astype(np.float64)
    for own, whole in ((40.0, 40.0), (20.0, 20.0), (5.0, SHARE * 95), (-10.0, SHARE * 80 - 10)):
        turns = {n: Rotation.from_euler("z", a, degrees=True) for n, a in ((COLLAR, own), (SHOULDER, 90.0))}
        found = body.skin(posed(body, turns))[BLADE]
        expected = about(place, Rotation.from_euler("z", whole, degrees=True), dot)
        np.testing.assert_allclose(found, expected, atol=3e-6, err_msg=str(own))


def test_not_for_linear_blending() -> None:
    body = half("l")
    lifted = posed(body, {SHOULDER: Rotation.from_euler("z", 90, degrees=True)})
    found = body.skin(lifted, method="linear")
    np.testing.assert_allclose(found[BLADE], body.vertices[BLADE], atol=1e-6)


def test_no_jump_where_there_is_no_one_way() -> None:
    """An arm that swings all the way round, past where it points straight away from how it was modelled."""
    body = half("l")
    frames = [
        posed(body, {SHOULDER: Rotation.from_euler("xz", (4, a), degrees=True)}) for a in range(150, 211)
    ]
    blade = body.skin(np.array(frames))[:, BLADE]
    assert np.linalg.norm(np.diff(blade, axis=0), axis=1).max() < 4e-3


def test_the_built_in_person_has_no_notch_with_raised_arms() -> None:
    """The outline from neck to arm hardly falls; where nothing went with the arm it fell by 27 mm."""
    body = BodyModel.default()
    number = {bap.name: bap.number for bap in baps()}
    values = np.zeros(296)
    values[number["l_shoulder_abduct"] - 1] = np.radians(150) * 1e5
    moved = body.skin(BapSolver(body.skeleton).pose(values))
    shirt = body.part("shirt")
    at = moved[body.starts["shirt"] :][: len(shirt.vertices)]
    tops = []
    for x in np.arange(0.09, 0.20, 0.01):
        near = (np.abs(at[:, 0] - x) < 0.012) & (np.abs(at[:, 2] + 0.06) < 0.05)
        tops.append(at[near, 1].max())
    fall = np.maximum.accumulate(tops) - tops
    assert fall.max() < 0.015


def test_sleeves_fall_straight_where_arms_hang() -> None:
    """From where they are widest to the hem they draw in by 3 mm; they looked puffed where that was 9 mm."""
    body = BodyModel.default()
    shirt = body.skin(BapSolver(body.skeleton).pose(np.zeros(296)))[body.starts["shirt"] :]
    shirt = shirt[: len(body.part("shirt").vertices)]
    heights = np.arange(1.24, 1.38, 0.02)
    wide = [shirt[np.abs(shirt[:, 1] - height) < 0.012, 0].max() for height in heights]
    assert max(wide) - wide[0] < 0.005


def test_an_armpit_is_stretched_straight() -> None:
    """Between ribs and arm, 10 cm below the shoulder: seven tenths of the way from the arc to the chord."""
    whole = half("l")
    dots = whole.parts[0]
    vertices, joints, weights = dots.vertices.copy(), dots.joints.copy(), dots.weights.copy()
    vertices[TRUNK] = whole.bind[SHOULDER, :3, 3] - (0, 0.1, 0)
    joints[TRUNK] = (TRUNK, SHOULDER, 0, 0)
    weights[TRUNK] = (0.5, 0.5, 0, 0)
    part = BodyPart("dots", "skin", vertices, dots.triangles, joints, weights)
    body = BodyModel((part,), whole.skeleton, whole.bind)
    shoulder, dot = body.bind[SHOULDER, :3, 3], vertices[TRUNK].astype(np.float64)
    full, halfway = (Rotation.from_euler("z", angle, degrees=True) for angle in (120, 60))
    arc, chord = about(shoulder, halfway, dot), (dot + about(shoulder, full, dot)) / 2
    found = body.skin(posed(body, {SHOULDER: full}))[TRUNK]
    np.testing.assert_allclose(found, 0.3 * arc + 0.7 * chord, atol=2e-6)
