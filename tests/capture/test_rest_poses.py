"""What is found out about a capture before it is retargeted: bones, the way up, the rest pose.

Which way is up, of people in all postures, in files of all axes; nobody is stood up who lies.
"""

import warnings
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_bodies import motion
from fba.body import BapSolver, Skeleton
from fba.capture import SkeletonMotion, from_skeleton
from fba.capture._named_bones import NamedJoints, read
from fba.capture.bones import find_bones
from fba.capture.comparison import find_up
from fba.capture.preparation import prepare
from fba.errors import FbaWarning, ModelError
from postures import POSTURES, UPS, along_x, turned, turned_by_the_root

UPRIGHT = {"walks", "climbs", "sits", "dances"}
TRUNKS = {"walks": 1.0, "lies": 0.0, "lies_on_a_side": 0.0, "rolls": 0.0, "crawls": 0.0, "swims": 0.0,
          "flies": 0.0, "walks_on_hands": -1.0, "stands_on_hands": -1.0, "climbs": 1.0, "sits": 1.0,
          "spins_on_the_back": 0.17}  # fmt: skip
"""Sine of the trunk's angle above the ground, in all frames: as the generator turns the hips."""
SKELETON = Skeleton.default()


@pytest.mark.parametrize(
    ("name", "side", "part"),
    [
        ("mixamorig:LeftUpLeg", "l", "thigh"), ("thigh_r", "r", "thigh"), ("rshldr", "r", "upperarm"),
        ("Bip01 R Calf", "r", "shank"), ("J_Bip_L_LowerArm", "l", "forearm"), ("rcollar", "r", "clavicle"),
        ("DEF-upper_arm.L", "l", "upperarm"), ("leftforearm", "l", "forearm"),
        ("Unterarm_links", "l", "forearm"),
        ("LEFT_HAND", "l", "hand"), ("RightForeFoot", "r", "toe"), ("左足首", "l", "foot"),
    ],
)  # fmt: skip
def test_names_say_side_and_part(name: str, side: str, part: str) -> None:
    found = read(name)
    assert (found.side, found.parts.get(part)) == (side, 2)
    assert not found.helper


@pytest.mark.parametrize("name", ["upperarm_twist_01_l", "LeftHandEnd", "ik_hand_gun", "eye.l"])
def test_names_of_helpers_name_no_bones(name: str) -> None:
    assert read(name).helper


def test_the_motion_says_which_way_is_up() -> None:
    """A file whose offsets rest y up, but whose root turns everybody z up, as Blender writes them."""
    turn = Rotation.from_euler("x", 90, degrees=True)
    captured = motion("T", 8, turns={"Hips": turn})
    captured = replace(captured, positions=np.tile([0.0, 0.0, 1.0], (8, 1)))
    with pytest.warns(FbaWarning, match=r"up is taken to be \+z: people stand along it, .* with up='\+y'"):
        ready = prepare(captured, SKELETON)
    assert ready.up == "+z"
    assert ready.motion.positions[0] == pytest.approx([0, 1, 0])
    assert prepare(captured, SKELETON, up="+y").up == "+y"


def test_people_stand_at_the_height_0() -> None:
    """Somebody who stands still, z up, could lie on a wall, as far as their rest goes."""
    turn = Rotation.from_euler("xz", [90, 180], degrees=True)
    captured = motion("A", 8, turns={"Hips": turn})
    still = replace(captured, positions=np.tile([0.0, 0.0, 1.0], (8, 1)))
    with pytest.warns(FbaWarning, match=r"up is taken to be \+z: people stand along it, at height 0"):
        assert prepare(still, SKELETON).up == "+z"
    on_the_floor = replace(captured, positions=np.tile([0.0, 0.1, 0.3], (8, 1)))
    with pytest.warns(FbaWarning, match=r"up is taken to be \+y: joints rest on a floor along it"):
        assert prepare(on_the_floor, SKELETON).up == "+y"


LEAP = {"Hips": Rotation.from_euler("x", 90, degrees=True),
        "LeftUpLeg": Rotation.from_euler("x", -100, degrees=True),
        "RightUpLeg": Rotation.from_euler("x", -100, degrees=True)}  # fmt: skip
"""Somebody who lies in the air, on the belly, with legs that hang down."""


