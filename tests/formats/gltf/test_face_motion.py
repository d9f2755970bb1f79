"""Faces that move in glTF files become FAPs: named morph targets, expressions and gaze of VRMA, bones."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fba
from fba.capture import shape_faps
from fba.errors import FbaWarning, FormatError
from fba.face._expressions import Definitions
from fba.gltf import read_gltf
from fba.gltf._writer import Builder
from fba.parameters import fap_numbers
from gltf_edits import edit
from small_people import BONES, write_person

FRAMES = 5
RAMP = np.linspace(0, 1, FRAMES)
ARM = {"leftUpperArm": [Rotation.from_euler("z", -60 * s, degrees=True) for s in RAMP]}


def column(animation: fba.Animation, name: str) -> np.ndarray:
    return animation.face.values[:, fap_numbers()[name] - 1]


def test_body_and_face_come_from_one_file(tmp_path: Path) -> None:
    morphs = {"jawOpen": RAMP, "blendShape1.eyeBlink_R": RAMP / 2, "viseme_PP": np.zeros(FRAMES)}
    animation = fba.read(write_person(tmp_path / "p.glb", clips={"talk": ARM}, morphs=morphs))
    assert animation.body is not None
    assert len(animation) == FRAMES
    jaw = column(animation, "open_jaw")
    np.testing.assert_allclose(jaw, RAMP * jaw[-1], atol=1)
    assert 800 < jaw[-1] <= 1080  # what an I plane of the standard carries, from fap.csv
    np.testing.assert_allclose(column(animation, "close_t_r_eyelid"), RAMP * 460, atol=1)
    assert not column(animation, "close_t_l_eyelid").any()
    sent = animation.face.mask.all(axis=0)
    assert sent[fap_numbers()["close_t_l_eyelid"] - 1]  # else the left eye would blink with the right one
    assert not sent[fap_numbers()["raise_l_ear"] - 1]


def test_a_face_alone(tmp_path: Path) -> None:
    path = write_person(tmp_path / "p.glb", clips={"talk": {}}, morphs={"mouthSmileLeft": RAMP})
    animation = fba.read(path)
    assert animation.body is None
    assert (column(animation, "raise_l_cornerlip") > 0).sum() == FRAMES - 1
    assert len(fba.read(path, rate=60)) == 2 * FRAMES - 1


def test_a_body_that_is_left_out_is_said(tmp_path: Path) -> None:
    """A riddle of ten joints that turn beside a face; nine may be those of a head."""
    turns = ARM["leftUpperArm"]
    riddle = {bone: f"n{number}" for number, bone in enumerate(BONES)}
    ten = dict.fromkeys(list(BONES)[:10], turns)
    path = write_person(tmp_path / "p.glb", clips={"talk": ten}, names=riddle, morphs={"jawOpen": RAMP})
    with pytest.warns(FbaWarning, match="no body is read, the face alone: no known skeleton family"):
        assert fba.read(path).body is None
    nine = dict.fromkeys(list(BONES)[:9], turns)
    head = write_person(tmp_path / "h.glb", clips={"talk": nine}, names=riddle, morphs={"jawOpen": RAMP})
    assert fba.read(head).body is None


def test_a_body_in_doubt_is_no_face_alone(tmp_path: Path) -> None:
    """A person whose left is called right, beside a face: refused as without the face."""
    other = {"left": "right", "righ": "left"}
    names = {bone: other.get(bone[:4], bone[:4]) + bone[4 + (bone[:5] == "right") :] for bone in BONES}
    path = write_person(tmp_path / "p.glb", clips={"talk": ARM}, names=names, morphs={"jawOpen": RAMP})
    with pytest.raises(FormatError, match="left and right are swapped"):
        fba.read(path)


def test_expressions_and_gaze_of_vrma(tmp_path: Path) -> None:
    gaze = [Rotation.from_euler("YX", [20 * s, -10 * s], degrees=True) for s in RAMP]
    expressions = {"happy": RAMP, "aa": RAMP * 2, "blinkLeft": np.ones(FRAMES)}
    path = write_person(
        tmp_path / "p.vrma", clips={"talk": ARM}, extension="VRMC_vrm_animation", skin=False,
        expressions=expressions, gaze=gaze,
    )  # fmt: skip
    animation = fba.read(path)
    assert animation.body is not None
    joy = Definitions.default().expressions[1, fap_numbers()["raise_l_cornerlip"] - 1]
    corner = column(animation, "raise_l_cornerlip") - column(animation, "raise_l_cornerlip")[0]
    middle = FRAMES // 2  # there "aa" is at 1 already: a weight of 2 counts as 1
    assert corner[-1] - corner[middle] == pytest.approx(joy / 2, abs=1)
    np.testing.assert_allclose(np.diff(column(animation, "open_jaw"))[middle:], 0, atol=1)  # joy opens no jaw
    assert (column(animation, "close_t_l_eyelid") > 800).all()
    for side in "lr":
        yaw, pitch = (column(animation, f"{what}_{side}_eyeball")[-1] / 1e5 for what in ("yaw", "pitch"))
        assert np.degrees(yaw) == pytest.approx(20, abs=0.2)
        assert np.degrees(pitch) == pytest.approx(-10, abs=0.2)


def test_bones_of_eyes_and_jaw(tmp_path: Path) -> None:
    """They hang on a head that is turned in itself, as in files of Blender."""
    clip = ARM | {"head": [Rotation.identity()] * FRAMES}
    # where a bone turns the eye, a shape that looks aside moves the lids alone
    path = write_person(tmp_path / "p.glb", clips={"talk": clip}, morphs={"eyeLookOutLeft": RAMP})

    def add(document: dict) -> None:  # type: ignore[type-arg]
        nodes, clip = document["nodes"], document["animations"][0]
        head = next(number for number, node in enumerate(nodes) if node["name"] == "head")
        turned = [0, 0, float(np.sin(np.pi / 4)), float(np.cos(np.pi / 4))]
        nodes[head].setdefault("children", []).append(len(nodes))
        nodes.append({"name": "skull", "rotation": turned, "children": [len(nodes) + 1, len(nodes) + 2]})
        nodes += [{"name": "LeftEye"}, {"name": "jaw"}]
        still = next(c for c in clip["channels"] if c["target"]["node"] == head)
        moving = next(c for c in clip["channels"] if c["target"]["node"] != head)
        assert still is not moving
        for node in (len(nodes) - 2, len(nodes) - 1):
            channel = {"sampler": moving["sampler"], "target": {"node": node, "path": "rotation"}}
            clip["channels"].append(channel)

    edit(path, add)
    animation = fba.read(path)
    # about the head's -z at rest, which the skull's own turn leaves: neither yaw nor pitch nor an open jaw
    for name in ("yaw_l_eyeball", "pitch_l_eyeball", "open_jaw"):
        assert np.abs(column(animation, name)).max() <= 1

    def turn(document: dict) -> None:  # type: ignore[type-arg]
        skull = next(node for node in document["nodes"] if node["name"] == "skull")
        skull["rotation"] = [-float(np.sin(np.pi / 4)), 0, 0, float(np.cos(np.pi / 4))]

    edit(path, turn)  # its own z is now the head's y: -60 degrees about it look to the right
    with pytest.warns(FbaWarning, match="eyes that turn further than 34 degrees"):
        yaw = column(fba.read(path), "yaw_l_eyeball") / 1e5
    np.testing.assert_allclose(np.degrees(yaw), [0, -15, -30, -34.4, -34.4], atol=0.5)


def test_unknown_targets_are_named(tmp_path: Path) -> None:
    path = write_person(tmp_path / "p.glb", clips={"talk": ARM}, morphs={"jawOpen": RAMP, "Wobble": RAMP})
    with pytest.warns(FbaWarning, match="1 animated morph targets are left out.*Wobble"):
        assert fba.read(path).face is not None
    path = write_person(tmp_path / "q.glb", clips={"talk": ARM}, morphs={"Wobble": RAMP})
    with pytest.warns(FbaWarning, match="Wobble"):
        assert fba.read(path).face is None


def test_names_in_all_spellings() -> None:
    jaw = shape_faps("jawOpen")
    assert jaw is not None
    for name in ("jaw_open", "blendShape1.jawOpen", "JawOpen"):
        other = shape_faps(name)
        assert other is not None
        np.testing.assert_array_equal(other, jaw)
    smile = shape_faps("mouthSmile_R")
    assert smile[fap_numbers()["raise_r_cornerlip"] - 1] == 550
    assert shape_faps("Wobble") is None


def test_both_ends_of_a_take_of_blender(tmp_path: Path) -> None:
    """One action an object, of one take: all are read together."""
    turns = [Rotation.from_euler("y", 20 * s, degrees=True) for s in RAMP]
    clips = {"Key|Take 1": {}, "eyes|Take 1": {"head": turns}, "eyes|Take 2": {"head": turns[::-1]}}
    path = write_person(tmp_path / "p.glb", clips=clips, morphs={"jawOpen": RAMP})

    def add(document: dict) -> None:  # type: ignore[type-arg]
        document["nodes"].append({"name": "eyeRight"})
        document["scenes"][0]["nodes"].append(len(document["nodes"]) - 1)
        for clip in document["animations"][1:]:
            channels = [channel for channel in clip["channels"] if channel["target"]["path"] == "rotation"]
            channels[0]["target"]["node"] = len(document["nodes"]) - 1
            clip["channels"] = channels

    edit(path, add)
    assert len(read_gltf(path).animations) == 3
    animation = fba.read(path)
    assert column(animation, "open_jaw").any()
    np.testing.assert_allclose(column(animation, "yaw_r_eyeball") / 1e5, np.radians(20) * RAMP, atol=1e-3)


def test_a_mesh_that_turns_turns_the_head(tmp_path: Path) -> None:
    """A face without a skeleton hangs on a group that turns by 20 degrees to the left, or down, or right."""
    for axis, degrees, name in (("y", 20, "head_yaw"), ("x", 20, "head_pitch"), ("z", 20, "head_roll")):
        turns = [Rotation.from_euler("Y", 90, degrees=True)] * FRAMES  # of a node above, undone below
        turns = [Rotation.from_euler(axis, degrees * s, degrees=True) * turns[0] for s in RAMP]
        builder = Builder()
        back = Rotation.from_euler("Y", -90, degrees=True).as_quat().tolist()
        rest = turns[0].as_quat().tolist()
        builder.add("nodes", {"name": "group", "children": [1], "rotation": rest})
        builder.add("nodes", {"name": "face", "mesh": 0, "rotation": back})
        corners = np.eye(3, dtype=np.float32)
        positions = builder.data(corners, bounds=True)
        primitive = {"attributes": {"POSITION": positions}, "targets": [{"POSITION": builder.data(corners)}]}
        builder.add("meshes", {"primitives": [primitive], "extras": {"targetNames": ["jawOpen"]}})
        builder.add("scenes", {"nodes": [0]})
        times = builder.data((np.arange(FRAMES) / 30).astype(np.float32), bounds=True)
        outputs = [RAMP.astype(np.float32), np.array([turn.as_quat() for turn in turns], np.float32)]
        builder.add("animations", {
            "samplers": [{"input": times, "output": builder.data(one)} for one in outputs],
            "channels": [
                {"sampler": 0, "target": {"node": 1, "path": "weights"}},
                {"sampler": 1, "target": {"node": 0, "path": "rotation"}},
            ],
        })  # fmt: skip
        path = tmp_path / "face.glb"
        path.write_bytes(builder.glb())
        animation = fba.read(path)
        assert animation.body is None
        np.testing.assert_allclose(column(animation, name) / 1e5, np.radians(degrees * RAMP), atol=1e-3)
        assert column(animation, "open_jaw")[-1] > 800


@pytest.mark.parametrize("degrees", [40.0, 83.0, 166.0])
def test_eyes_do_not_turn_into_the_head(tmp_path: Path, degrees: float) -> None:
    """A gaze that goes round to the back of the head stops where eyes do, on its side, and this is said."""
    gaze = [Rotation.from_euler("Y", [degrees * s], degrees=True) for s in RAMP]
    path = write_person(
        tmp_path / "a.vrma", clips={"look": {"head": [Rotation.identity()] * len(gaze)}},
        extension="VRMC_vrm_animation", gaze=gaze,
    )  # fmt: skip
    with pytest.warns(FbaWarning, match="eyes that turn further than 34 degrees"):
        animation = fba.read(path)
    yaw = animation.face.values[:, fap_numbers()["yaw_l_eyeball"] - 1]
    assert yaw.max() == 60_000
    assert yaw.min() >= 0
