"""The VMC protocol: bodies from Unity's bones, faces from expressions, and OSC that is damaged."""

from fractions import Fraction

import numpy as np
import pytest

import fba
from fba.arrays import Float64
from fba.body import BapSolver
from fba.capture import SkeletonMotion, from_skeleton
from fba.live._protocols.sample import DatagramError
from fba.live._protocols.unity_bones import joint_of, parents
from fba.live._protocols.vmc import VmcReader, read_messages
from fba.parameters import fap_numbers
from live_senders import UNITY_BONES, Sent, bundle, captured, osc, vmc_frames

COUNT = 40
TIMES = np.arange(COUNT) / 30


def about(axis: str, angles: Float64 | float) -> Float64:
    """Unity's quaternions (T, 4), x y z w, of turns about an axis."""
    half = np.broadcast_to(angles, COUNT) / 2
    turns = np.zeros((COUNT, 4))
    turns[:, "xyz".index(axis)], turns[:, 3] = np.sin(half), np.cos(half)
    return turns


TURNS = {
    "LeftUpperArm": about("z", np.radians(60)),  # left-handed: from -x towards -y
    "RightUpperArm": about("z", np.radians(-30)),
    "LeftLowerArm": about("y", np.radians(50)),
    "Spine": about("y", 0.2 * np.sin(TIMES)),
    "RightUpperLeg": about("x", 0.5 * np.sin(2 * TIMES) - 0.5),
    "RightLowerLeg": about("x", 0.6 + 0.3 * np.sin(2 * TIMES)),
}
PATH = np.stack([0.3 * np.sin(TIMES), np.full(COUNT, 0.95), 0.1 * TIMES], axis=1)
EXPRESSIONS = {"A": 0.5 + 0.4 * np.sin(TIMES), "Blink_L": np.abs(np.sin(TIMES)), "Neutral": np.ones(COUNT)}
SENT = vmc_frames(TURNS, EXPRESSIONS, COUNT, path=PATH)


def skeleton_motion() -> SkeletonMotion:
    """The same performance in right-handed axes."""
    names = [name for name in parents() if name in UNITY_BONES]

    def above(name: str) -> int:
        name = parents()[name]
        while name and name not in names:
            name = parents()[name]
        return names.index(name) if name else -1

    turns = np.tile([1.0, 0.0, 0.0, 0.0], (COUNT, len(names), 1))
    for name, rows in TURNS.items():
        turns[:, names.index(name)] = rows[:, [3, 0, 1, 2]] * [1, 1, -1, -1]
    offsets = np.array([UNITY_BONES[name] for name in names]) * [-1, 1, 1]
    offsets[0] = 0
    return SkeletonMotion(
        tuple(names), np.array([above(name) for name in names]), offsets, turns, PATH * [-1, 1, 1],
        Fraction(30), declared={name: str(joint_of(name)) for name in names}, up="+y",
    )  # fmt: skip


@pytest.fixture(scope="module")
def person() -> fba.Animation:
    animation, summary = captured("vmc", SENT, settle=False)
    assert animation is not None
    assert summary.notes == ["30 frames a second, as in the first one"]
    assert (summary.used, summary.gaps) == (COUNT - 1, 0)  # only what follows tells that a frame is complete
    return animation


def test_a_body_is_that_of_the_same_skeleton_in_a_file(person: fba.Animation) -> None:
    whole = from_skeleton(skeleton_motion(), ground="none", plant=False, rest="file", up="+y")
    np.testing.assert_array_equal(person.index, np.arange(COUNT - 1))
    np.testing.assert_array_equal(person.body.mask, whole.body.mask[:-1])
    np.testing.assert_allclose(person.body.values, whole.body.values[:-1], atol=300)  # 1e-5 rad


def test_a_few_frames_at_a_time_make_the_same_body(person: fba.Animation) -> None:
    animation, _ = captured("vmc", vmc_frames(TURNS, EXPRESSIONS, COUNT, path=PATH, split=100))
    assert animation.face == person.face
    np.testing.assert_allclose(animation.body.values, person.body.values, atol=300)


