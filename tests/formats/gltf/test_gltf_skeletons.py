"""glTF skeletons in all the ways exporters leave them: the same motion gives the same BAPs."""

import warnings
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fba
from fba.capture import SkeletonMotion, from_skeleton
from fba.errors import FbaWarning, FormatError, ModelError
from fba.formats.gltf import _reader as reader
from fba.formats.gltf._reader import read_motion
from fba.gltf._writer import Builder
from gltf_edits import edited

OFFSETS = {
    "Hips": (None, (0.0, 0.95, 0.0)), "Spine": ("Hips", (0.0, 0.1, 0.0)), "Spine1": ("Spine", (0.0, 0.15,
    0.0)), "Neck": ("Spine1", (0.0, 0.25, 0.0)), "Head": ("Neck", (0.0, 0.1, 0.02)), **{
        f"{side}{name}": (parent if parent in ("Hips", "Spine1") else f"{side}{parent}", (x * sign, y, z))
        for side, sign in (("Left", 1), ("Right", -1))
        for name, parent, x, y, z in (
            ("Shoulder", "Spine1", 0.05, 0.2, 0.0), ("Arm", "Shoulder", 0.13, 0.0, 0.0),
            ("ForeArm", "Arm", 0.28, 0.0, 0.0), ("Hand", "ForeArm", 0.26, 0.0, 0.0),
            ("UpLeg", "Hips", 0.1, -0.05, 0.0), ("Leg", "UpLeg", 0.0, -0.42, 0.0),
            ("Foot", "Leg", 0.0, -0.41, 0.0), ("ToeBase", "Foot", 0.0, -0.06, 0.14),
        )
    },
}  # fmt: skip
NAMES = list(OFFSETS)
PARENTS = [-1 if (p := OFFSETS[n][0]) is None else NAMES.index(p) for n in NAMES]
FRAMES = 20


def wave() -> tuple[dict[str, Rotation], np.ndarray]:
    """World-frame turns of joints, smooth over time, and places of the hips."""
    time = np.arange(FRAMES)[:, None] / FRAMES * 2 * np.pi
    turns = {}
    for number, name in enumerate(NAMES):
        axis = np.random.default_rng(number).normal(size=3)
        axis /= np.linalg.norm(axis)
        turns[name] = Rotation.from_rotvec(np.sin(time + number) * axis * (0.5 if "Leg" not in name else 0.1))
    for side in ("Left", "Right"):
        turns[f"{side}Leg"] = Rotation.from_rotvec((0.6 + 0.3 * np.sin(time)) * [1, 0, 0])
    places = np.hstack([0.1 * np.sin(time), 0.95 + 0.02 * np.cos(2 * time), 0.3 * time])
    return turns, places


def reference() -> SkeletonMotion:
    turns, places = wave()
    rotations = np.stack([turns[name].as_quat()[:, [3, 0, 1, 2]] for name in NAMES], axis=1)
    offsets = np.array([OFFSETS[name][1] for name in NAMES])
    return SkeletonMotion(tuple(NAMES), np.array(PARENTS), offsets, rotations, places, Fraction(30))


