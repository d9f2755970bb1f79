"""`--map` and `--map-out`: joints of captures that names do not tell, and maps in TOML files."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fba
from command_line import Run
from fba.parameters import bap_numbers
from small_people import BONES, write_person

STEPS = ("--bap-steps", "visage")
RIDDLES = {bone: f"n{number}" for number, bone in enumerate(BONES)}
"""Names that say nothing."""
LIMBS = {
    "hips": "HumanoidRoot", "spine": "vl5", "head": "skullbase",
    **{
        f"{word}{bone}": f"{side}_{joint}"
        for side, word in (("l", "left"), ("r", "right"))
        for bone, joint in (
            ("UpperArm", "shoulder"), ("LowerArm", "elbow"), ("Hand", "wrist"), ("UpperLeg", "hip"),
            ("LowerLeg", "knee"), ("Foot", "ankle"), ("Toes", "metatarsal"),
        )
    },
}  # fmt: skip
"""Bones of VRM and joints of the standard, from its list of joints."""


def person(path: Path, names: dict[str, str] | None = None) -> Path:
    arm = [Rotation.from_euler("z", -20 * step, degrees=True) for step in range(4)]
    knee = [Rotation.from_euler("x", 10 * step, degrees=True) for step in range(4)]
    return write_person(path, clips={"move": {"leftUpperArm": arm, "rightLowerLeg": knee}}, names=names)


def test_a_unit_that_limbs_do_not_tell(run: Run, tmp_path: Path) -> None:
    """Somebody without knees and elbows, in centimetres, who moves half a metre aside."""
    joints = (("Hips", "0 90 0"), ("LeftUpLeg", "10 0 0"), ("RightUpLeg", "-10 0 0"))
    lines = []
    for name, offset in joints:
        kind = "JOINT" if lines else "ROOT"
        channels = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
        lines += [f"{kind} {name} {{ OFFSET {offset} {channels}"] + (["}"] if lines else [])
    rows = [f"{x} 90 0 0 0 0 10 0 0 0 0 0 -10 0 0 0 0 0" for x in (0, 50)]
    path = tmp_path / "half.bvh"
    path.write_text("\n".join(["HIERARCHY", *lines, "}", "MOTION", "Frames: 2", "Frame Time: 0.04", *rows]))
    given = ["--map", "Hips=HumanoidRoot", "--map", "LeftUpLeg=l_hip", "--map", "RightUpLeg=r_hip"]
    err = run("encode", path, "-o", tmp_path / "half.fba", *given).err
    assert "its unit is unknown; taken as centimetres; give another, in metres, with --scale 0.001" in err
    assert "off their path" not in err
    err = run("encode", path, "-o", tmp_path / "half.fba", *given, "--scale", "0.02").err
    assert "unit" not in err
    assert "off their path" not in err
    body = fba.read(tmp_path / "half.fba").body
    assert np.ptp(body.values[:, bap_numbers()["HumanoidRoot_tr_lateral"] - 1]) == pytest.approx(1000, abs=3)


def test_matched_joints_are_saved_and_read_again(run: Run, tmp_path: Path) -> None:
    source, saved = person(tmp_path / "p.glb"), tmp_path / "map.toml"
    out = run("encode", source, "-o", tmp_path / "one.fba", *STEPS, "--map-out", saved).out
    found = tomllib.loads(saved.read_text())["joints"]
    assert f"{saved}: {len(found)} joints of {source}" in out
    assert found.items() >= LIMBS.items()
    assert "# Joints of the standard that are free: sacroiliac" in saved.read_text()
    run("encode", source, "-o", tmp_path / "two.fba", *STEPS, "--map", saved)
    assert (tmp_path / "one.fba").read_bytes() == (tmp_path / "two.fba").read_bytes()


def test_pairs_name_joints_that_names_do_not_tell(run: Run, tmp_path: Path) -> None:
    riddle = person(tmp_path / "riddle.glb", RIDDLES)
    err = run("encode", riddle, "-o", tmp_path / "out.fba", *STEPS, code=1).err
    assert "name each joint's counterpart in the standard with --map Pelvis=HumanoidRoot" in err
    pairs = [word for bone, joint in LIMBS.items() for word in ("--map", f"{RIDDLES[bone]}={joint}")]
    run("encode", riddle, "-o", tmp_path / "out.fba", *STEPS, *pairs)
    plain = person(tmp_path / "plain.glb")
    left_out = [word for bone in BONES if bone not in LIMBS for word in ("--map", f"{bone}=")]
    run("encode", plain, "-o", tmp_path / "plain.fba", *STEPS, *left_out)
    assert (tmp_path / "out.fba").read_bytes() == (tmp_path / "plain.fba").read_bytes()


def test_pairs_change_what_is_found(run: Run, tmp_path: Path) -> None:
    """The names of VRM serve for the standard's; a joint that loses its place moves nothing."""
    source, saved = person(tmp_path / "p.glb"), tmp_path / "map.toml"
    given = ("--map", "leftHand=leftLowerArm", "--map", "rightToes=", "--map-out", saved)
    run("encode", source, "-o", tmp_path / "out.fba", *STEPS, *given)
    joints = tomllib.loads(saved.read_text())["joints"]
    assert joints["leftHand"] == "l_elbow"
    assert "leftLowerArm" not in joints
    assert "rightToes" not in joints
    assert joints["rightLowerArm"] == "r_elbow"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[joints]\n"hips" = HumanoidRoot\n', "map.toml:2: is not TOML"),
        ('"hips" = "HumanoidRoot"\n', "has no table [joints]"),
        ('[joints]\n"hips" = "HumanoidRoots"\n', "did you mean 'HumanoidRoot'?"),
        ('[joints]\n"hips" = 3\n', "'hips' must name one joint of the standard, not 3"),
        (
            '[joints]\n"hips" = "HumanoidRoot"\n"spine" = "HumanoidRoot"\n',
            "are both mapped to 'HumanoidRoot'",
        ),
        ('[joints]\n"head" = "skullbase"\n', "maps no joint to HumanoidRoot"),
    ],
)
def test_bad_files(run: Run, tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "map.toml").write_text(text)
    source = person(tmp_path / "p.glb")
    assert message in run("convert", source, tmp_path / "out.bap", "--map", tmp_path / "map.toml", code=1).err


