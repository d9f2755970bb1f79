"""The default person, animated by a known motion and written as many makers do, comes back as it was."""

from dataclasses import replace

import numpy as np
import pytest

from fba.body import BapSolver, Skeleton
from fba.capture import from_skeleton
from fba.capture.bones import find_bones
from fba.errors import ModelError
from fba.formats.bvh._reader import parse
from zoo_bodies import Maker, truth, write

MIXAMO = (
    "Hips", "Spine Spine1 Spine2", "Neck", "Head", "{}Shoulder", "{}Arm", "{}ForeArm", "{}Hand", "{}UpLeg",
    "{}Leg", "{}Foot", "{}ToeBase",
)  # fmt: skip
BIOVISION = (
    "Hips", "Chest Chest2", "Neck", "Head", "{}Collar", "{}Shoulder", "{}Elbow", "{}Wrist", "{}Hip", "{}Knee",
    "{}Ankle", "{}Toe",
)  # fmt: skip
UPPER_LOWER = (
    "Hips", "Spine Chest", "Neck", "Head", "Shoulder_{}", "UpperArm_{}", "LowerArm_{}", "Hand_{}",
    "UpperLeg_{}",
    "LowerLeg_{}", "Foot_{}", "Toes_{}",
)  # fmt: skip
UNREAL = (
    "pelvis", "spine_01 spine_02 spine_03 spine_04 spine_05", "neck_01", "head", "clavicle_{}", "upperarm_{}",
    "lowerarm_{}", "hand_{}", "thigh_{}", "calf_{}", "foot_{}", "ball_{}",
)  # fmt: skip
BIPED = (
    "Bip01 Pelvis", "Bip01_Spine Bip01_Spine1 Bip01_Spine2", "Bip01 Neck", "Bip01 Head", "Bip01 {} Clavicle",
    "Bip01 {} UpperArm", "Bip01 {} Forearm", "Bip01 {} Hand", "Bip01 {} Thigh", "Bip01 {} Calf",
    "Bip01 {} Foot",
    "Bip01 {} Toe0",
)  # fmt: skip
DAZ = (
    "hip", "abdomen chest", "neck", "head", "{}collar", "{}shoulder", "{}elbow", "{}hand", "{}hip", "{}knee",
    "{}foot", "toe1-1.{}",
)  # fmt: skip
XSENS = (
    "Pelvis", "L5 L3 T12 T8", "Neck", "Head", "{}Shoulder", "{}UpperArm", "{}ForeArm", "{}Hand", "{}UpperLeg",
    "{}LowerLeg", "{}Foot", "{}Toe",
)  # fmt: skip
ACCLAIM = (
    "root", "lowerback upperback thorax", "lowerneck", "head", "{}clavicle", "{}humerus", "{}radius",
    "{}wrist",
    "{}femur", "{}tibia", "{}foot", "{}toes",
)  # fmt: skip
BLENDER = (
    "hips", "spine chest", "neck", "head", "shoulder.{}", "upper_arm.{}", "forearm.{}", "hand.{}", "thigh.{}",
    "shin.{}", "foot.{}", "toe.{}",
)  # fmt: skip
SMPL = (
    "pelvis", "spine1 spine2 spine3", "neck", "head", "{}_collar", "{}_shoulder", "{}_elbow",
    "{}_wrist", "{}_hip",
    "{}_knee", "{}_ankle", "{}_foot",
)  # fmt: skip
VROID = (
    "J_Bip_C_Hips", "J_Bip_C_Spine J_Bip_C_Chest J_Bip_C_UpperChest", "J_Bip_C_Neck", "J_Bip_C_Head",
    "J_Bip_{}_Shoulder", "J_Bip_{}_UpperArm", "J_Bip_{}_LowerArm", "J_Bip_{}_Hand", "J_Bip_{}_UpperLeg",
    "J_Bip_{}_LowerLeg", "J_Bip_{}_Foot", "J_Bip_{}_ToeBase",
)  # fmt: skip
CLINIC = (
    "Pelvis", "J_L5 J_L4 J_L3 J_L1 J_T12 J_T10 J_T6", "J_C7", "J_Head", "J_{}_Clavicle", "J_{}_Shoulder",
    "J_{}_Elbow", "J_{}_Hand", "J_{}_Hip", "J_{}_Knee", "J_{}_Ankle", "J_{}_Ball",
)  # fmt: skip
GERMAN = (
    "Becken", "Columna Brust", "Hals", "Kopf", "Schluesselbein_{}", "Oberarm_{}", "Unterarm_{}", "Hand_{}",
    "Oberschenkel_{}", "Unterschenkel_{}", "Fuss_{}", "Zehen_{}",
)  # fmt: skip
SPANISH = (
    "cadera", "columna pecho", "cuello", "cabeza", "clavicula_{}", "brazo_{}", "antebrazo_{}", "mano_{}",
    "muslo_{}", "rodilla_{}", "pie_{}", "",
)  # fmt: skip
BASIC = (
    "Root", "Torso", "Neck", "Head", "", "{}UpArm", "{}LowArm", "{}Hand", "{}UpLeg", "{}LowLeg", "{}Foot", "",
)  # fmt: skip
MHR = (
    "root", "c_spine0 c_spine1 c_spine2 c_spine3", "c_neck", "c_head", "{}_clavicle", "{}_uparm", "{}_lowarm",
    "{}_wrist", "{}_upleg", "{}_lowleg", "{}_foot", "{}_ball",
)  # fmt: skip
SHORT, DOT = ("L", "R"), ("l", "r")
FINGERS = "{side}Hand{finger}{number}"