def test_left_is_left_and_down_is_down(person: fba.Animation) -> None:
    solver = BapSolver()
    places = solver.pose(person.body.values[:1])[0][:, :3, 3]
    at = {name: places[solver.skeleton.number(name)] for name in
          ("l_shoulder", "l_elbow", "l_wrist", "r_shoulder", "r_elbow")}  # fmt: skip
    left, right = at["l_elbow"] - at["l_shoulder"], at["r_elbow"] - at["r_shoulder"]
    assert left[0] > 0 > right[0]  # +x is the person's left
    assert np.degrees(np.arctan2(-left[1], left[0])) == pytest.approx(60, abs=2)
    assert np.degrees(np.arctan2(-right[1], -right[0])) == pytest.approx(30, abs=2)
    assert at["l_wrist"][2] > at["l_elbow"][2] + 0.1  # the forearm points ahead


def test_expressions_are_faps(person: fba.Animation) -> None:
    values = {name: person.face.values[:, number - 1] for name, number in fap_numbers().items()}
    jaw = values["open_jaw"]
    assert jaw.min() > 0
    assert np.corrcoef(jaw, EXPRESSIONS["A"][:-1])[0, 1] > 0.999
    assert values["close_t_l_eyelid"].max() > 800
    assert not values["close_t_r_eyelid"].any()


NEW_NAMES = {
    "A": "aa", "I": "ih", "U": "ou", "E": "ee", "O": "oh", "Joy": "happy", "Sorrow": "sad", "Fun": "relaxed",
    "Angry": "angry", "Blink_L": "blinkLeft", "Blink_R": "blinkRight", "LookUp": "lookUp",
}  # fmt: skip


def test_old_names_of_expressions_are_the_new_ones() -> None:
    faces = []
    for names in (list(NEW_NAMES), list(NEW_NAMES.values())):
        rows = {name: np.array([0.0, 0.1, 0.0]) + 0.05 * number for number, name in enumerate(names)}
        animation, summary = captured("vmc", vmc_frames({}, rows, 3), settle=False)
        assert not any("left out" in note for note in summary.notes)
        faces.append(animation.face)
    assert faces[0] == faces[1]
    assert faces[0].values.any()


def test_shapes_with_arkits_names_come_before_expressions() -> None:
    names = ("JawOpen", "eyeBlinkLeft", "EyeBlinkRight", "mouthSmile_L", "MouthSmileRight")
    rows = {name: np.full(COUNT, 0.5) for name in names}
    both, summary = captured("vmc", vmc_frames({}, rows | {"A": np.ones(COUNT)}, COUNT), settle=False)
    alone, _ = captured("vmc", vmc_frames({}, rows, COUNT), settle=False)
    assert both.face == alone.face
    assert summary.notes[-1] == "5 shapes have ARKit's names; 1 other expressions are left out"


def test_a_face_alone_turns_its_head_by_the_bones_of_the_neck() -> None:
    messages = [
        [osc("/VMC/Ext/T", row / 30), osc("/VMC/Ext/Blend/Val", "Joy", 0.5),
         osc("/VMC/Ext/Bone/Pos", "Head", 0.0, 0.0, 0.0, float(np.sin(0.1)), 0.0, 0.0, float(np.cos(0.1))),
         osc("/VMC/Ext/Bone/Pos", "Neck", 0.0, 0.0, 0.0, 0.0, float(np.sin(0.15)), 0.0, float(np.cos(0.15)))]
        for row in range(COUNT)
    ]  # fmt: skip
    sent: list[Sent] = [(row / 30, "10.0.0.5", bundle(*one)) for row, one in enumerate(messages)]
    animation, summary = captured("vmc", sent)
    assert animation.body is None
    assert summary.notes[-1] == "there is no body: no bone is called Hips"
    pitch, yaw = (animation.face.values[3, fap_numbers()[name] - 1] for name in ("head_pitch", "head_yaw"))
    assert pitch == pytest.approx(20_000, abs=700)  # down
    assert yaw == pytest.approx(-30_000, abs=700)  # Unity turns to the right


def test_bones_of_no_body() -> None:
    hips = [osc("/VMC/Ext/Bone/Pos", name, *(0.0,) * 6, 1.0) for name in ("Hips", "Head")]
    animation, summary = captured("vmc", [(0.0, "10.0.0.5", bundle(osc("/VMC/Ext/T", 1.0), *hips)),
                                          (0.1, "10.0.0.5", osc("/VMC/Ext/T", 2.0))])  # fmt: skip
    assert animation.body is None
    assert summary.notes[-1].startswith("there is no body: ")


