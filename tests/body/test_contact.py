"""Hands are kept outside the body where it is shown, smoothly; how far two motions of a body are apart."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import figures
from fba.arrays import Float64
from fba.body import BapSolver, BodyModel, GroundedPoser, Skeleton
from fba.body.contact import Contact, find_contact
from fba.body.displacement import displacements
from fba.body.stance import find_standing, sole_points
from fba.parameters import BAP_COUNT, bap_numbers
from small_bodies import rod
from tools.figure_checks import HAND_DEPTH, hand_depths

INWARDS = {"l_shoulder_abduct": -20, "r_shoulder_abduct": 20}
CHEST = {"l_shoulder_flexion": 10, "l_elbow_flexion": 100, "l_shoulder_twisting": 75}
SITTING = {
    f"{side}_{name}": angle
    for side in "lr"
    for name, angle in (
        ("hip_flexion", 90),
        ("knee_flexion", -90),
        ("shoulder_flexion", 5),
        ("elbow_flexion", 30),
    )
}
"""Degrees of BAPs."""
CLIPS = (("greta/Dance.bvh", 60), ("greta/GangnamStyle.bvh", 95), ("greta/strong_gesture.bvh", 100),
         ("greta/c-Walkaround.bvh", 60), ("vreng/clap.bap", 6))  # fmt: skip
"""Recordings, and of how many frames one is looked at."""


def angles(degrees: dict[str, float]) -> Float64:
    values = np.zeros(BAP_COUNT)
    for name, angle in degrees.items():
        values[bap_numbers()[name] - 1] = np.radians(angle) * 1e5
    return values


@pytest.fixture(scope="module")
def body() -> BodyModel:
    return BodyModel.default()


@pytest.fixture(scope="module")
def contact(body: BodyModel) -> Contact:
    found = find_contact(body)
    assert found is not None
    return found


@pytest.mark.parametrize("name", figures.FIGURES)
def test_at_rest_hands_are_outside_without_help(name: str) -> None:
    figure = figures.body(name)
    assert hand_depths(figure, BapSolver(figure.skeleton).pose(np.zeros(BAP_COUNT)))[0] == 0


@pytest.mark.parametrize("degrees", [INWARDS, CHEST, SITTING])
def test_hands_come_out_and_nothing_else_moves(
    body: BodyModel, contact: Contact, degrees: dict[str, float]
) -> None:
    joints = BapSolver(body.skeleton).pose(angles(degrees))
    kept = joints.copy()
    turns = contact.keep_apart(kept)
    assert contact.depths(joints).max() > 0.001
    assert contact.depths(kept).max() < HAND_DEPTH
    assert np.linalg.norm(turns, axis=2).max() < np.radians(45)
    arms = [body.skeleton.descendants(body.skeleton.number(f"{side}_shoulder")) for side in "lr"]
    others = np.setdiff1d(np.arange(len(joints)), np.concatenate(arms))
    np.testing.assert_array_equal(kept[others], joints[others])
    turned = kept[:, :3, :3]
    np.testing.assert_allclose(
        turned @ turned.transpose(0, 2, 1), np.tile(np.eye(3), (len(kept), 1, 1)), atol=1e-9
    )


def test_arms_that_touch_nothing_are_not_moved(body: BodyModel, contact: Contact) -> None:
    joints = BapSolver(body.skeleton).pose(angles({"l_shoulder_abduct": 60, "r_shoulder_abduct": -60}))
    kept = joints.copy()
    assert not contact.keep_apart(kept).any()
    np.testing.assert_array_equal(kept, joints)


@pytest.mark.filterwarnings("ignore::fba.errors.FbaWarning")
def test_hands_stay_outside_in_recordings(shared: Path, body: BodyModel, contact: Contact) -> None:
    poser = GroundedPoser(body.skeleton)
    before, after = 0.0, 0.0
    for name, every in CLIPS:
        track = fba.read(shared / "data" / name).body
        for joints in poser.pose(track.values[::every]):
            before = max(before, hand_depths(body, joints)[0])
            contact.keep_apart(joints)
            after = max(after, hand_depths(body, joints)[0])
    assert before > 0.02
    assert after < HAND_DEPTH


@pytest.mark.parametrize(("abducted", "largest"), [(-8, 3), (-13, 5), (-16, 7), (-19, 9)])
def test_a_smooth_motion_stays_smooth(
    body: BodyModel, contact: Contact, abducted: float, largest: float
) -> None:
    """An arm brushes the thigh or goes through it: degrees by which a correction changes in 0.7 degrees."""
    back, ahead = (angles({"l_shoulder_abduct": abducted, "l_shoulder_flexion": at}) for at in (-40, 45))
    swing = np.linspace(back, ahead, 120)
    turns = np.array([contact.keep_apart(joints) for joints in BapSolver(body.skeleton).pose(swing)])
    assert turns.any()
    assert np.degrees(np.linalg.norm(np.diff(turns, axis=0), axis=3)).max() < largest


def test_bodies_without_hands_or_legs_have_no_contact(body: BodyModel) -> None:
    assert find_contact(rod()) is None
    names = tuple(name.replace("_wrist", "_end") for name in body.skeleton.names)
    handless = replace(body, skeleton=Skeleton(names, body.skeleton.parents, body.skeleton.centres))
    assert find_contact(handless) is None
    one = tuple(name.replace("r_wrist", "r_end") for name in body.skeleton.names)
    armed = find_contact(replace(body, skeleton=Skeleton(one, body.skeleton.parents, body.skeleton.centres)))
    assert len(armed.arms) == 1


def test_other_shapes_are_named_and_numbers_that_are_none_harm_nothing(contact: Contact) -> None:
    with pytest.raises(ValueError, match=r"shape \(87, 4, 4\), not \(3, 4, 4\)"):
        contact.keep_apart(np.zeros((3, 4, 4)))
    for value in (np.nan, np.inf, 1e300):
        contact.keep_apart(np.full((contact.joints, 4, 4), value))
    random = np.random.default_rng(5)
    for _ in range(50):
        contact.keep_apart(random.normal(scale=0.3, size=(contact.joints, 4, 4)))


SKELETON = Skeleton.default()


def still(count: int = 30, **baps: float) -> np.ndarray:
    """BAPs (count, 296) of a body that does not move."""
    result = np.zeros((count, BAP_COUNT))
    for name, value in baps.items():
        result[:, bap_numbers()[name] - 1] = value
    return result


def test_a_way_of_the_root_moves_every_joint_in_the_world_and_none_as_seen_from_the_root() -> None:
    moved = still(HumanoidRoot_tr_lateral=3, HumanoidRoot_tr_frontal=4)
    assert displacements(still(), moved, 25).joints == pytest.approx(0.005, abs=1e-9)
    assert displacements(still(), moved, 25, frame="root").joints == pytest.approx(0.0, abs=1e-9)


def test_a_turned_elbow_moves_points_below_it_along_chords() -> None:
    """Points 3 cm along the axis of the turn and across it; the shoulder above it stays."""
    apart = displacements(still(), still(l_elbow_flexion=20_000), 25).joints[0]  # 0.2 rad about x
    elbow, wrist = (SKELETON.centres[SKELETON.number(name)] for name in ("l_elbow", "l_wrist"))
    chord = 2 * math.sin(0.1)
    farthest = max(math.hypot(*(wrist - elbow + 0.03 * axis)[1:]) for axis in np.eye(3))
    assert apart[SKELETON.number("l_wrist")] == pytest.approx(chord * farthest, rel=1e-6)
    assert apart[SKELETON.number("l_elbow")] == pytest.approx(
        chord * 0.03, rel=1e-6
    )  # 3 cm, as others measure
    assert apart[SKELETON.number("l_shoulder")] == 0.0


def test_soles_count_while_they_stand() -> None:
    """The right foot stands; the left knee is drawn up, by a hip that is bent."""
    source = still(l_hip_flexion=-120_000, l_knee_flexion=-120_000)
    off = source.copy()
    off[:, bap_numbers()["HumanoidRoot_tr_vertical"] - 1] += 4
    feet = displacements(source, off, 25).feet
    assert feet[:, 0] == pytest.approx(0.0, abs=0.0)
    assert feet[:, 1] == pytest.approx(0.004, abs=1e-9)


def test_a_turned_ankle_moves_the_heel_of_a_foot_that_stands() -> None:
    turned = displacements(still(), still(r_subtalar_flexion=5_000), 25).feet[0, 1]
    sole = sole_points(SKELETON, "r")
    centre = SKELETON.centres[SKELETON.number("r_subtalar")]
    reach = max(math.hypot(*(point - centre)[:2]) for point in sole.values())  # it turns about z
    assert turned == pytest.approx(2 * math.sin(0.025) * reach, rel=1e-6)


def test_feet_do_not_stand_in_the_air_or_in_a_single_frame() -> None:
    points = np.zeros((2, 2, 20, 3))
    assert find_standing(np.zeros((2, 20)), points, 25.0).all()
    assert not find_standing(np.full((2, 20), 0.2), points, 25.0).any()
    assert not find_standing(np.zeros((2, 1)), points[:, :, :1], 25.0).any()
    still_single = displacements(still(1), still(1, HumanoidRoot_tr_vertical=4), 25)
    assert still_single.feet.tolist() == [[0.0, 0.0]]


def test_shares_within_a_limit() -> None:
    moved = still(10)
    moved[:5, bap_numbers()["HumanoidRoot_tr_vertical"] - 1] = 4
    apart = displacements(still(10), moved, 25)
    assert (apart.share_within(0.0039), apart.share_within(0.0041)) == (0.5, 1.0)


def test_motions_of_other_lengths_are_not_compared() -> None:
    with pytest.raises(ValueError, match="the source has 3 frames, what is shown 4"):
        displacements(still(3), still(4), 25)