MAKERS = (
    Maker("mixamo", tuple(f"mixamorig:{part}" for part in MIXAMO[:1]) + tuple(
        " ".join(f"mixamorig:{word}" for word in part.split()) for part in MIXAMO[1:]
    ), finger="mixamorig:{side}Hand{finger}{number}"),
    Maker("mixamo in metres, arms hanging", MIXAMO, rest="N", unit=1.0, order="XYZ"),
    Maker("lafan: along +x", (*MIXAMO[:1], "Spine Spine1 Spine2", *MIXAMO[2:]), rest="X", order="ZYX"),
    Maker("lafan: along +x, z up", MIXAMO, rest="X", up="z", order="ZYX"),
    Maker("rokoko: along +x, fingers", (*MIXAMO[:1], "Spine Spine1 Spine2 Spine3", *MIXAMO[2:]), rest="X",
          order="YXZ", finger=FINGERS),
    Maker("bandai-namco: mirrored, path in the hips", UPPER_LOWER, SHORT, rest="M", above="joint_Root"),
    Maker("bandai-namco, x up", UPPER_LOWER, SHORT, rest="M", up="x", above="joint_Root"),
    Maker("motionbuilder", tuple(f"Character1_{part}" if " " not in part else part for part in MIXAMO),
          rest="T", extra=("Character1_Reference",)),
    Maker("perception neuron", (*MIXAMO[:1], "Spine Spine1 Spine2 Spine3", *MIXAMO[2:]), order="YXZ",
          finger=FINGERS),
    Maker("biovision", BIOVISION, rest="N", unit=0.0254),
    Maker("biovision, A pose, z up", BIOVISION, rest="A", up="z"),
    Maker("optitrack", (*BIOVISION[:1], "Spine Spine1", *BIOVISION[2:]), order="XYZ", unit=0.001),
    Maker("unreal", UNREAL, DOT, rest="A", up="z", order="XYZ"),
    Maker("unreal, upper case", tuple(part.upper() for part in UNREAL), ("L", "R"), rest="A", up="z"),
    Maker("unreal with twist bones", UNREAL, DOT, rest="A", twist="{}_twist_01", extra=("ik_foot_root",
          "ik_hand_gun")),
    Maker("meta's human rig", MHR, DOT, rest="A", twist="{}_twist0_proc", finger="{side}_{finger}{number}",
          fingers=("thumb", "index", "middle", "ring", "pinky")),
    Maker("biped", BIPED, SHORT, rest="N", order="YZX"),
    Maker("biped along +x", BIPED, SHORT, rest="X", up="z", unit=0.0254),
    Maker("daz in lower case", DAZ, DOT, rest="T", order="XZY"),
    Maker("poser", ("hip", "abdomen chest", "neck", "head", "{}Collar", "{}Shldr", "{}ForeArm", "{}Hand",
                    "{}Thigh", "{}Shin", "{}Foot", "{}Toe"), DOT, order="XZY"),
    Maker("xsens", XSENS, rest="T", order="YXZ"),
    Maker("xsens, z up, N pose", XSENS, rest="N", up="z"),
    Maker("acclaim", ACCLAIM, DOT, rest="T", order="XYZ", unit=0.056444),
    Maker("blender", BLENDER, SHORT, rest="A", up="z", unit=1.0, order="XYZ"),
    Maker("rigify with its prefix", tuple(" ".join(f"DEF-{w}" for w in part.split()) for part in BLENDER),
          SHORT, rest="A", unit=1.0),
    Maker("smpl", SMPL, ("left", "right"), unit=1.0, order="XYZ"),
    Maker("vroid", VROID, SHORT, unit=1.0, finger="J_Bip_{side}_{finger}{number}",
          fingers=("Thumb", "Index", "Middle", "Ring", "Little")),
    Maker("clinic: seven vertebrae, z up", CLINIC, SHORT, rest="N", up="z", unit=0.001),
    Maker("german", GERMAN, ("links", "rechts"), rest="T"),
    Maker("spanish, without toes", SPANISH, ("izquierda", "derecha"), rest="A", unit=1.0),
    Maker("one spine joint, neither clavicles nor toes", BASIC, rest="N"),
    Maker("one spine joint, along +x", BASIC, rest="X"),
    Maker("hands with numbered fingers", (*UPPER_LOWER[:8], *UPPER_LOWER[8:]), SHORT, rest="T",
          finger="finger{finger}-{number}.{side}", fingers=("1", "2", "3", "4", "5")),
    Maker("extra joints everywhere", MIXAMO, rest="T", extra=("Tail", "Sword", "Backpack"),
          twist="{}Twist"),
    Maker("numbered limbs", ("torso_joint_1", "torso_joint_2 torso_joint_3", "neck_joint_1", "head_joint",
          "clavicle_{}", "arm_joint_{}_1", "arm_joint_{}_2", "arm_joint_{}_3", "leg_joint_{}_1",
          "leg_joint_{}_2", "leg_joint_{}_3", "leg_joint_{}_5"), DOT, rest="T"),
    Maker("mirrored, fingers, y up", MIXAMO, rest="M", finger=FINGERS),
    Maker("fitted to positions: hips turned aside, thighs turned back", MIXAMO, aside=-70.0),
)  # fmt: skip
FINGER_NAMES = ("thumb", "index", "middle", "ring", "pinky")
BONES = (
    ("shoulder", "elbow"), ("elbow", "wrist"), ("hip", "knee"), ("knee", "ankle"),
)  # fmt: skip


