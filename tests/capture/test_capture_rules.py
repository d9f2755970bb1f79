"""Decision constants and rules of capture: each has a test here that dies with it (see tools/mutate.py)."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fba.body import BapSolver
from fba.capture import matching, retarget
from fba.capture.limbs.foot_planting import turn_foot
from fba.capture.limbs.targets import Targets
from fba.capture.motion import SkeletonMotion
from fba.errors import ModelError

NAMES = ["HumanoidRoot", "l_hip", "l_knee", "r_hip", "r_knee"]


def test_five_names_make_a_family() -> None:
    family, mapped = matching.match(NAMES)
    assert family == "h-anim"
    assert mapped == {name: number for number, name in enumerate(NAMES)}
    with pytest.raises(ModelError, match="no known skeleton family"):
        matching.match(NAMES[:4])


def test_of_two_joints_with_one_name_the_first_counts() -> None:
    assert matching.match([*NAMES, "l_hip"])[1]["l_hip"] == 1


def test_a_prefix_of_half_of_the_names_is_left_out() -> None:
    others = [f"zz{letter}" for letter in "abcde"]
    _, mapped = matching.match([*(f"Bob_{name}" for name in NAMES), *others])
    assert mapped == {name: number for number, name in enumerate(NAMES)}


def targets(**joints: np.ndarray) -> Targets:
    """Targets of these joints' rotations (T, 3, 3), of a source that stands still."""
    count = len(next(iter(joints.values())))
    still = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1, 1))
    motion = SkeletonMotion(
        ("root",), np.array([-1]), np.zeros((1, 3)), still, np.zeros((count, 3)), Fraction(25)
    )
    aims = {"l_ankle": "l_metatarsal", "l_sternoclavicular": "l_shoulder"}
    return Targets(
        BapSolver(), motion, {"l_wrist": 0}, aims, np.eye(3), still, np.zeros((count, 1, 3)), joints, {}
    )


def test_a_foot_points_where_it_is_to_within_a_thousandth_of_a_degree() -> None:
    angles = [[0.5, 0.3, 0.2], [-0.4, -0.3, 0.5], [0.3, 0.6, -0.4]]
    foot = Rotation.from_euler("ZYX", angles).as_matrix()
    body = targets(l_ankle=foot)
    body.feet["l"] = foot
    turn_foot(body, "l")
    centres, number = body.skeleton.centres, body.skeleton.number
    heel = centres[number("l_subtalar")] - centres[number("l_ankle")]
    sole = centres[number("l_metatarsal")] - centres[number("l_subtalar")]
    bone = body.rotations["l_ankle"] @ heel + body.rotations["l_subtalar"] @ sole
    wanted = foot @ (heel + sole)
    sines = np.linalg.norm(np.cross(bone, wanted), axis=1) / np.linalg.norm(bone, axis=1)
    assert np.degrees(sines / np.linalg.norm(wanted, axis=1)).max() < 0.001


def test_the_forearm_takes_half_of_the_hands_twist() -> None:
    body = targets(l_elbow=np.eye(3)[None], l_wrist=np.eye(3)[None])
    bone = body.bone("l_elbow", "l_wrist")
    body.rotations["l_wrist"] = Rotation.from_rotvec(0.8 * bone[None]).as_matrix()
    retarget._twist_forearm(body, "l")
    turned = Rotation.from_matrix(body.rotations["l_elbow"]).as_rotvec()[0]
    assert turned == pytest.approx(0.4 * bone, abs=1e-9)


def test_both_joints_of_the_clavicle_take_half_of_its_turn() -> None:
    turn = Rotation.from_euler("Z", [[0.2]]).as_matrix()
    body = targets(l_sternoclavicular=turn)
    retarget._turn_clavicle(body, "l")
    inner = Rotation.from_matrix(body.rotations["l_sternoclavicular"]).magnitude()[0]
    whole = Rotation.from_matrix(body.rotations["l_acromioclavicular"]).magnitude()[0]
    assert inner == pytest.approx(whole / 2, rel=0.15)


def test_a_prefix_is_one_of_the_first_eight_names() -> None:
    """As of "Bip01", "Bip01 Pelvis": joints repeat the name of the rig, which stands near the beginning."""
    others = [f"camera{number}" for number in range(7)]
    joints = [f"Bob{name}" for name in [*NAMES, "l_shoulder", "l_elbow", "r_shoulder", "r_elbow"]]
    assert matching.match([*others, "Bob", *joints])[1]["l_hip"] == 9
    with pytest.raises(ModelError, match="no known skeleton family"):
        matching.match([*others, "camera7", "Bob", *joints])
