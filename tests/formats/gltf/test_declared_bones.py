"""Bones that a file declares: VRM 0, which faces -z, VRM 1 and VRMA, whatever their nodes are called."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fba
from fba.body import BapSolver
from fba.errors import FormatError
from fba.formats.gltf._reader import read_motion
from fba.formats.gltf.humanoid import find_humanoid
from fba.gltf import read_gltf
from gltf_edits import edit
from small_people import BONES, write_person

FRAMES = 5
RIDDLES = {bone: f"n{number * 37 % 101}" for number, bone in enumerate(BONES)}
"""Names that say nothing."""
STEP = (0.0, 0.0, 0.2)


def turns() -> dict[str, list[Rotation]]:
    """Right thigh forward by up to 30 degrees, left elbow by up to 80 degrees forward, from the T pose."""
    share = np.linspace(0, 1, FRAMES)
    return {
        "rightUpperLeg": [Rotation.from_euler("x", -30 * s, degrees=True) for s in share],
        "leftLowerArm": [Rotation.from_euler("y", -80 * s, degrees=True) for s in share],
    }


def written(path: Path, extension: str | None, **more: object) -> Path:
    options = {"clips": {"step": turns()}, "hips": np.linspace((0, 0, 0), STEP, FRAMES), "names": RIDDLES}
    return write_person(path, extension=extension, **(options | more))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("extension", "facing", "scale", "skin"),
    [("VRM", -1, 1.0, True), ("VRMC_vrm", 1, 0.01, True), ("VRMC_vrm_animation", 1, 1.0, False)],
)
def test_declared_bones_move_the_same_body(
    tmp_path: Path, extension: str, facing: int, scale: float, skin: bool
) -> None:
    path = written(tmp_path / "person.glb", extension, facing=facing, scale=scale, skin=skin)
    baps = fba.read(path, ground="source", plant=False).body
    solver = BapSolver()
    matrices = solver.pose(baps.values)

    def bone(first: str, second: str, frame: int = -1) -> np.ndarray:
        ends = [matrices[frame, solver.skeleton.number(joint), :3, 3] for joint in (first, second)]
        line: np.ndarray = ends[1] - ends[0]
        return line / np.linalg.norm(line)

    np.testing.assert_allclose(bone("r_hip", "r_knee"), [0, -np.cos(np.pi / 6), 0.5], atol=0.01)
    np.testing.assert_allclose(bone("l_hip", "l_knee"), [0, -1, 0], atol=0.01)
    np.testing.assert_allclose(bone("l_shoulder", "l_elbow"), [1, 0, 0], atol=0.01)
    angle = np.radians(80)
    np.testing.assert_allclose(bone("l_elbow", "l_wrist"), [np.cos(angle), 0, np.sin(angle)], atol=0.02)
    legs = (0.936 - 0.076) / 0.78  # of the default body, from joints.csv, and of the small person
    moved = matrices[-1, 0, :3, 3] - matrices[0, 0, :3, 3]
    np.testing.assert_allclose(moved, legs * np.array(STEP), atol=0.01)


def test_names_alone_do_not_tell(tmp_path: Path) -> None:
    with pytest.raises(FormatError, match="joint"):
        fba.read(written(tmp_path / "person.glb", None, hips=()))


def test_the_file_counts_and_not_the_names(tmp_path: Path) -> None:
    swapped = {bone: bone for bone in BONES} | {
        "leftUpperArm": "rightUpperArm",
        "rightUpperArm": "leftUpperArm",
    }
    path = written(tmp_path / "person.glb", "VRM", names=swapped)
    motion = read_motion(path)
    assert motion.declared["rightUpperArm"] == "l_shoulder"
    assert motion.declared["leftUpperArm"] == "r_shoulder"


def test_thumbs_of_both_versions(tmp_path: Path) -> None:
    """A thumb's first bone is proximal in VRM 0 and metacarpal in VRM 1."""
    for extension, names in (
        ("VRM", ("Proximal", "Intermediate", "Distal")),
        ("VRMC_vrm", ("Metacarpal", "Proximal", "Distal")),
    ):
        path = written(tmp_path / f"{extension}.glb", extension)

        def add(document: dict, extension: str = extension, names: tuple[str, ...] = names) -> None:  # type: ignore[type-arg]
            start = len(document["nodes"])
            document["nodes"] += [{"name": f"t{n}", "translation": [0.03, 0, 0.01]} for n in range(3)]
            document["nodes"][start]["children"] = [start + 1]
            document["nodes"][start + 1]["children"] = [start + 2]
            hand = next(n for n in document["nodes"] if n["name"] == RIDDLES["leftHand"])
            hand.setdefault("children", []).append(start)
            bones = document["extensions"][extension]["humanoid"]["humanBones"]
            for number, name in enumerate(names):
                if extension == "VRM":
                    bones.append({"bone": f"leftThumb{name}", "node": start + number})
                else:
                    bones[f"leftThumb{name}"] = {"node": start + number}

        edit(path, add)
        declared = read_motion(path).declared
        assert [declared[f"t{n}"] for n in range(3)] == ["l_thumb1", "l_thumb2", "l_thumb3"]


def test_declarations_that_cannot_be(tmp_path: Path) -> None:
    path = written(tmp_path / "person.glb", "VRMC_vrm")

    def twice(document: dict) -> None:  # type: ignore[type-arg]
        bones = document["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]
        bones["leftHand"]["node"] = bones["leftLowerArm"]["node"]

    edit(path, twice, tmp_path / "twice.glb")
    with pytest.raises(FormatError, match="'leftLowerArm' and 'leftHand' are both node"):
        fba.read(tmp_path / "twice.glb")

    def beyond(document: dict) -> None:  # type: ignore[type-arg]
        document["extensions"]["VRMC_vrm"]["humanoid"]["humanBones"]["leftHand"]["node"] = 999

    edit(path, beyond, tmp_path / "beyond.glb")
    with pytest.raises(FormatError, match=r"leftHand\.node: 999 is not within"):
        fba.read(tmp_path / "beyond.glb")


def test_a_file_that_declares_nothing(tmp_path: Path) -> None:
    assert find_humanoid(read_gltf(written(tmp_path / "person.glb", None))) is None
