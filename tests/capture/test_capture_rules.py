"""Decision constants and rules of capture: each has a test here that dies with it.

Retargeting without machine code: the same BAPs, slower.
"""

import json
import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_bodies import swinging_limbs
from fba.body import BapSolver, Skeleton, ground
from fba.capture import from_skeleton
from fba.capture._limbs import foot_planting, hinges, soles, turning
from fba.capture._limbs._coupled_paths import chain
from fba.capture._limbs.foot_planting import turn_foot
from fba.capture._limbs.targets import Targets
from fba.capture.bones import match
from fba.capture.motion import MappedMotion, SkeletonMotion
from fba.errors import ModelError

HELPERS = Path(__file__).parents[1] / "helpers" / "figures"
SCRIPT = """
import json
from capture_bodies import swinging_limbs
from fba import compiled
from fba.capture import from_skeleton

print(json.dumps([compiled.is_compiled(), from_skeleton(swinging_limbs()).body.values.tolist()]))
"""
NAMES = ["HumanoidRoot", "l_hip", "l_knee", "r_hip", "r_knee"]


def test_five_names_make_a_family() -> None:
    family, mapped = match(NAMES)
    assert family == "h-anim"
    assert mapped == {name: number for number, name in enumerate(NAMES)}
    with pytest.raises(ModelError, match="no known skeleton family"):
        match(NAMES[:4])


def test_of_two_joints_with_one_name_the_first_counts() -> None:
    assert match([*NAMES, "l_hip"])[1]["l_hip"] == 1


def test_a_prefix_of_half_of_the_names_is_left_out() -> None:
    others = [f"zz{letter}" for letter in "abcde"]
    _, mapped = match([*(f"Bob_{name}" for name in NAMES), *others])
    assert mapped == {name: number for number, name in enumerate(NAMES)}


def targets(**joints: np.ndarray) -> Targets:
    """Targets of these joints' rotations (T, 3, 3), of a source that stands still."""
    count = len(next(iter(joints.values())))
    still = np.tile([1.0, 0.0, 0.0, 0.0], (count, 1, 1))
    motion = SkeletonMotion(
        ("root",), np.array([-1]), np.zeros((1, 3)), still, np.zeros((count, 3)), Fraction(25)
    )
    aims = {"l_ankle": "l_metatarsal", "l_sternoclavicular": "l_shoulder"}
    return Targets(BapSolver(), MappedMotion(motion, {"l_wrist": 0}), aims, joints, {})


def test_a_foot_points_in_its_target_direction() -> None:
    angles = [[0.5, 0.3, 0.2], [-0.4, -0.3, 0.5], [0.3, 0.6, -0.4]]
    foot = Rotation.from_euler("ZYX", angles).as_matrix()
    body = targets(l_ankle=foot)
    body.feet["l"] = foot
    turn_foot(body, "l")
    heel, sole = body.skeleton.bone("l_ankle", "l_subtalar"), body.skeleton.bone("l_subtalar", "l_metatarsal")
    bone = body.rotations["l_ankle"] @ heel + body.rotations["l_subtalar"] @ sole
    wanted = foot @ (heel + sole)
    sines = np.linalg.norm(np.cross(bone, wanted), axis=1) / np.linalg.norm(bone, axis=1)
    assert np.degrees(sines / np.linalg.norm(wanted, axis=1)).max() < 0.001


def test_the_forearm_takes_half_of_the_hands_twist() -> None:
    body = targets(l_elbow=np.eye(3)[None], l_wrist=np.eye(3)[None])
    bone = body.bone("l_elbow", "l_wrist")
    body.rotations["l_wrist"] = Rotation.from_rotvec(0.8 * bone[None]).as_matrix()
    turning._twist_forearm(body, "l")
    turned = Rotation.from_matrix(body.rotations["l_elbow"]).as_rotvec()[0]
    assert turned == pytest.approx(0.4 * bone, abs=1e-9)


def test_a_forearm_does_not_flip_with_its_hand() -> None:
    """The hand turns over within a 25th of a second; the forearm takes its half at 10 rad/s."""
    body = targets(l_elbow=np.tile(np.eye(3), (40, 1, 1)), l_wrist=np.tile(np.eye(3), (40, 1, 1)))
    bone = body.bone("l_elbow", "l_wrist")
    twist = np.where(np.arange(40) < 20, 0.0, 3.0)
    body.rotations["l_wrist"] = Rotation.from_rotvec(twist[:, None] * bone).as_matrix()
    turning._twist_forearm(body, "l")
    turned = Rotation.from_matrix(body.rotations["l_elbow"]).as_rotvec() @ bone
    assert np.diff(turned).max() == pytest.approx(0.4, abs=1e-9)
    assert turned[[0, 15, 24, 39]] == pytest.approx([0.0, 0.0, 1.5, 1.5], abs=1e-9)