def test_only_somebody_who_stands_overrules_the_file() -> None:
    """One pose of a dancer, whose trunk lies level, does not say that the rest pose lies."""
    captured = motion("T", 1, turns=LEAP)
    captured = replace(captured, positions=np.array([[0.0, 0.0, 1.0]]))
    with pytest.warns(FbaWarning, match=r"no floor along any axis|trunks point along"):
        assert prepare(captured, SKELETON).up == "+y"
    assert prepare(replace(captured, up="+y"), SKELETON, rest="file").up == "+y"
    mapped = prepare(captured, SKELETON, up="+y").mapped
    assert find_up(replace(captured, up="+y"), mapped) == pytest.approx(np.eye(3))


def test_the_report_finds_up_by_those_who_stand() -> None:
    """A downward dog reaches from feet to head along the floor, and says nothing; who stands does."""
    dog = {"Hips": Rotation.from_euler("x", 130, degrees=True),
           "LeftUpLeg": Rotation.from_euler("x", -80, degrees=True),
           "RightUpLeg": Rotation.from_euler("x", -80, degrees=True)}  # fmt: skip
    stretched = motion("T", 3, turns=dog)
    mapped = find_bones(stretched, None, SKELETON).joints
    assert find_up(replace(stretched, up="+y"), mapped) == pytest.approx(np.eye(3))
    lain = motion("T", 1, turns={"Hips": Rotation.from_euler("x", -90, degrees=True)})
    both = replace(stretched, rotations=np.concatenate([stretched.rotations, lain.rotations]),
                   positions=np.concatenate([stretched.positions, lain.positions]))  # fmt: skip
    assert find_up(both, mapped)[1] == pytest.approx([0, 0, -1])


def test_what_a_format_declares_is_not_overruled() -> None:
    """Somebody whom a VRM animation, or a glTF file, lays down lies."""
    lying = motion("T", 3, turns={"Hips": Rotation.from_euler("x", 90, degrees=True)})
    assert prepare(replace(lying, up="+y"), SKELETON).up == "+y"
    names = find_bones(lying, None, SKELETON).joints.items()
    declared = replace(lying, up="+y", declared={lying.names[number]: joint for joint, number in names})
    assert prepare(declared, SKELETON).up == "+y"
    assert find_up(declared, dict(names)) == pytest.approx(np.eye(3))


def test_nobody_stands_up_along_x() -> None:
    """An animal on four legs, whose trunk a guess would put upright: no program's people stand along x."""
    on_four = {name: turn for name, turn in LEAP.items() if name != "Hips"}
    turned = {"Hips": Rotation.from_euler("z", -90, degrees=True)} | on_four
    captured = motion("T", 3, turns=turned)
    heap = np.array(captured.offsets)
    heap[[captured.names.index(name) for name in ("LeftLeg", "RightLeg")]] *= [1, -1, 1]  # no rest pose
    with pytest.raises(ModelError, match="nobody ever stands"):
        prepare(replace(captured, offsets=heap), SKELETON)


def test_shoulders_rest_where_arms_hang() -> None:
    """Clavicles that the file turns up by 30 degrees all the time are as in the default posture."""
    shrug = {"LeftShoulder": Rotation.from_euler("z", 30, degrees=True),
             "RightShoulder": Rotation.from_euler("z", -30, degrees=True),
             "LeftArm": Rotation.from_euler("z", -30, degrees=True),
             "RightArm": Rotation.from_euler("z", 30, degrees=True)}  # fmt: skip
    matrices = [
        BapSolver().pose(from_skeleton(motion("standing", 6, turns=turns)).body.values)
        for turns in ({}, shrug)
    ]
    for side in "lr":
        ends = [SKELETON.number(f"{side}_{joint}") for joint in ("sternoclavicular", "shoulder")]
        lines = [m[0, ends[1], :3, 3] - m[0, ends[0], :3, 3] for m in matrices]
        lines = [line / np.linalg.norm(line) for line in lines]
        assert np.degrees(np.arccos(lines[0] @ lines[1])) == pytest.approx(5.0, abs=0.7)  # a posture may be


