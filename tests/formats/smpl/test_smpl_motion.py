"""Motion of SMPL's bodies: layouts of poses, axes, jaw and eyes, rates, and files that are none."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fba
from fba.errors import FormatError
from fba.formats import format_of
from fba.formats.smpl._reader import read_motion
from fba.parameters import bap_numbers, fap_numbers

FRAMES = 9
RAMP = np.linspace(0, 1, FRAMES)
STANDS = np.array([np.pi / 2, 0.0, 0.0])
"""Turn of the root by which a body stands in AMASS, z up."""


def body(root: np.ndarray = STANDS) -> np.ndarray:
    """Return turns (T, 22, 3): arms hang from frame 0 on, and the left elbow bends forward by 80 degrees."""
    turns = np.zeros((FRAMES, 22, 3))
    turns[:, 0] = root
    turns[:, 16, 2], turns[:, 17, 2] = -1.2, 1.2  # shoulders down
    turns[:, 18, 1] = -np.radians(80) * RAMP
    return turns


def saved(folder: Path, name: str = "a.npz", **arrays: Any) -> Path:
    path = folder / name
    np.savez(path, **{"mocap_framerate": 30.0, "trans": np.zeros((FRAMES, 3)), "gender": "male"} | arrays)
    return path


def value(animation: fba.Animation, name: str) -> np.ndarray:
    return animation.body.values[:, bap_numbers()[name] - 1]


def test_all_layouts_are_one_motion(tmp_path: Path) -> None:
    poses = body().reshape(FRAMES, -1)
    zeros = np.zeros((FRAMES, 90))
    layouts = {
        "smpl": {"poses": np.hstack([poses, zeros[:, :6]])},
        "smplh": {"poses": np.hstack([poses, zeros])},
        "smplx": {"poses": np.hstack([poses, zeros[:, :9], zeros])},
        "parts": {"root_orient": poses[:, :3], "pose_body": poses[:, 3:], "pose_hand": zeros},
        "y up": {"poses": np.hstack([body(np.zeros(3)).reshape(FRAMES, -1), zeros])},
        "a camera's axes": {"poses": np.hstack([body(np.array([np.pi, 0, 0])).reshape(FRAMES, -1), zeros])},
    }
    for name, arrays in layouts.items():
        animation = fba.read(saved(tmp_path, **arrays))
        assert (animation.rate, len(animation), animation.face) == (30, FRAMES, None)
        bent = value(animation, "l_elbow_flexion") / 1e5
        assert np.degrees(bent[-1] - bent[0]) == pytest.approx(80, abs=4), name
        assert (
            np.abs(value(animation, "r_elbow_flexion") - value(animation, "r_elbow_flexion")[0]).max() < 2000
        )
        assert np.abs(value(animation, "HumanoidRoot_rt_body_tilt")).max() < 5000, name  # it stands


def test_the_path_goes_with_the_axes(tmp_path: Path) -> None:
    """One metre along -y of AMASS is ahead of somebody who faces there."""
    ahead = np.outer(RAMP, [0.0, -1.0, 0.0]) + np.array([0.0, 0.0, 0.9])
    motion = read_motion(saved(tmp_path, poses=body().reshape(FRAMES, -1), trans=ahead))
    np.testing.assert_allclose(motion.positions[-1] - motion.positions[0], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(motion.positions[:, 1], 0.9, atol=1e-9)
    _, places = motion.world()
    toes = places[0, motion.names.index("left_foot")] - places[0, motion.names.index("left_ankle")]
    assert toes[2] > 0.1


def test_jaw_and_eyes(tmp_path: Path) -> None:
    eyes = np.zeros((FRAMES, 2, 3))
    eyes[:] = Rotation.from_euler("YX", [20, -10], degrees=True).as_rotvec()  # to the left and up
    jaw = np.outer(RAMP, [np.radians(20), 0, 0])
    parts = np.split(body().reshape(FRAMES, -1), [3], axis=1)
    path = saved(
        tmp_path, root_orient=parts[0], pose_body=parts[1], pose_jaw=jaw, pose_eye=eyes.reshape(FRAMES, 6)
    )
    face = fba.read(path).face
    opened = face.values[:, fap_numbers()["open_jaw"] - 1]
    np.testing.assert_allclose(opened, RAMP * opened[-1], atol=1)
    assert opened[-1] > 800
    for side in "lr":
        yaw, pitch = (face.values[0, fap_numbers()[f"{way}_{side}_eyeball"] - 1] for way in ("yaw", "pitch"))
        assert np.degrees([yaw / 1e5, pitch / 1e5]) == pytest.approx([20, -10], abs=0.1)


def test_rates(tmp_path: Path) -> None:
    poses = body().reshape(FRAMES, -1)
    path = saved(tmp_path, poses=poses, mocap_framerate=120.00004577636719)
    assert read_motion(path).rate == 120
    slow = fba.read(path, rate=30)
    assert (slow.rate, len(slow)) == (30, 3)
    np.savez(tmp_path / "b.npz", poses=poses)
    with pytest.raises(FormatError, match=r"b\.npz: has no frame rate; give one with source_rate=120"):
        fba.read(tmp_path / "b.npz")
    assert fba.read(tmp_path / "b.npz", source_rate=60).rate == 60


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"poses": np.zeros((FRAMES, 100))}, r"poses has the shape \(9, 100\); expected frames of 66, 72"),
        ({"poses": np.zeros((0, 156))}, r"poses has the shape \(0, 156\)"),
        (
            {"poses": np.full((FRAMES, 156), np.nan)},
            r"frame 0: poses must be finite numbers .*\(found 'nan'\)",
        ),
        (
            {"poses": np.full((FRAMES, 156), 1e199)},
            "frame 0: poses must be finite numbers of at most 1000 rad",
        ),
        (
            {"poses": body().reshape(FRAMES, -1), "trans": np.full((FRAMES, 3), -1e300)},
            "frame 0: trans must be finite numbers of at most 1e",
        ),
        ({"poses": np.zeros((FRAMES, 156)), "trans": np.zeros((3, 3))}, r"trans has the shape \(3, 3\)"),
        ({"poses": np.zeros((FRAMES, 156)), "mocap_framerate": 0.0}, "its frame rate must be 0.1 to 10000"),
        ({"root_orient": np.zeros((9, 3)), "pose_body": np.zeros((8, 63))}, "differ in their frames"),
        ({"root_orient": np.zeros((9, 3)), "pose_body": np.zeros((9, 60))}, "its body has 21 joints"),
        (
            {"root_orient": np.zeros((9, 3)), "pose_body": np.zeros((9, 63)), "pose_jaw": np.zeros((9, 2))},
            r"pose_jaw, pose_eye: shapes \[\(9, 2\)\]",
        ),
    ],
)
def test_damaged_files_are_refused(tmp_path: Path, arrays: dict[str, Any], message: str) -> None:
    path = saved(tmp_path, **arrays)
    assert format_of(path).name == "smpl"
    with pytest.raises(FormatError, match=message):
        fba.read(path)


def test_python_objects_are_not_loaded(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    poses = body().reshape(FRAMES, -1)
    np.savez(path, poses=poses, mocap_framerate=30.0, gender=np.array({"a": 1}, dtype=object))
    assert len(read_motion(path)) == FRAMES
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(FormatError, match="no archive that can be read"):
        read_motion(path)


def test_metres_of_the_person_in_one_metre_of_the_file(tmp_path: Path) -> None:
    path = saved(
        tmp_path, poses=body().reshape(FRAMES, -1), trans=np.stack([RAMP, 0 * RAMP, 0.9 + 0 * RAMP], 1)
    )
    ways = [np.ptp(value(fba.read(path, scale=scale), "HumanoidRoot_tr_lateral")) for scale in (0.5, 1.0)]
    assert ways[1] == pytest.approx(2 * ways[0], abs=2)


@pytest.mark.parametrize("root", [STANDS, np.zeros(3), np.array([np.pi, 0.0, 0.0])])
def test_heads_are_up_along_y(tmp_path: Path, root: np.ndarray) -> None:
    """Whether the file has z up, y up, or y down as cameras have it."""
    _, places = read_motion(saved(tmp_path, poses=body(root).reshape(FRAMES, -1))).world()
    assert (places[:, 15, 1] - places[:, 0, 1] > 0.5).all()