def between(a: np.ndarray, b: np.ndarray) -> float:
    """Largest angle in degrees between vectors (T, 3)."""
    sine = np.linalg.norm(np.cross(a, b), axis=1)
    return float(np.degrees(np.arctan2(sine, np.sum(a * b, axis=1))).max())


def turned(a: np.ndarray, b: np.ndarray) -> float:
    """Largest angle in degrees between rotations (T, 3, 3)."""
    return float(np.degrees(_angles(np.swapaxes(a, 1, 2) @ b)).max())


def _angles(matrices: np.ndarray) -> np.ndarray:
    return np.arccos(np.clip((np.trace(matrices, axis1=1, axis2=2) - 1) / 2, -1.0, 1.0))


@pytest.mark.parametrize("name", ["mixamo", "lafan: along +x", "biped", "one spine joint, along +x"])
def test_a_person_whose_left_is_called_right_is_refused(name: str) -> None:
    maker = next(maker for maker in MAKERS if maker.name == name)
    text, _ = write(replace(maker, sides=(maker.sides[1], maker.sides[0])))
    with pytest.raises(ModelError, match="left and right are swapped"):
        from_skeleton(parse(text))


def test_toes_with_another_name_than_the_family_has() -> None:
    """LaFAN1 calls the toes "LeftToe", where others of its family say "LeftToeBase"."""
    toes = replace(MAKERS[2], parts=(*MIXAMO[:-2], "{}Foot", "{}Toe"))
    found = find_bones(parse(write(toes)[0]), None, Skeleton.default())
    assert found.family == "arm"
    assert {"l_metatarsal", "r_metatarsal"} <= found.joints.keys()