def test_shoulders_do_not_turn_with_the_head() -> None:
    """A neck turned by 60 degrees leaves the vertebra that carries the clavicles where it is."""
    turned = motion("standing", 2, turns={"Neck": Rotation.from_euler("y", 60, degrees=True)})
    matrices = BapSolver().pose(from_skeleton(turned).body.values)[0, :, :3, :3]
    angles = np.degrees(Rotation.from_matrix(matrices).as_rotvec()[:, 1])  # to the left
    assert angles[SKELETON.number("vt1")] == pytest.approx(0, abs=1)
    assert angles[SKELETON.number("skullbase")] == pytest.approx(60, abs=1)


def test_a_motion_that_says_nothing_is_refused() -> None:
    """All bones along +x, and somebody who stands still with straight limbs on their side."""
    captured = motion("T", 4)
    offsets = np.array(captured.offsets)
    lengths = np.linalg.norm(offsets, axis=1)
    heap = replace(captured, offsets=np.stack([lengths, 0 * lengths, 0 * lengths], axis=1))
    with pytest.raises(ModelError, match=r"not clear \(confidence 0\.\d\d, at least 0\.5 is needed\)"):
        prepare(heap, SKELETON)


def test_nobody_rests_with_clavicles_along_the_neck() -> None:
    """Arms and clavicles that point up at rest, with a T-pose as the first frame, as of Geno."""
    captured = motion("T", 2)
    offsets = np.array(captured.offsets)
    raised = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    rotations = np.array(captured.rotations)
    for side, up in (("Left", raised), ("Right", raised.T)):
        for name in ("Arm", "ForeArm", "Hand"):
            offsets[captured.names.index(f"{side}{name}")] @= up.T
        rotations[:, captured.names.index(f"{side}Shoulder")] = Rotation.from_matrix(up.T).as_quat()[
            [3, 0, 1, 2]
        ]
    ready = prepare(replace(captured, offsets=offsets, rotations=rotations), SKELETON)
    assert ready.rest == "first"
    assert "clavicles 9" in ready.reasons["rest"]


def test_the_middle_of_a_finger_is_no_middle_finger() -> None:
    names = ["L_hand_jnt"]
    parents = [-1]
    for finger in ("thumb", "index", "middle", "ring", "pinky"):
        for number, part in enumerate(("base", "mid", "tip")):
            parents.append(0 if not number else len(names) - 1)
            names.append(f"L_{finger}_{part}_jnt")
    unturned = np.tile([1.0, 0.0, 0.0, 0.0], (1, len(names), 1))
    offsets = np.zeros((len(names), 3))
    hand = SkeletonMotion(tuple(names), np.array(parents), offsets, unturned, np.zeros((1, 3)), Fraction(25))
    found = NamedJoints(hand).fingers("l", 0)
    assert {names[number] for joint, number in found.items() if "ring" in joint} == {
        "L_ring_base_jnt", "L_ring_mid_jnt",
    }  # fmt: skip
    assert found["l_middle1"] == names.index("L_middle_base_jnt")
    assert found["l_middle2"] == names.index("L_middle_mid_jnt")


def test_an_animal_has_no_counterpart() -> None:
    """Two pairs of legs and no arm, whose front pair stood for a person's."""
    captured = motion("T", 2)
    renamed = tuple(
        name.replace("UpLeg", "_Back_Leg_Upper").replace("ForeArm", "_Front_Leg_Lower")
        .replace("LeftLeg", "Left_Back_Leg_Lower").replace("RightLeg", "Right_Back_Leg_Lower")
        .replace("Foot", "_Back_Foot").replace("ToeBase", "_Back_Toes")
        .replace("Arm", "_Front_Leg_Upper").replace("Hand", "_Front_Foot").replace("Shoulder", "Blade")
        for name in captured.names
    )  # fmt: skip
    with pytest.raises(ModelError, match=r"no known skeleton family|no arms or legs"):
        prepare(replace(captured, names=renamed), SKELETON)
    words = {"UpLeg": "leg_back_1", "Leg": "leg_back_2", "Foot": "leg_back_3", "ToeBase": "leg_back_4",
             "Arm": "leg_front_1", "ForeArm": "leg_front_2", "Hand": "leg_front_3"}  # fmt: skip
    sides = ("Left", "Right")
    numbered = {f"{side}{word}": f"{side}_{name}" for side in sides for word, name in words.items()}
    renamed = tuple(numbered.get(name, name) for name in captured.names)
    with pytest.raises(ModelError, match=r"no known skeleton family|no arms or legs"):
        prepare(replace(captured, names=renamed), SKELETON)


