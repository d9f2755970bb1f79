"""What becomes of spines, clavicles, forearms, fingers and feet; families of names; the report."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_bodies import motion
from fba.animation import Animation, FaceTrack
from fba.body import BapSolver, Skeleton
from fba.capture import SkeletonMotion, from_skeleton, retarget_report
from fba.capture import _skeleton as skeleton
from fba.capture.bones import families, match
from fba.errors import ModelError
from fba.parameters import bap_numbers, baps, joints

NUMBERS = bap_numbers()
SPINE = [j.name for j in joints() if j.name.startswith(("vl", "vt", "vc", "skullbase"))]


def value(animation, name: str) -> np.ndarray:  # type: ignore[no-untyped-def]
    return animation.body.values[:, NUMBERS[name] - 1]


def sent(animation) -> set[str]:  # type: ignore[no-untyped-def]
    return {baps()[column].joint for column in np.flatnonzero(animation.body.mask[0])}


def with_hands(captured: SkeletonMotion, curl: float) -> SkeletonMotion:
    """A hand with an index finger of three joints on the left, hanging down, curled (degrees a joint)."""
    names = [*captured.names, "LeftHandIndex1", "LeftHandIndex2", "LeftHandIndex3", "LeftHandIndex4"]
    hand = captured.names.index("LeftHand")
    count = len(captured.names)
    offsets = np.vstack([captured.offsets, [[0, -0.08, 0.02], [0, -0.04, 0], [0, -0.03, 0], [0, -0.02, 0]]])
    turned = np.zeros((len(captured), 4, 4))
    bend = Rotation.from_euler("z", -curl, degrees=True).as_quat()[[3, 0, 1, 2]]  # to the right: the palm
    turned[:, :3] = bend
    turned[:, 3, 0] = 1
    return SkeletonMotion(
        tuple(names), np.array([*captured.parents, hand, count, count + 1, count + 2]), offsets,
        np.concatenate([captured.rotations, turned], axis=1), captured.positions, captured.rate,
    )  # fmt: skip


def test_spine_bends_in_all_vertebrae() -> None:
    """The chest bows by 48 degrees against the hips, in two joints of the source: all vertebrae share it."""
    bow = {
        "Spine": Rotation.from_euler("x", [24], degrees=True),
        "Spine1": Rotation.from_euler("x", 24, degrees=True),
    }
    upright, bowed = (from_skeleton(motion("standing", turns=t), spine="full") for t in ({}, bow))
    assert sent(bowed) >= set(SPINE)
    tilts = np.array([value(bowed, f"{j}_tilt")[0] - value(upright, f"{j}_tilt")[0] for j in SPINE]) * 1e-5
    assert np.degrees(tilts.sum()) + np.degrees(value(bowed, "HumanoidRoot_rt_body_tilt")[0] * -1e-5) < -24
    largest = np.degrees(np.abs(tilts)).max()
    joined = from_skeleton(motion("standing", turns=bow), spine="joints")
    plain = from_skeleton(motion("standing"), spine="joints")
    at_joints = max(
        abs(int(value(joined, f"{j}_tilt")[0]) - int(value(plain, f"{j}_tilt")[0])) for j in SPINE
    )
    assert np.degrees(at_joints * 1e-5) > 1.4 * largest
    for animation in (bowed, joined):
        report = retarget_report(motion("standing", turns=bow), animation)
        spine = [bone for bone in report.bones if bone.joint in ("HumanoidRoot", *SPINE)]
        assert len(spine) == 4
        assert max(bone.worst for bone in spine) < 0.01


@pytest.mark.parametrize(
    ("groups", "expected"), [("simple", 4), (2, 9), (3, 15), (4, 21), (5, 25), ("full", 25)]
)
def test_groups_of_the_spine(groups: str | int, expected: int) -> None:
    turns = {"Spine1": Rotation.from_euler("xyz", [10, 20, 5], degrees=True)}
    animation = from_skeleton(motion("standing", turns=turns), spine=groups)
    turning = sent(animation) & set(SPINE)
    wanted = {
        f"Spine{n}"
        for n in range(1, (5 if groups == "full" else 1 if groups == "simple" else int(groups)) + 1)
    }
    assert turning <= {b.joint for b in baps() if b.group_name in wanted}
    assert len(turning) <= expected
    head = BapSolver().pose(animation.body.values)[0, Skeleton.default().number("skullbase"), :3, :3]
    turned = (Rotation.from_matrix(head) * turns["Spine1"].inv()).magnitude()
    assert np.degrees(turned) < 0.01  # the head's own rotation is kept, however few vertebrae turn


def test_wrong_groups() -> None:
    for bad in (6, -1, "half", 2.5):
        with pytest.raises(ValueError, match="spine must be"):
            from_skeleton(motion("standing"), spine=bad)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="ground must be"):
        from_skeleton(motion("standing"), ground="sea")


@pytest.mark.parametrize("wrong", [{"spine": 9}, {"ground": "sea"}, {"origin": "home"}, {"scale": -1.0}])
def test_options_are_checked_before_any_work(wrong: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    def work(*_: object, **__: object) -> None:
        raise AssertionError("the work has begun")

    monkeypatch.setattr(skeleton, "prepare", work)
    with pytest.raises(ValueError, match=f"{next(iter(wrong))} must be"):
        from_skeleton(motion("T", 2), **wrong)


def test_both_clavicle_joints_raise_the_shoulder() -> None:
    shrug = motion("standing", turns={"LeftShoulder": Rotation.from_euler("z", 30, degrees=True)})
    animation = from_skeleton(shrug)
    assert value(animation, "l_sternoclavicular_abduct")[0] > 10_000
    assert value(animation, "l_acromioclavicular_abduct")[0] > 10_000
    clavicle = next(b for b in retarget_report(shrug, animation).bones if b.joint == "l_sternoclavicular")
    assert clavicle.worst < 0.01


def test_forearm_takes_half_of_the_hands_twist() -> None:
    elbow_bent = {"LeftForeArm": Rotation.from_euler("x", -60, degrees=True)}
    twisted = elbow_bent | {"LeftHand": Rotation.from_euler("y", -80, degrees=True)}
    before, after = (from_skeleton(motion("standing", turns=t)) for t in (elbow_bent, twisted))
    elbow = value(after, "l_elbow_twisting")[0] - value(before, "l_elbow_twisting")[0]
    wrist = value(after, "l_wrist_twisting")[0] - value(before, "l_wrist_twisting")[0]
    assert np.degrees((elbow + wrist) * 1e-5) == pytest.approx(80, abs=3)
    assert np.degrees(elbow * 1e-5) == pytest.approx(40, abs=5)


def test_fingers_curl_towards_the_palm() -> None:
    animation = from_skeleton(with_hands(motion("standing"), 30))
    for joint in ("l_index1", "l_index2"):
        assert np.degrees(value(animation, f"{joint}_flexion")[0] * 1e-5) == pytest.approx(-30, abs=6)
    report = retarget_report(with_hands(motion("standing"), 30), animation)
    found = {bone.joint: bone.worst for bone in report.bones}
    assert found["l_index1"] < 2
    assert found["l_index2"] < 2


def test_feet_follow_the_ground_and_leaps() -> None:
    """A leap of 30 cm, from a source whose ground is 10 cm up and whose ankles are 12 cm high."""
    standing = motion("standing", 60)
    leap = np.zeros((60, 3))
    leap[20:40, 1] = 0.3 * np.sin(np.linspace(0, np.pi, 20)) ** 2
    captured = replace(standing, positions=standing.positions + leap)
    scale = (0.42695 + 0.43398) / 0.9
    for ground, floor in (("floor", 0.0), ("source", -0.02 * scale)):  # toes, at 1 - 0.05 - 0.9 - 0.07
        animation = from_skeleton(captured, ground=ground)
        matrices = BapSolver().pose(animation.body.values)
        ball = matrices[:, Skeleton.default().number("l_metatarsal"), 1, 3]
        assert abs(ball[:15] - 0.0092 - floor).max() < 0.01
        assert ball[30] - ball[0] == pytest.approx(0.3 * scale, abs=0.01)
    report = retarget_report(captured, from_skeleton(captured))
    assert report.feet.ground == pytest.approx(-0.02 * scale, abs=1e-3)
    assert report.feet.worst < 0.01
    assert report.feet.within == 1


def test_report_lists_what_is_missing_and_unused() -> None:
    captured = motion("T")
    renamed = replace(captured, names=tuple("Tail" if n == "Head" else n for n in captured.names))
    report = retarget_report(renamed, from_skeleton(renamed))
    assert (report.family, report.unused) == ("arm", ("Tail",))
    assert {"skullbase", "vt3", "l_index1"} <= set(report.missing)
    assert "l_elbow" not in report.missing
    still = from_skeleton(captured)
    bent = motion("T", turns={"LeftForeArm": Rotation.from_euler("y", -25, degrees=True)})
    elbow = next(b for b in retarget_report(bent, still).bones if b.joint == "l_elbow")
    assert elbow.worst == pytest.approx(25, abs=0.5)
    assert (elbow.source, elbow.aim, elbow.frame) == ("LeftForeArm", "l_wrist", 0)


def test_report_at_another_rate_and_without_body() -> None:
    captured = motion("T", 8, rate=Fraction(60))
    assert retarget_report(captured, from_skeleton(captured, 30)).frames == 4
    face = np.zeros((8, 68), dtype=np.int32), np.zeros((8, 68), dtype=bool)
    with pytest.raises(ModelError, match="no body"):
        retarget_report(captured, Animation(60, np.arange(8), FaceTrack(*face), None, ""))


FAMILIES = {
    "cmu": (
        "Hips LHipJoint RHipJoint LowerBack Spine Spine1 Neck Neck1 Head LeftShoulder LeftArm "
        "LeftForeArm LeftHand LeftFingerBase LThumb RightShoulder RightArm RightForeArm RightHand "
        "LeftUpLeg LeftLeg LeftFoot LeftToeBase RightUpLeg RightLeg RightFoot RightToeBase",
        {"LowerBack": "vl5", "LThumb": "l_thumb1"},
    ),
    "arm": (
        "mixamorig:Hips mixamorig:Spine mixamorig:Spine1 mixamorig:Spine2 mixamorig:Neck "
        "mixamorig:Head mixamorig:LeftShoulder mixamorig:LeftArm mixamorig:LeftForeArm "
        "mixamorig:LeftHand mixamorig:LeftHandThumb1 mixamorig:RightUpLeg mixamorig:RightLeg "
        "mixamorig:RightFoot mixamorig:RightToeBase",
        {"mixamorig:LeftArm": "l_shoulder", "mixamorig:LeftShoulder": "l_sternoclavicular"},
    ),
    "biped": (
        "Bip01|Bip01 Pelvis|Bip01 Spine|Bip01 Spine1|Bip01 Neck|Bip01 Head|Bip01 L Clavicle|"
        "Bip01 L UpperArm|Bip01 L Forearm|Bip01 L Hand|Bip01 L Finger0|Bip01 L Finger1|"
        "Bip01 L Finger11|Bip01 R Thigh|Bip01 R Calf|Bip01 R Foot|Bip01 R Toe0",
        {"Bip01 Pelvis": "HumanoidRoot", "Bip01 L Finger11": "l_index2", "Bip01 L Finger0": "l_thumb1"},
    ),
    "smpl": (
        "Pelvis L_Hip R_Hip Spine1 L_Knee R_Knee Spine2 L_Ankle R_Ankle Spine3 L_Foot R_Foot Neck "
        "L_Collar R_Collar Head L_Shoulder R_Shoulder L_Elbow R_Elbow L_Wrist R_Wrist",
        {"L_Foot": "l_metatarsal", "R_Hip": "r_hip"},
    ),
    "smplx": (
        "pelvis left_hip right_hip spine1 left_knee right_knee spine2 left_ankle right_ankle spine3 "
        "neck left_collar head left_shoulder right_shoulder left_index1",
        {"left_index1": "l_index1", "left_hip": "l_hip"},
    ),
    "rokoko": (
        "Hips Spine Spine1 Spine2 Neck Head LeftShoulder LeftArm LeftForeArm LeftHand LeftThigh "
        "LeftShin LeftFoot LeftToe RightThigh RightShin RightFoot RightToe",
        {"LeftShin": "l_knee", "RightToe": "r_metatarsal"},
    ),
    "unreal": (
        "root pelvis spine_01 spine_02 spine_03 neck_01 head clavicle_l upperarm_l lowerarm_l hand_l "
        "index_01_l thigh_r calf_r foot_r ball_r",
        {"upperarm_l": "l_shoulder", "calf_r": "r_knee"},
    ),
    "unity": (
        "Hips Spine Chest UpperChest Neck Head LeftShoulder LeftUpperArm LeftLowerArm LeftHand "
        "LeftUpperLeg LeftLowerLeg LeftFoot LeftToes",
        {"LeftUpperLeg": "l_hip", "LeftUpperArm": "l_shoulder"},
    ),
    "vroid": (
        "Root J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Chest J_Bip_C_Neck J_Bip_C_Head J_Bip_L_Shoulder "
        "J_Bip_L_UpperArm J_Bip_L_LowerArm J_Bip_L_Hand J_Bip_R_UpperLeg J_Bip_R_LowerLeg",
        {"J_Bip_R_LowerLeg": "r_knee"},
    ),
    "rigify": (
        "spine spine.001 spine.002 spine.003 spine.004 spine.006 shoulder.L upper_arm.L forearm.L "
        "hand.L thigh.R shin.R foot.R toe.R",
        {"spine": "HumanoidRoot", "upper_arm.L": "l_shoulder", "toe.R": "r_metatarsal"},
    ),
    "acclaim": (
        "root lowerback upperback thorax lowerneck upperneck head lclavicle lhumerus lradius lwrist "
        "rfemur rtibia rfoot rtoes",
        {"lhumerus": "l_shoulder", "rtibia": "r_knee"},
    ),
    "mhr": (
        "body_world root l_upleg l_lowleg l_foot l_talocrural l_ball l_upleg_twist0_proc c_spine0 c_spine1 "
        "c_spine2 c_spine3 r_clavicle r_uparm r_lowarm r_wrist_twist r_wrist r_index1 c_neck c_head",
        {"r_lowarm": "r_elbow", "l_ball": "l_metatarsal", "c_spine3": "vt4"},
    ),
    "h-anim": (
        "HumanoidRoot sacroiliac l_hip l_knee l_ankle vl5 vt12 vc4 skullbase l_shoulder l_elbow l_wrist",
        {"vt12": "vt12", "l_elbow": "l_elbow"},
    ),
}


@pytest.mark.parametrize("family", FAMILIES)
def test_families_of_names(family: str) -> None:
    text, expected = FAMILIES[family]
    names = text.split("|") if "|" in text else text.split()
    found, mapped = match(names)
    assert found == family
    by_source = {names[number]: joint for joint, number in mapped.items()}
    for source, joint in expected.items():
        assert by_source[source] == joint
    assert "HumanoidRoot" in mapped


def test_every_family_names_joints_of_the_body_once() -> None:
    body = {joint.name for joint in joints()}
    for family, table in families().items():
        assert set(table.values()) <= body, family
        assert "HumanoidRoot" in table.values()
        for name, joint in table.items():
            twin = {"l_": "r_", "r_": "l_"}.get(joint[:2])
            if twin:
                assert twin + joint[2:] in table.values(), (family, name)


def test_too_many_frames() -> None:
    still = motion("T", 2, rate=1)
    for rate in (10**6, 10**12):
        with pytest.raises(ModelError, match="500000"):
            from_skeleton(still, rate)


def test_bones_without_length() -> None:
    """Joints that coincide have no direction between them; the rest still follows."""
    whole = motion("T", 3, turns={"LeftForeArm": Rotation.from_euler("y", -40, degrees=True)})
    offsets = np.array(whole.offsets)
    for name in ("Spine1", "LeftToeBase", "RightHand"):
        offsets[whole.names.index(name)] = 0
    flat = replace(whole, offsets=offsets)
    report = retarget_report(flat, from_skeleton(flat))
    bones = {bone.joint for bone in report.bones}
    assert not bones & {"vl5", "l_ankle", "r_elbow"}
    assert {"l_elbow", "l_knee", "r_ankle"} <= bones
    assert report.worst < 0.5


def test_few_vertebrae_keep_neck_and_chest() -> None:
    """The simple spine's four vertebrae point neck and chest as the source's; nine, all bones."""
    count = 12
    generator = np.random.default_rng(8)
    turns = {
        name: Rotation.from_rotvec(generator.uniform(-0.3, 0.3, (count, 3)))
        for name in ("Spine", "Spine1", "Neck", "Head")
    }
    captured = motion("standing", count, turns=turns)
    for spine, worst in (("simple", 0.1), (2, 0.1), ("full", 0.01)):
        bones = {
            bone.joint: bone.worst
            for bone in retarget_report(captured, from_skeleton(captured, spine=spine)).bones
        }
        assert bones["vc7"] < worst, spine  # neck to head
        assert bones["vl1"] < worst, spine


@pytest.mark.parametrize(
    ("axis", "worst"), [((1, 0, 0), 7.0), ((0, 0, 1), 7.5), ((0.3, 0.6, 0.7), 21.0)], ids=str
)
def test_thumbs_follow(axis: tuple[float, float, float], worst: float) -> None:
    """A T-posed hand's thumb curls by 120 degrees in all, about any of the axes that rigs have.

    Between what the bones do and what thumbs and I planes reach: the sample performance holds the other end
    (tests/test_samples.py).
    """
    count = 30
    along = np.array([0.6, -0.35, 0.72]) / np.linalg.norm([0.6, -0.35, 0.72])
    about = np.array(axis) - along * (along @ axis)
    about /= np.linalg.norm(about)
    hand = with_hands(motion("T", count), 0)
    names = tuple(name.replace("Index", "Thumb") for name in hand.names)
    offsets = np.array(hand.offsets)
    first = names.index("LeftHandThumb1")
    offsets[first:] = [[0.03, -0.01, 0.03], along * 0.045, along * 0.035, along * 0.03]
    turned = np.array(hand.rotations)
    for joint, share in ((first, 0.4), (first + 1, 1.0), (first + 2, 1.0)):
        curl = Rotation.from_rotvec(np.outer(np.radians(np.linspace(0, 50, count)) * share, about))
        turned[:, joint] = curl.as_quat()[:, [3, 0, 1, 2]]
    captured = replace(hand, names=names, offsets=offsets, rotations=turned)
    report = retarget_report(captured, from_skeleton(captured))
    thumb = [bone for bone in report.bones if "thumb" in bone.joint]
    assert len(thumb) == 2
    assert max(bone.worst for bone in thumb) < worst
    assert max(bone.mean for bone in thumb) < 0.6 * worst