def glb(
    *,
    skin: bool = True,
    frames_turned: bool = True,
    armature: Rotation | None = None,
    scale: float = 1.0,
    bind: Rotation | None = None,
    rest: str = "bind",
    prefix: str = "",
    interpolation: str = "LINEAR",
    second: bool = False,
    keys: int = FRAMES,
) -> bytes:
    """The motion of `reference` as a file.

    frames_turned: each joint's own frame stands anyhow in the bind pose. armature, scale: of a node above the
    hips. bind: another frame for the skin's bind pose. rest: what the nodes say without the animation:
    "bind", or "frame" 7 of it.
    """
    builder = Builder()
    generator = np.random.default_rng(4)
    own = Rotation.random(len(NAMES), rng=generator) if frames_turned else Rotation.identity(len(NAMES))
    turns, places = wave()
    armature = armature or Rotation.identity()
    world: list[Rotation] = []
    local: list[Rotation] = []
    shifts: list[np.ndarray] = []
    bound: list[np.ndarray] = []
    for number, name in enumerate(NAMES):
        parent = PARENTS[number]
        world.append(turns[name] if parent < 0 else world[parent] * turns[name])
        above = armature if parent < 0 else world[parent] * own[parent]
        local.append(above.inv() * (world[number] * own[number]))
        offset = np.array(OFFSETS[name][1])
        bound.append(offset if parent < 0 else bound[parent] + offset)
        shifts.append((armature if parent < 0 else own[parent]).inv().apply(offset) / scale)
    still = [(armature if PARENTS[n] < 0 else own[PARENTS[n]]).inv() * own[n] for n in range(len(NAMES))]
    for number, name in enumerate(NAMES):
        turn = still[number] if rest == "bind" else local[number][7]
        children = [n + 1 for n in range(len(NAMES)) if PARENTS[n] == number]
        entry: dict[str, Any] = {"name": prefix + name, "rotation": turn.as_quat().tolist(),
                                 "translation": shifts[number].tolist()}  # fmt: skip
        if not number:
            top = {"name": "Armature", "children": [1], "rotation": armature.as_quat().tolist(),
                   "scale": [scale] * 3}  # fmt: skip
            builder.add("nodes", top)
        builder.add("nodes", entry | ({"children": children} if children else {}))
    builder.add("scenes", {"nodes": [0]})
    if skin:
        bind = bind or Rotation.identity()
        inverse = []
        for number in range(len(NAMES)):
            matrix = np.eye(4)
            matrix[:3, :3] = (bind * own[number]).as_matrix() * scale
            matrix[:3, 3] = bind.apply(bound[number])
            inverse.append(np.linalg.inv(matrix).T.reshape(16))
        builder.add(
            "skins",
            {"joints": list(range(1, len(NAMES) + 1)), "inverseBindMatrices": matrices(builder, inverse)},
        )
    chosen = np.linspace(0, FRAMES - 1, keys).round().astype(int)
    for clip in ("dance", "rest")[: 1 + second]:
        samplers: list[dict[str, Any]] = []
        channels: list[dict[str, Any]] = []
        times = builder.data((chosen / 30).astype(np.float32), bounds=True)
        for number in range(len(NAMES)):
            quaternions = local[number].as_quat()[chosen].astype(np.float32)
            if clip == "rest":
                quaternions = np.tile(still[number].as_quat().astype(np.float32), (keys, 1))
            if interpolation == "CUBICSPLINE":
                zero = np.zeros_like(quaternions)
                quaternions = np.stack([zero, quaternions, zero], axis=1).reshape(-1, 4)
            samplers.append(
                {"input": times, "output": builder.data(quaternions), "interpolation": interpolation}
            )
            channels.append(
                {"sampler": len(samplers) - 1, "target": {"node": number + 1, "path": "rotation"}}
            )
        if clip == "dance":
            moved = (armature.inv().apply(places)[chosen] / scale).astype(np.float32)
            samplers.append({"input": times, "output": builder.data(moved)})
            channels.append({"sampler": len(samplers) - 1, "target": {"node": 1, "path": "translation"}})
        builder.add("animations", {"name": clip, "samplers": samplers, "channels": channels})
    return builder.glb()


def matrices(builder: Builder, rows: list[np.ndarray]) -> int:
    accessor = builder.data(np.array(rows, dtype=np.float32))
    assert builder.root["accessors"][accessor]["type"] == "MAT4"
    return accessor


def saved(tmp_path: Path, **options: Any) -> Path:
    path = tmp_path / "person.glb"
    path.write_bytes(glb(**options))
    return path


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"frames_turned": False},
        {"skin": False, "frames_turned": False},
        {"armature": Rotation.from_euler("x", -90, degrees=True), "scale": 0.01},
        {"armature": Rotation.from_euler("x", -90, degrees=True), "scale": 0.01, "rest": "frame"},
        {"bind": Rotation.from_euler("x", 90, degrees=True)},
        {"bind": Rotation.from_euler("x", 90, degrees=True), "rest": "frame"},
        {"rest": "frame", "prefix": "mixamorig:"},
    ],
    ids=str,
)
def test_the_same_motion_however_it_was_exported(tmp_path: Path, options: dict[str, Any]) -> None:
    expected = from_skeleton(reference())
    found = fba.read(saved(tmp_path, **options))
    assert found.rate == 30
    assert len(found) == FRAMES
    np.testing.assert_array_equal(found.body.mask, expected.body.mask)
    difference = np.abs(found.body.values - expected.body.values)
    assert difference[:, :180].max() < 30  # 32-bit numbers in the file: 0.0003 rad
    assert difference[:, 180:183].max() <= 1