def test_a_frame_that_is_not_there() -> None:
    with pytest.raises(
        ModelError,
        match=r"has 4 frames, from 0; there is no frame 9 to rest in; choose one of these with rest=0",
    ):
        prepare(motion("T", 4), SKELETON, rest=9)
    assert prepare(motion("T", 4), SKELETON, rest=2).rest == "frame 2"


@pytest.mark.parametrize("up", UPS)
@pytest.mark.parametrize("posture", POSTURES)
def test_a_file_with_other_axes_is_trusted(posture: str, up: str) -> None:
    """Its rest pose stands along them. Somebody who stands, crawls or turns leaves no doubt."""
    made = turned(POSTURES[posture](), UPS[up])
    with warnings.catch_warnings(record=True, action="always") as caught:
        assert prepare(made, SKELETON).up == up
    assert posture not in UPRIGHT or not caught
    assert all("if another axis points up, say which with up=" in str(each.message) for each in caught)


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
@pytest.mark.parametrize("posture", TRUNKS)
def test_people_are_shown_as_they_lie(posture: str) -> None:
    """The trunk of the person shown leans as the source's."""
    animation = from_skeleton(turned(POSTURES[posture](), UPS["+z"]), plant=False)
    matrices = BapSolver().pose(animation.body.values)
    number = SKELETON.number
    trunk = matrices[:, number("vt1"), :3, 3] - matrices[:, number("vl5"), :3, 3]
    height = trunk[:, 1] / np.linalg.norm(trunk, axis=1)
    assert np.abs(height - TRUNKS[posture]).max() < 0.17  # the spine of the person shown is bent


@pytest.mark.parametrize("posture", POSTURES)
def test_the_axis_of_the_format_needs_no_warning(posture: str) -> None:
    """As in glTF, where up is +y."""
    for up, world in UPS.items():
        made = replace(turned(POSTURES[posture](), world), up=up)
        with warnings.catch_warnings(action="error"):
            ready = prepare(made, SKELETON)
        assert ready.up == up
        np.testing.assert_allclose(find_up(made, ready.mapped)[1], world.apply([0, 1, 0]), atol=1e-9)


@pytest.mark.parametrize("up", [up for up in UPS if up != "+y"])
def test_a_floor_overrules_the_rest_pose_with_a_warning(up: str) -> None:
    """The rest pose stands along y, but the root turns whoever walks upright along another axis."""
    made = turned_by_the_root(POSTURES["walks"](), UPS[up])
    with pytest.warns(FbaWarning, match=rf"up is taken to be \{up}: people stand along it.*up='\+y'"):
        assert prepare(made, SKELETON).up == up
    assert prepare(made, SKELETON, up="+y").up == "+y"


@pytest.mark.parametrize("up", ["+z", "+x", "-y", "-z"])
@pytest.mark.parametrize("posture", ["sits", "dances"])
def test_a_rest_pose_that_may_be_wrong_is_doubted(posture: str, up: str) -> None:
    """The root alone turns people up, and somebody may lie along the axis of the rest pose."""
    made = turned_by_the_root(POSTURES[posture](), UPS[up])
    with pytest.warns(FbaWarning, match="up is taken to be"):
        prepare(made, SKELETON)


@pytest.mark.parametrize(
    ("posture", "up", "said"),
    [
        ("walks", "+y", False), ("walks", "+z", False), ("walks", "-y", False), ("walks", "-z", False),
        ("sits", "+y", False), ("sits", "+z", False), ("dances", "+y", False), ("climbs", "+y", False),
        ("crawls", "+y", True), ("crawls", "+z", True), ("walks_on_hands", "+y", True),
        ("walks_on_hands", "+z", True), ("falls", "+y", True), ("lies_on_a_side", "+y", True),
    ],
)  # fmt: skip
def test_without_a_rest_pose_the_floor_decides(posture: str, up: str, said: bool) -> None:
    """All bones lie along x at rest."""
    made = along_x(turned(POSTURES[posture](), UPS[up]))
    with warnings.catch_warnings(record=True, action="always") as caught:
        assert prepare(made, SKELETON).up == up
    assert bool(caught) == said