def test_both_joints_of_the_clavicle_take_half_of_its_turn() -> None:
    turn = Rotation.from_euler("Z", [[0.2]]).as_matrix()
    body = targets(l_sternoclavicular=turn)
    turning._turn_clavicle(body, "l")
    inner = Rotation.from_matrix(body.rotations["l_sternoclavicular"]).magnitude()[0]
    whole = Rotation.from_matrix(body.rotations["l_acromioclavicular"]).magnitude()[0]
    assert inner == pytest.approx(whole / 2, rel=0.15)


def test_a_prefix_is_one_of_the_first_eight_names() -> None:
    """As of "Bip01", "Bip01 Pelvis": joints repeat the name of the rig, which stands near the beginning."""
    others = [f"camera{number}" for number in range(7)]
    joints = [f"Bob{name}" for name in [*NAMES, "l_shoulder", "l_elbow", "r_shoulder", "r_elbow"]]
    assert match([*others, "Bob", *joints])[1]["l_hip"] == 9
    with pytest.raises(ModelError, match="no known skeleton family"):
        match([*others, "camera7", "Bob", *joints])


def ground_under(heights: np.ndarray, along: np.ndarray) -> ground.Ground:
    """The ground found for a foot at these heights and positions along z, the other one 20 cm above."""
    points = np.stack([np.zeros_like(along), heights, along], axis=-1)
    feet = np.stack([points, points + np.array([0.0, 0.2, 0.0])])
    return ground.find(feet[..., 1], feet)


def test_the_ground_is_at_the_lowest_fifth_of_the_heights() -> None:
    """A fifth may be below it, by noise; the rest are steps."""
    assert ground_under(np.linspace(0, 0.1, 101), np.zeros(101)).height == pytest.approx(0.02)


@pytest.mark.parametrize(("height", "found"), [(0.14, 0.14), (0.16, 0.0), (-0.14, -0.14), (-0.96, -0.96)])
def test_feet_far_above_zero_are_on_no_ground(height: float, found: float) -> None:
    """A chair, or a leap that the capture begins in; below 0 there is nothing else to stand on."""
    assert ground_under(np.full(50, height), np.zeros(50)).height == pytest.approx(found)


@pytest.mark.parametrize(
    ("metres", "rise", "slopes"),
    [
        (4.0, 0.07, True),
        (4.0, 0.09, False),  # steeper than 8 %: stairs
        (1.1, 0.05, True),
        (0.9, 0.05, False),  # shorter than 1 m: not enough to tell
        (4.0, 0.005, True),  # 1.8 cm between most of the feet
        (4.0, 0.003, False),  # 1.1 cm: level but for errors
    ],
)
def test_ground_slopes_where_feet_walk_far_and_rise_little(metres: float, rise: float, slopes: bool) -> None:
    along = np.linspace(-metres / 2, metres / 2, 400)
    found = ground_under(rise * along, along).slope
    assert found[1] == (pytest.approx(rise, rel=0.3) if slopes else 0.0)


def test_on_tiptoe_the_tip_of_the_toes_is_lowest() -> None:
    """A foot that points straight down reaches 7 cm further than its ball."""
    skeleton = Skeleton.default()
    down = Rotation.from_euler("x", [90], degrees=True).as_matrix()
    joints = ("ankle", "subtalar", "midtarsal", "metatarsal")
    root = skeleton.centres[:1]
    found = soles.body_soles(skeleton, {f"l_{joint}": down for joint in joints}, root)
    ankle, ball = (skeleton.centres[skeleton.number(name)] for name in ("l_ankle", "l_metatarsal"))
    assert found.lowest[0] == pytest.approx(ankle[1] - (ball[2] - ankle[2]) - 0.0745)
    assert found.points[1, 0, 0] == pytest.approx(  # the right heel, flat on the ground
        skeleton.centres[skeleton.number("r_ankle")] * [1, 0, 1] - [0, 0, 0.045]
    )


@pytest.mark.parametrize(
    ("height", "lacking", "move"),
    [
        (0.012, 0.02, 0.017),  # on the ground: but for 3 mm
        (0.012, -0.02, -0.016),  # or 4 mm, which nobody sees
        (0.012, 0.0025, 0.0),
        (0.012, -0.0035, 0.0),
        (0.012, 0.2, 0.025),  # at most 2.5 cm up
        (0.012, -0.2, -0.03),  # and 3 cm down
        (0.06, 0.02, 0.0),  # in the air
    ],
)
def test_legs_move_feet_that_are_on_the_ground(height: float, lacking: float, move: float) -> None:
    above = np.full((2, 60), height)
    np.testing.assert_allclose(soles.heights(above, above - lacking, 60.0), move, atol=1e-4)


DOWN, ACROSS = np.array([0.0, -1.0, 0.0]), np.array([1.0, 0.0, 0.0])


def knee_angles(bends: np.ndarray, turn: float = 0.0) -> np.ndarray:
    """Angles (T, 2) that are found for a knee that bends by `bends`. turn: of the thigh about itself."""
    knee = hinges.Hinge(DOWN, DOWN, ACROSS, DOWN, 1.0)
    local = (Rotation.from_rotvec(turn * DOWN) * Rotation.from_rotvec(np.outer(bends, ACROSS))).as_matrix()
    return hinges.solve(knee, local @ DOWN, local, 25.0)


