"""Maps of joints in Python: found, changed by hand, saved and read again."""

from pathlib import Path

import pytest

import fba
from fba.body import ROOT
from fba.capture.joint_maps import change_map, find_map, read_map, write_map
from fba.capture.motion import SkeletonMotion
from fba.errors import FormatError, LimitError, OptionError
from fba.formats.bvh._reader import parse


@pytest.fixture(scope="module")
def motion() -> SkeletonMotion:
    """The sample capture, cut after its first frames."""
    lines = (Path(fba.__file__).parent / "samples" / "hello.bvh").read_text().splitlines()
    start = next(number for number, line in enumerate(lines) if line.startswith("Frames:"))
    return parse("\n".join([*lines[:start], "Frames: 3", *lines[start + 1 : start + 5]]) + "\n")


def test_a_map_is_saved_and_read_again(motion: SkeletonMotion, tmp_path: Path) -> None:
    found = find_map(motion)
    assert found["Hips"] == ROOT
    assert found["LeftArm"] == "l_shoulder"
    assert list(found) == [name for name in motion.names if name in found]
    write_map(tmp_path / "map.toml", found, motion)
    assert read_map(tmp_path / "map.toml") == found
    assert "# Joints of the standard that are free: " in (tmp_path / "map.toml").read_text()


def test_joints_are_given_and_left_out(motion: SkeletonMotion) -> None:
    changed = change_map(motion, None, {"LeftHand": "l_elbow", "RightHand": ""})
    assert changed["LeftHand"] == "l_elbow"
    assert "LeftForeArm" not in changed, "it loses its joint"
    assert "RightHand" not in changed
    assert changed["RightForeArm"] == "r_elbow"


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        ({"LeftHant": "l_wrist"}, r"no joint 'LeftHant' \(did you mean 'LeftHand'\?\)"),
        ({"LeftHand": "l_wrists"}, r"no joint 'l_wrists' \(did you mean 'l_wrist'\?\)"),
        ({"Hips": ""}, "no joint of the skeleton is mapped to HumanoidRoot"),
    ],
)
def test_wrong_joints(motion: SkeletonMotion, pairs: dict[str, str], message: str) -> None:
    with pytest.raises(OptionError, match=message):
        change_map(motion, None, pairs)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'[joints]\n"a" = HumanoidRoot\n', "map.toml:2: is not TOML"),
        (b'"a" = "HumanoidRoot"\n', "has no table"),
        (b'[joints]\n"a" = 1\n', "'a' must name one joint of the standard, not 1"),
        (b'[joints]\n"a" = "HumanoidRot"\n', "did you mean 'HumanoidRoot'"),
        (b'[joints]\n"a" = "vl1"\n', "maps no joint to HumanoidRoot"),
        (b'[joints]\n"a" = "HumanoidRoot"\n"b" = "HumanoidRoot"\n', "'a' and 'b' are both mapped"),
        (b"\xff\xfe", r"is not UTF-8 text \(byte 0\)"),
        (b"#" * (1 << 20) + b"\n", "more than the 1048576 that a map may have"),
    ],
)
def test_wrong_files(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "map.toml").write_bytes(content)
    with pytest.raises(FormatError, match=message):
        read_map(tmp_path / "map.toml")


def test_a_limit_of_bytes_holds(tmp_path: Path) -> None:
    (tmp_path / "map.toml").write_bytes(b"#" * 1000)
    with pytest.raises(LimitError):
        read_map(tmp_path / "map.toml", limits=fba.Limits(bytes=10))
