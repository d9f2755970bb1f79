"""Skinned people of other makers as bodies for display, driven by BAPs."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fba
from fba.body import BapSolver, BodyModel, Skeleton
from fba.errors import FbaWarning, FormatError
from fba.formats.gltf.bodies import import_body
from fba.parameters import baps
from gltf_edits import edit
from small_bodies import rod
from small_people import BONES, write_person

SHARED_BONES = ("leftHand", "rightHand", "leftLowerLeg", "rightFoot", "head")
HIPS = 0.936
"""Metres to the hips of the default body, from joints.csv."""


def middles(body: BodyModel, matrices: np.ndarray, parts: tuple[str, ...] = SHARED_BONES) -> np.ndarray:
    """Middles of the boxes of bones, relative to that of the hips, in a pose."""
    places = body.skin(matrices)
    of = {bone: places[8 * number : 8 * number + 8].mean(axis=0) for number, bone in enumerate(BONES)}
    return np.array([of[bone] - of["hips"] for bone in parts])


def standing(body: BodyModel) -> np.ndarray:
    matrices = np.tile(np.eye(4), (len(body.skeleton), 1, 1))
    matrices[:, :3, 3] = body.skeleton.centres
    return matrices


@pytest.mark.parametrize(
    ("extension", "facing", "scale"), [(None, 1, 1.0), ("VRM", -1, 1.0), ("VRMC_vrm", 1, 0.01)]
)
def test_a_person_stands_in_the_default_posture(
    tmp_path: Path, extension: str | None, facing: int, scale: float
) -> None:
    body = import_body(write_person(tmp_path / "p.glb", extension=extension, facing=facing, scale=scale))
    assert body.skeleton.names == Skeleton.default().names
    posture = body.skin(standing(body))
    assert posture[:, 1].min() == pytest.approx(0, abs=1e-6)
    hips = body.skeleton.centres[body.skeleton.number("l_hip")]
    assert hips[0] > 0.05
    assert hips[1] == pytest.approx(HIPS, abs=1e-3)
    hand, shoulder = (body.skeleton.centres[body.skeleton.number(f"l_{j}")] for j in ("wrist", "shoulder"))
    assert hand[0] > 0.1
    np.testing.assert_allclose((hand - shoulder)[[0, 2]], 0, atol=0.1)
    size = HIPS / 0.86  # the soles are 0.01 m under 0, the hips at 0.85
    assert shoulder[1] - hand[1] == pytest.approx(0.52 * size, abs=0.03)
    toes = body.skeleton.centres[body.skeleton.number("l_metatarsal")]
    assert toes[2] - hips[2] > 0.1
    assert float(body.notes["size"].split()[0]) == pytest.approx(size, abs=0.004)


def test_a_motion_moves_its_own_person_as_in_the_file(tmp_path: Path) -> None:
    """Encoded and shown on the person it was made with, a motion puts all limbs where the file has them."""
    frames = 4
    share = np.linspace(0, 1, frames)

    def turn(axis: str, degrees: float) -> list[Rotation]:
        return [Rotation.from_euler(axis, degrees * s, degrees=True) for s in share]

    clip = {
        "spine": turn("x", 20),
        "chest": turn("y", 25),
        "head": turn("y", 30),
        "leftUpperArm": turn("z", -60),
        "leftLowerArm": turn("y", -70),
        "rightUpperArm": turn("y", 40),
        "rightHand": turn("x", 50),
        "leftUpperLeg": turn("x", -50),
        "leftLowerLeg": turn("x", 80),
    }
    path = write_person(tmp_path / "p.glb", clips={"pose": clip})
    body = import_body(path)
    shown = BapSolver(body.skeleton).pose(fba.read(path, ground="none").body.values)
    size = HIPS / 0.86
    for frame in range(frames):
        world: dict[str, tuple[Rotation, np.ndarray]] = {}
        wanted = {}
        for bone, (parent, offset) in BONES.items():
            above, place = world[parent] if parent is not None else (Rotation.identity(), np.zeros(3))
            own = above * clip[bone][frame] if bone in clip else above
            world[bone] = own, place + above.apply(offset)
        still = body.bind
        rest = middles(body, still)
        for row, bone in enumerate(SHARED_BONES):
            chain, place = bone, np.zeros(3)
            while BONES[chain][0] is not None:
                place = place + np.array(BONES[chain][1])
                chain = str(BONES[chain][0])
            box = rest[row] / size - place  # from the joint to the box's middle, relative to that of the hips
            own, at = world[bone]
            hips = world["hips"][1]
            wanted[bone] = own.apply(box) + at - hips
        ours = middles(body, shown[frame]) / size
        lengths = np.linalg.norm(ours - np.array([wanted[bone] for bone in SHARED_BONES]), axis=1)
        assert lengths.max() < 0.01, (frame, dict(zip(SHARED_BONES, lengths.round(3), strict=True)))


@pytest.mark.parametrize(
    ("joint", "bone"), [("sacroiliac", "hips"), ("l_subtalar", "leftFoot"), ("l_midtarsal", "leftFoot")]
)
def test_hips_and_feet_follow_all_joints_that_turn_them(tmp_path: Path, joint: str, bone: str) -> None:
    body = import_body(write_person(tmp_path / "p.glb"))
    solver = BapSolver(body.skeleton)
    values = np.zeros(296)
    values[[bap.number - 1 for bap in baps() if bap.joint == joint]] = 30_000
    box = slice(8 * list(BONES).index(bone), 8 * list(BONES).index(bone) + 8)
    moved = body.skin(solver.pose(values))[box] - body.skin(solver.pose(np.zeros(296)))[box]
    assert np.linalg.norm(moved, axis=1).max() > 0.01


def test_meshes_without_a_skin_hang_on_their_joint(tmp_path: Path) -> None:
    path = write_person(tmp_path / "p.glb")

    def add(document: dict) -> None:  # type: ignore[type-arg]
        head = next(n for n in document["nodes"] if n.get("name") == "head")
        body = next(n for n in document["nodes"] if n.get("name") == "Body")
        head.setdefault("children", []).append(len(document["nodes"]))
        document["nodes"].append({"name": "hat", "mesh": body["mesh"], "translation": [0, 0.2, 0]})
        document["scenes"][0]["nodes"].append(len(document["nodes"]))
        document["nodes"].append({"name": "chair", "mesh": body["mesh"]})

    edit(path, add)
    with pytest.warns(FbaWarning, match="left out: chair"):
        body = import_body(path)
    hat = body.part("hat")
    assert {body.skeleton.names[joint] for joint in hat.joints[:, 0]} == {"skullbase"}
    assert len(body.parts) == 2


def test_joints_that_a_file_does_not_declare_go_with_those_above(tmp_path: Path) -> None:
    path = write_person(tmp_path / "p.glb", extension="VRM")

    def forget(document: dict) -> None:  # type: ignore[type-arg]
        bones = document["extensions"]["VRM"]["humanoid"]["humanBones"]
        bones[:] = [entry for entry in bones if not entry["bone"].endswith(("Proximal", "Shoulder"))]

    edit(path, forget)
    body = import_body(path)
    carried = [body.skeleton.names[body.joints[8 * number, 0]] for number in range(len(BONES))]
    joints = dict(zip(BONES, carried, strict=True))
    assert joints["leftMiddleProximal"] == joints["leftHand"] == "l_wrist"
    assert joints["rightShoulder"] == joints["chest"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.pop("skins") and [n.pop("skin", None) for n in d["nodes"]], "has no skin"),
        (lambda d: [n.update(name="x") for n in d["nodes"] if "Arm" in n.get("name", "")], "upper arm"),
        (lambda d: [n.update(name=f"bone{k}") for k, n in enumerate(d["nodes"])], "joint names"),
    ],
)
def test_files_that_show_no_person(tmp_path: Path, change: object, message: str) -> None:
    path = write_person(tmp_path / "p.glb")
    edit(path, change)  # type: ignore[arg-type]
    with pytest.raises(FormatError, match=message):
        import_body(path)


def test_own_body_models_are_loaded(tmp_path: Path) -> None:
    path = tmp_path / "own.glb"
    rod().save(path)
    assert import_body(path).skeleton.names == rod().skeleton.names