def test_a_t_pose_at_the_beginning_counts_as_rest() -> None:
    """Bones whose own axes are turned: what matters is how they turn from the T-pose."""
    plain = vmc_frames({"LeftUpperArm": about("z", np.radians(50) * (TIMES > 0.5))}, {}, COUNT)
    own = np.array([0.0, 0.0, np.sin(0.35), np.cos(0.35)])  # the shoulder's
    back = own * [-1, -1, -1, 1]
    lowered = np.radians(50) * (TIMES > 0.5)
    half = (lowered / 2)[:, None]
    arm = np.concatenate([np.zeros((COUNT, 2)), np.sin(half - 0.35), np.cos(half - 0.35)], axis=1)
    assert np.allclose(arm[0], back)
    odd = vmc_frames({"LeftShoulder": np.tile(own, (COUNT, 1)), "LeftUpperArm": arm}, {}, COUNT)
    expected, _ = captured("vmc", plain, settle=False)
    assert expected is not None
    solver = BapSolver()
    elbow, shoulder = (solver.skeleton.number(name) for name in ("l_elbow", "l_shoulder"))
    animation, _ = captured("vmc", odd, settle=False, neutral=0.5)
    places = solver.pose(animation.body.values)[:, :, :3, 3]
    way = places[:, elbow] - places[:, shoulder]
    slope = np.degrees(np.arctan2(-way[:, 1], way[:, 0]))
    assert slope[3] == pytest.approx(0, abs=2)
    assert slope[30] == pytest.approx(50, abs=3)


@pytest.mark.parametrize("options", [{"timed": False}, {"timed": False, "split": 1}, {"lengths": False}])
def test_other_senders(options: dict[str, bool], person: fba.Animation) -> None:
    sent = vmc_frames(TURNS, EXPRESSIONS, COUNT, path=PATH, **options)  # type: ignore[arg-type]
    animation, summary = captured("vmc", sent, settle=False)
    assert animation.body is not None
    assert person.body is not None
    assert len(animation) == pytest.approx(COUNT, abs=2)
    assert ("the bones come without lengths; those of the standard's body are used" in summary.notes) == (
        options.get("lengths") is False
    )
    joints = BapSolver()
    ours, theirs = (joints.pose(one.body.values[20:21])[0] for one in (animation, person))
    for name in ("l_shoulder", "l_elbow", "r_knee"):
        number = joints.skeleton.number(name)
        turn = ours[number, :3, :3].T @ theirs[number, :3, :3]
        assert np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))) < 6


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "not OSC"),
        (b"#bundle\0", "not OSC"),
        (bundle(osc("/VMC/Ext/OK", 1.0))[:-3], "not OSC"),
        (bundle(b"") + b"\0\0\0\5abcde", "not OSC"),
        (b"/VMC\xff\xfe" + b"\0" * 2 + b",Q\0\0", "not OSC"),
        (osc("/avatar/parameters/x", 1.0), "without messages of VMC"),
        (osc("/VMC/Ext/Bone/Pos", "Hips", 1.0), "with wrong messages of VMC"),
        (osc("/VMC/Ext/Bone/Pos", "Hips", *(0.0,) * 7), "with wrong messages of VMC"),  # a turn of no length
        (osc("/VMC/Ext/Bone/Pos", "Hips", float("nan"), *(0.0,) * 5, 1.0), "with wrong messages of VMC"),
        (osc("/VMC/Ext/Blend/Val", "A", 1e9), "with wrong messages of VMC"),
        (osc("/VMC/Ext/T", "now"), "with wrong messages of VMC"),
    ],
)
def test_damaged_messages_are_refused(data: bytes, reason: str) -> None:
    with pytest.raises(DatagramError, match=reason):
        VmcReader().read(data, 0.0)


def test_bundles_in_bundles_end_somewhere() -> None:
    data = osc("/VMC/Ext/OK", 1.0)
    for _ in range(8):
        data = bundle(data)
    assert read_messages(data)[0].address == "/VMC/Ext/OK"
    with pytest.raises(DatagramError):
        read_messages(bundle(data))