def test_a_clear_bend_shows_which_way_a_knee_bends() -> None:
    """Most of the time it is a little beyond straight, by noise; 0.35 rad in the end is clear enough."""
    bends = np.concatenate([np.full(400, -0.05), np.linspace(-0.05, 0.35, 10), np.full(8, 0.35)])
    angles = knee_angles(bends, turn=2.0)
    np.testing.assert_allclose(angles[:, 0], 2.0, atol=0.03)
    np.testing.assert_allclose(angles[:, 1], bends, atol=0.03)


def test_an_upper_arm_does_not_flip_where_a_straight_arm_is_jerked() -> None:
    """The forearm is bent by 0.2 rad, in one plane and, a 60th of a second later, in another one."""
    elbow = hinges.Hinge(DOWN, DOWN, ACROSS, DOWN, 1.0)
    plane = np.where(np.arange(120) < 60, 0.0, 1.4)
    axes = Rotation.from_rotvec(plane[:, None] * DOWN).apply(ACROSS)
    local = Rotation.from_rotvec(0.2 * axes).as_matrix()
    angles = hinges.solve(elbow, local @ DOWN, local, 60.0)
    assert np.abs(np.diff(angles[:, 0])).max() < 0.8
    np.testing.assert_allclose(angles[[0, -1], 0], [0.0, 1.4], atol=0.1)


def test_a_leg_makes_its_share_of_a_change_of_length() -> None:
    """To a fifth of a millimetre in 5 cm."""
    bends = np.radians([20.0, 30.0, 60.0, 90.0, 120.0])
    hip, knee = np.zeros((5, 3)), np.tile([0.0, -0.4, 0.0], (5, 1))
    shank = 0.4 * np.stack([0.0 * bends, -np.cos(bends), -np.sin(bends)], axis=1)
    leg = foot_planting.Leg(hip, knee, knee + shank, np.tile([1.0, 0.0, 0.0], (5, 1)))
    move = np.tile([0.0, 0.05, 0.0], (5, 1))
    thigh, lower = foot_planting.move_ankle(leg, move)
    moved = (thigh @ knee[..., None] + lower @ shank[..., None])[..., 0]
    length, wanted = (np.linalg.norm(end, axis=1) for end in (knee + shank, knee + shank + move))
    goal = length + foot_planting.length_share(leg) * (wanted - length)
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), goal, atol=2e-4)


def test_feet_far_from_a_slope_count_little() -> None:
    """Three frames of ten are steps, 10 cm up, in the farther half."""
    along = np.linspace(0, 4, 400)
    steps = (np.arange(400) % 10 < 3) & (along > 2)
    under = ground_under(0.04 * along + 0.1 * steps, along)
    assert under.slope[1] == pytest.approx(0.04, abs=1e-4)
    assert under.height == pytest.approx(0.0, abs=4e-4)
    assert ground_under(0.07 * along, along).slope[1] == pytest.approx(0.07, abs=3e-3)


@pytest.mark.parametrize("bend", [-0.15, -0.25])
def test_a_knee_that_is_overstretched_all_the_time_is_not_turned_round(bend: float) -> None:
    angles = knee_angles(np.full(60, bend))
    np.testing.assert_allclose(angles[:, 0], 0.0, atol=0.01)
    np.testing.assert_allclose(angles[:, 1], bend, atol=0.01)


def test_a_knee_that_is_clearly_bent_backwards_is_turned_round() -> None:
    angles = knee_angles(np.full(60, -0.5))
    np.testing.assert_allclose(np.abs(angles[:, 0]), np.pi, atol=0.02)
    np.testing.assert_allclose(angles[:, 1], 0.5, atol=0.02)


def test_a_knee_that_bends_back_far_and_long_turns_round_after_all() -> None:
    bends = np.concatenate([np.full(900, 0.5), np.linspace(0.5, -0.6, 25), np.full(750, -0.6)])
    angles = knee_angles(bends)
    np.testing.assert_allclose(np.cos(angles[[0, -1], 0]), [1.0, -1.0], atol=0.001)
    np.testing.assert_allclose(angles[[0, -1], 1], [0.5, 0.6], atol=0.02)


def test_the_same_baps_without_machine_code() -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", SCRIPT],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(HELPERS)},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    compiled, values = json.loads(done.stdout)
    assert compiled is False
    body = from_skeleton(swinging_limbs()).body
    np.testing.assert_allclose(values, body.values, atol=1)  # machine code may round differently


@pytest.mark.parametrize("count", [1, 2, 7])
def test_coupled_frames_by_linear_algebra(count: int) -> None:
    random = np.random.default_rng(count)
    own, pull, bonds = (
        random.uniform(0.1, 1, count),
        random.normal(size=count),
        random.uniform(0, 2, count - 1),
    )
    matrix = np.diag(own)
    for t, bond in enumerate(bonds):
        matrix[t : t + 2, t : t + 2] += bond * np.array([[1, -1], [-1, 1]])
    expected = np.linalg.solve(matrix, pull)
    course = np.zeros(count)
    chain(own, bonds, pull, course)
    np.testing.assert_allclose(course, expected, rtol=1e-9)