def test_joints_and_places_of_the_file(tmp_path: Path) -> None:
    motion = read_motion(saved(tmp_path, armature=Rotation.from_euler("x", -90, degrees=True), scale=0.01))
    assert set(motion.names) == set(NAMES)
    _, places = motion.world()
    _, expected = reference().world()
    np.testing.assert_allclose(places[:, [motion.names.index(n) for n in NAMES]], expected, atol=1e-5)


def places_of(motion: SkeletonMotion) -> np.ndarray:
    return motion.world()[1][:, [motion.names.index(name) for name in NAMES]]


@pytest.mark.parametrize(("share", "warned"), [(0.008, False), (0.012, True)])
def test_joints_that_stand_off_their_bind_pose_by_a_hundredth(
    tmp_path: Path, share: float, warned: bool
) -> None:
    rest = reference().rest()
    off = share * float(np.ptp(rest, axis=0).max())

    def change(document: dict[str, Any]) -> None:
        node = next(node for node in document["nodes"] if node["name"] == "LeftHand")
        length = float(np.linalg.norm(node["translation"]))
        node["translation"] = [number * (1 + off / length) for number in node["translation"]]

    path = changed(tmp_path, change)
    with warnings.catch_warnings(record=True, action="always") as caught:
        read_motion(path)
    assert any("keep that of the bind pose: LeftHand" in str(w.message) for w in caught) == warned


@pytest.mark.parametrize(
    ("steps", "rate"),
    [
        ([4] * 50, 25),
        ([4] * 50 + [8, 12], 25),  # keys left out
        ([4] * 48 + [4.3, 5.7], 25),  # 96 % regular
        ([4] * 45 + [4.3, 5.7] * 3, 30),  # 90 %
        ([], 30),
    ],
)
def test_the_rate_of_keys(steps: list[float], rate: int) -> None:
    """Steps in hundredths of a second; 30 frames/s where no usual rate fits more than 95 % of them."""
    times = np.concatenate([[0], np.cumsum(steps)]) / 100
    assert reader._rate(times) == rate


def test_resampled_at_another_rate(tmp_path: Path) -> None:
    assert len(read_motion(saved(tmp_path), rate=60)) == 2 * FRAMES - 1
    halved = read_motion(saved(tmp_path), rate=15)
    np.testing.assert_allclose(places_of(halved), places_of(reference())[::2], atol=1e-5)


def test_steps_and_splines(tmp_path: Path) -> None:
    stepped = read_motion(saved(tmp_path, interpolation="STEP"), rate=60)
    hand = stepped.names.index("LeftHand")
    np.testing.assert_allclose(stepped.rotations[1, hand], stepped.rotations[0, hand], atol=1e-6)
    splined = read_motion(saved(tmp_path, interpolation="CUBICSPLINE"))
    np.testing.assert_allclose(places_of(splined), places_of(reference()), atol=1e-5)


def test_several_animations(tmp_path: Path) -> None:
    path = saved(tmp_path, second=True)
    with pytest.warns(FbaWarning, match="'dance' is read"):
        first = read_motion(path)
    second = read_motion(path, clip="rest")
    assert read_motion(path, clip=1).name == second.name == "rest"
    assert np.ptp(first.world()[1], axis=0).max() > 0.1
    assert np.ptp(second.world()[1], axis=0).max() < 1e-6
    with pytest.raises(ModelError, match="'dance', 'rest'"):
        read_motion(path, clip="jump")
    with pytest.raises(ModelError, match="no animation 7"):
        read_motion(path, clip=7)