def test_vertebrae_up_to_the_atlas_carry_the_head() -> None:
    """Nothing is called neck or head."""
    parts = (*CLINIC[:2], "J_C7", "J_Atlas", *CLINIC[4:])
    text, _ = write(replace(next(maker for maker in MAKERS if maker.parts == CLINIC), parts=parts))
    mapped = find_bones(parse(text), None, Skeleton.default()).joints
    names = parse(text).names
    assert (names[mapped["skullbase"]], names[mapped["vc7"]]) == ("J_Atlas", "J_C7")


def test_there_are_thirty_makers() -> None:
    assert len({maker.name for maker in MAKERS}) >= 30
    assert len({maker.parts for maker in MAKERS}) >= 15


@pytest.mark.parametrize("maker", MAKERS, ids=lambda maker: maker.name)
def test_a_person_is_restored(maker: Maker) -> None:
    wanted, names = truth()
    text, joints = write(maker)
    animation = from_skeleton(parse(text))
    found = BapSolver().pose(animation.body.values)
    number = {name: n for n, name in enumerate(names)}
    known = set(joints.values())
    errors: dict[str, float] = {}
    for side in "lr":
        for a, b in BONES:
            ends = [number[f"{side}_{a}"], number[f"{side}_{b}"]]
            lines = [
                matrices[:, ends[1], :3, 3] - matrices[:, ends[0], :3, 3] for matrices in (wanted, found)
            ]
            errors[f"direction {side}_{a}"] = between(*lines) / 2.0
        for joint in ("shoulder", "elbow", "wrist", "hip", "knee"):
            n = number[f"{side}_{joint}"]
            errors[f"twist {side}_{joint}"] = turned(wanted[:, n, :3, :3], found[:, n, :3, :3]) / 5.0
        n = number[f"{side}_ankle"]
        errors[f"place {side}_ankle"] = (
            np.linalg.norm(wanted[:, n, :3, 3] - found[:, n, :3, 3], axis=1).max() / 0.01
        )
        if f"{side}_metatarsal" in known or maker.rest in "NAT":  # else nothing says where a foot points
            errors[f"foot frame {side}"] = turned(wanted[:, n, :3, :3], found[:, n, :3, :3]) / 5.0
        if f"{side}_sternoclavicular" in known:
            ends = [number[f"{side}_sternoclavicular"], number[f"{side}_shoulder"]]
            lines = [m[:, ends[1], :3, 3] - m[:, ends[0], :3, 3] for m in (wanted, found)]
            errors[f"clavicle {side}"] = between(*lines) / 2.0
        for finger in FINGER_NAMES:
            if f"{side}_{finger}1" not in known:
                continue
            for a, b in ((1, 2), (2, 3)):
                ends = [number[f"{side}_{finger}{k}"] for k in (a, b)]
                lines = [m[:, ends[1], :3, 3] - m[:, ends[0], :3, 3] for m in (wanted, found)]
                errors[f"{finger}{a} {side}"] = between(*lines) / 2.0
                ball = number[f"{side}_{finger}{a}"]
                errors[f"twist {finger}{a} {side}"] = (
                    turned(wanted[:, ball, :3, :3], found[:, ball, :3, :3]) / 5.0
                )
    for joint in ("hip", "shoulder"):
        if joint == "shoulder" and not known & {"vt6", "vt10"}:
            continue  # the file's shoulders turn with the loins
        ends = [number[f"{side}_{joint}"] for side in "lr"]
        rows = [matrices[:, ends[0], :3, 3] - matrices[:, ends[1], :3, 3] for matrices in (wanted, found)]
        errors[f"row of {joint}s"] = between(*rows) / 3.0
    if "skullbase" in known:
        n = number["skullbase"]
        errors["head"] = turned(wanted[:, n, :3, :3], found[:, n, :3, :3]) / 5.0
    errors["root"] = np.linalg.norm(wanted[:, 0, :3, 3] - found[:, 0, :3, 3], axis=1).max() / 0.01
    bad = {what: round(float(error), 2) for what, error in errors.items() if error > 1.0}
    assert not bad, f"{maker.name}: times the bound: {bad}"
    assert Skeleton.default().names == names
