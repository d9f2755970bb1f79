"""Limbs that are almost straight do not spin about themselves: no jumps that the source does not make."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_from_skeleton import NAMES, REAL

from capture_bodies import bone_errors, limb_bones, motion
from fba.body import BapSolver, Skeleton
from fba.capture import SkeletonMotion, from_skeleton
from fba.capture.bones import match
from fba.formats.bvh import _reader as reader

HINGED = ("shoulder", "elbow", "hip", "knee")


def steps(matrices: np.ndarray, parent: np.ndarray | None = None) -> np.ndarray:
    """Degrees (T - 1,) that rotations (T, 3, 3) turn by from frame to frame, relative to a parent's."""
    own = Rotation.from_matrix(matrices)
    if parent is not None:
        own = Rotation.from_matrix(parent).inv() * own
    result: np.ndarray = np.degrees((own[:-1].inv() * own[1:]).magnitude())
    return result


def joint_steps(captured: SkeletonMotion) -> dict[str, np.ndarray]:
    skeleton = Skeleton.default()
    matrices = BapSolver().pose(from_skeleton(captured).body.values)[:, :, :3, :3]
    return {
        name: steps(matrices[:, number], matrices[:, skeleton.parents[number]] if number else None)
        for number, name in enumerate(skeleton.names)
    }


def test_shank_that_circles_about_straight() -> None:
    """The shank points 3 degrees off the thigh's line, to all sides in turn, twice a second: the plane of the
    knee turns twice round a second, 12 degrees a frame, but nobody would see it, and the thigh does not."""
    count, tilt = 120, np.radians(3.0)
    round_ = np.linspace(0, 8 * np.pi, count)
    leg = Rotation.from_rotvec(tilt * np.stack([np.cos(round_), 0 * round_, np.sin(round_)], axis=1))
    captured = motion("standing", count, turns={"LeftLeg": leg}, rate=60)
    found = joint_steps(captured)
    assert steps(leg.as_matrix()).max() == pytest.approx(0.63, abs=0.02)
    for name in ("l_hip", "l_knee", "l_ankle"):
        assert found[name].max() < 2.0, name
    errors = bone_errors(captured, from_skeleton(captured).body.values, limb_bones(NAMES))
    assert max(float(e.max()) for e in errors.values()) < 4.0


def test_elbow_beyond_straight_and_back() -> None:
    """An arm swings 8 degrees beyond straight, leaning to the side meanwhile, and bends again."""
    count = 180
    time = np.linspace(0, 1, count)
    bend = -(np.radians(40) * np.cos(2 * np.pi * time) + np.radians(32))  # 72 .. -8 degrees
    lean = np.radians(5) * np.sin(4 * np.pi * time)
    arm = Rotation.from_rotvec(np.stack([bend, 0 * time, lean], axis=1))
    captured = motion("standing", count, turns={"RightForeArm": arm}, rate=60)
    found = joint_steps(captured)
    assert steps(arm.as_matrix()).max() < 1.5
    for name in ("r_shoulder", "r_elbow", "r_wrist"):
        assert found[name].max() < 8.0, name
    errors = bone_errors(captured, from_skeleton(captured).body.values, limb_bones(NAMES))
    assert max(float(e.max()) for e in errors.values()) < 5.0


@pytest.mark.parametrize("name", REAL)
@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_real_limbs_do_not_jump(shared: Path, name: str) -> None:
    captured = reader.read_motion(shared / "data" / name)
    _, mapped = match(captured.names)
    found = joint_steps(captured)
    for side in "lr":
        for joint in HINGED:
            number = mapped[f"{side}_{joint}"]
            quaternions = np.array(captured.rotations[:, number])[:, [1, 2, 3, 0]]
            own = steps(Rotation.from_quat(quaternions).as_matrix())
            # as much as source or its arm does in a frame, and at most 500 degrees a second of its own
            child = mapped[f"{side}_{ {'shoulder': 'elbow', 'hip': 'knee'}.get(joint, joint) }"]
            lower = steps(
                Rotation.from_quat(np.array(captured.rotations[:, child])[:, [1, 2, 3, 0]]).as_matrix()
            )
            excess = found[f"{side}_{joint}"] - np.maximum(own, lower)
            assert excess.max() < max(5.0, 600.0 / float(captured.rate)), (side, joint, int(excess.argmax()))