def test_mistakes(run: Run, tmp_path: Path) -> None:
    source = person(tmp_path / "p.glb")
    fap = tmp_path / "a.fap"
    fap.write_text("2.1 a 25 1\n" + "0 " * 68 + "\n0\n")
    for words, message in (
        ((source, "--map", "leftHant=l_wrist"), "no joint 'leftHant' (did you mean 'leftHand'?)"),
        ((source, "--map", "leftHand=l_wrists"), "no joint 'l_wrists' (did you mean 'l_wrist'?)"),
        ((source, "--map", "nothing"), "'nothing' is neither a file nor a pair of joints"),
        ((source, "--map", "hips="), "no joint of the skeleton is mapped to HumanoidRoot"),
        ((fap, "--map", "hips=HumanoidRoot"), "--map goes with motion capture"),
        ((fap, "--map-out", tmp_path / "m.toml"), "--map-out goes with motion capture"),
    ):
        err = run("encode", *words, "-o", tmp_path / "out.fba", *STEPS, code=2).err
        assert message in err
    assert not (tmp_path / "out.fba").exists()


def test_joints_of_a_body_that_is_shown(run: Run, tmp_path: Path) -> None:
    """`--map` names the joints of `--body` where the input is no capture."""
    riddle = write_person(tmp_path / "p.glb", names=RIDDLES)
    walk, out = tmp_path / "walk.bap", tmp_path / "out.glb"
    run("gait", "--cycles", 1, "-o", walk)
    assert "--map" in run("convert", walk, out, "--body", riddle, code=1).err
    maps = [word for bone, joint in LIMBS.items() for word in ("--map", f"{RIDDLES[bone]}={joint}")]
    run("convert", walk, out, "--body", riddle, *maps)
    assert out.stat().st_size > 10_000
    for words, message in (
        (("render", walk, "--map", "a=l_hip", "-o", "a.png"), "--map names the joints of a --body: give one"),
        (
            ("render", walk, "--body", riddle, "--map", "n99=l_hip", "-o", "a.png"),
            "--map: the skeleton has no joint 'n99'",
        ),
    ):
        err = run(*words, code=2).err
        assert message in err


def test_joints_of_hands_are_matched(run: Run, tmp_path: Path) -> None:
    saved = tmp_path / "map.toml"
    source = person(tmp_path / "p.glb")
    run("encode", source, "-o", tmp_path / "out.fba", *STEPS, "--map-out", saved)
    joints = tomllib.loads(saved.read_text())["joints"]
    assert joints["leftMiddleProximal"] == "l_middle1"
    assert np.array_equal(sorted(joints.values()), sorted(set(joints.values())))