def changed(tmp_path: Path, change: Any) -> Path:
    """The file with its JSON changed."""
    path = tmp_path / "changed.glb"
    path.write_bytes(edited(glb(second=False), change))
    return path


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_files_without_a_body(tmp_path: Path) -> None:
    def no_animation(document: dict[str, Any]) -> None:
        document.pop("animations")

    def no_names(document: dict[str, Any]) -> None:
        for number, node in enumerate(document["nodes"]):
            node["name"] = f"bone{number}"

    def nothing(document: dict[str, Any]) -> None:
        document.pop("animations")
        document.pop("skins")

    def circle(document: dict[str, Any]) -> None:
        document["nodes"][5]["children"] = [1]

    def flat(document: dict[str, Any]) -> None:
        document["nodes"][0]["scale"] = [0, 0, 0]

    for change, text in (
        (no_animation, "no animation turns"),
        (no_names, "no known skeleton family"),
        (nothing, "there is no skeleton"),
        (circle, "child"),
        (flat, "scale|coincide"),
    ):
        with pytest.raises((FormatError, ModelError), match=text):
            fba.read(changed(tmp_path, change))


def test_two_skeletons_in_one_file(tmp_path: Path) -> None:
    def another(document: dict[str, Any]) -> None:
        number = len(document["nodes"])
        document["nodes"].append({"name": "Prop"})
        document["skins"][0]["joints"].append(number)
        document["scenes"][0]["nodes"].append(number)
        document["skins"][0].pop("inverseBindMatrices")

    with pytest.warns(
        FbaWarning, match="several skeletons; 'Armature' is read, the others are left out: Prop"
    ):
        fba.read(changed(tmp_path, another))


def test_absurdly_long_animations(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"^\w+\.glb: .*more than 500000"):
        read_motion(saved(tmp_path), rate=10**9)
    with pytest.raises(ValueError, match="positive"):
        read_motion(saved(tmp_path), rate=0)


def test_a_message_names_the_file_once(tmp_path: Path) -> None:
    path = tmp_path / "bad.glb"
    path.write_bytes(b"glTF\2\0\0\0bad")
    with pytest.raises(FormatError) as caught:
        fba.read(path)
    assert str(caught.value).count("bad.glb") == 1
    assert str(caught.value).startswith(f"{path}: header: the file ends after 11 bytes")


def test_a_skin_of_the_upper_body_alone(tmp_path: Path) -> None:
    """Animated joints that no skin has are the body's, too; then the nodes' own pose is the rest pose."""

    def upper_body(document: dict[str, Any]) -> None:
        skin = document["skins"][0]
        skin["joints"] = [joint for joint in skin["joints"] if "Arm" in document["nodes"][joint]["name"]]
        bound = document["accessors"][skin["inverseBindMatrices"]]
        bound["count"] = len(skin["joints"])

    motion = read_motion(changed(tmp_path, upper_body))
    assert set(NAMES) <= set(motion.names)
    assert motion.posed
    np.testing.assert_allclose(places_of(motion), reference().world()[1], atol=1e-5)


def test_hips_carry_both_legs(tmp_path: Path) -> None:
    """What one family calls the hips is the back of a file whose own hips carry the legs."""

    def renamed(document: dict[str, Any]) -> None:
        words = {"Arm": "upperarm", "ForeArm": "lowerarm", "Hand": "hand", "UpLeg": "upperleg",
                 "Leg": "lowerleg", "Foot": "foot", "ToeBase": "toes"}  # fmt: skip
        for node in document["nodes"][1:]:
            for side in ("Left", "Right"):
                if (word := node["name"].removeprefix(side)) in words and word != node["name"]:
                    node["name"] = f"{words[word]}.{side[0].lower()}"
            node["name"] = {"Hips": "hips", "Spine": "spine", "Spine1": "chest", "Head": "head"}.get(
                node["name"], node["name"]
            )

    motion = read_motion(changed(tmp_path, renamed))
    assert {"upperleg.l", "lowerleg.r", "foot.l"} <= set(motion.names)
