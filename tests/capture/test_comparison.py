"""A capture beside its result: each measure sees its fault, and says how large it is."""

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from capture_bodies import motion
from fba import Animation, FaceTrack
from fba.body import Skeleton
from fba.capture import SkeletonMotion, from_skeleton
from fba.capture.bones import map_joints
from fba.capture.comparison import Comparison, Difference, bounds, compare, find_sticks, find_up
from fba.capture.comparison._figure import Figure
from fba.capture.comparison._path_measures import floors
from fba.capture.comparison._path_measures import jumps as measure_jumps
from fba.errors import ModelError
from fba.parameters import bap_numbers

FRAMES = 30


def standing() -> SkeletonMotion:
    """Someone who stands still, arms bent by a right angle: two seconds at 15 frames/s."""
    bend = Rotation.from_euler("x", -90, degrees=True)
    turns = {"LeftForeArm": bend, "RightForeArm": bend}
    return motion("standing", FRAMES, turns=turns, rate=15)


@pytest.fixture(scope="module")
def source() -> SkeletonMotion:
    return standing()


@pytest.fixture(scope="module")
def mapped(source: SkeletonMotion) -> dict[str, int]:
    return map_joints(source.names, None, Skeleton.default())[1]


@pytest.fixture(scope="module")
def result(source: SkeletonMotion) -> Animation:
    return from_skeleton(source)


def changed(result: Animation, name: str, value: float, frames: slice = slice(None)) -> Animation:
    """The result with a BAP that is larger by a value, degrees or mm, in some frames."""
    values = result.body.values.copy()
    amount = value if "_tr_" in name else np.radians(value) * 1e5
    values[frames, bap_numbers()[name] - 1] += round(amount)
    mask = np.ones_like(result.body.mask)
    return replace(result, body=replace(result.body, values=values, mask=mask))


def find(comparison: Comparison, measure: str, part: str) -> Difference:
    return next(one for one in comparison.differences if (one.measure, one.part) == (measure, part))


def test_a_result_as_it_should_be_is_good(
    source: SkeletonMotion, result: Animation, mapped: dict[str, int]
) -> None:
    comparison = compare(source, result, mapped)
    assert (comparison.verdict, comparison.reasons) == ("good", ())
    assert comparison.frames == FRAMES
    assert find(comparison, "direction", "left forearm").worst < 1
    assert find(comparison, "foot", "left foot").worst < 3
    assert find(comparison, "path", "hips").worst < 5


@pytest.mark.parametrize(
    ("bap", "value", "measure", "part", "worst"),
    [
        ("l_elbow_flexion", 30, "direction", "left forearm", 30),
        ("r_knee_flexion", 40, "direction", "right shank", 40),
        ("l_shoulder_flexion", -20, "direction", "left upper arm", 20),
        ("l_ankle_flexion", 35, "foot", "left foot", 35),
        ("skullbase_torsion", 38, "head", "head", 38),
        ("l_sternoclavicular_abduct", 30, "clavicle", "left clavicle", 30),
    ],
)
def test_a_constant_difference_is_seen(
    source: SkeletonMotion, result: Animation, mapped: dict[str, int], bap: str, value: float, measure: str,
    part: str, worst: float,
) -> None:  # fmt: skip
    before = find(compare(source, result, mapped), measure, part).worst
    one = find(compare(source, changed(result, bap, value), mapped), measure, part)
    assert one.worst == pytest.approx(worst, abs=before + 4)
    assert one.typical == pytest.approx(one.worst, abs=1)
    assert one.grade == ("poor" if worst >= bounds()[measure].poor else "fair")
    assert f" {one.worst:.0f} " in one.sentence


def test_a_thigh_that_is_turned_round_with_a_shank_that_turns_back_is_wrung(
    source: SkeletonMotion, result: Animation, mapped: dict[str, int]
) -> None:
    turned = changed(changed(result, "l_hip_twisting", 110), "l_knee_twisting", -110)
    comparison = compare(source, turned, mapped)
    assert find(comparison, "direction", "left shank").worst < 6
    for part in ("left thigh", "left shank"):
        assert find(comparison, "wrung", part).worst == pytest.approx(110, abs=5)
        assert find(comparison, "wrung", part).grade == "poor"
    assert find(comparison, "wrung", "right shank").worst < 10


def test_a_hand_that_turns_over_is_seen_without_fingers(
    source: SkeletonMotion, result: Animation, mapped: dict[str, int]
) -> None:
    """Half of the time it is turned by 90 degrees: 45 from the mean of both."""
    turned = changed(result, "l_wrist_twisting", 90, slice(15, None))
    one = find(compare(source, turned, mapped), "turn", "left hand")
    assert one.worst == pytest.approx(45, abs=1)
    assert one.grade == "poor"


def test_a_flip_for_one_frame_is_a_jump(
    source: SkeletonMotion, result: Animation, mapped: dict[str, int]
) -> None:
    flipped = changed(result, "HumanoidRoot_rt_body_turn", 178, slice(7, 8))
    comparison = compare(source, flipped, mapped)
    one = find(comparison, "jump", "pelvis")
    assert one.worst == pytest.approx(178, abs=1)
    assert one.frame in (7, 8)
    assert (comparison.verdict, comparison.differences[0].measure) == ("poor", "jump")
    assert find(comparison, "direction", "line of the hips").worst < 1  # it does not last


def test_a_leap_of_the_root_and_a_floor_out_of_reach(
    source: SkeletonMotion, result: Animation, mapped: dict[str, int]
) -> None:
    leapt = compare(source, changed(result, "HumanoidRoot_tr_frontal", 900, slice(3, 4)), mapped)
    assert find(leapt, "leap", "hips").worst == pytest.approx(900, abs=1)
    sunk = changed(result, "HumanoidRoot_tr_vertical", -960)
    one = find(compare(source, sunk, mapped), "floor", "left sole")
    assert one.worst == pytest.approx(960, abs=25)
    assert one.grade == "poor"
    floating = find(compare(source, sunk, mapped, level=None), "floor", "left sole")
    assert floating.worst < 25  # where there is no floor, its height does not matter


@pytest.mark.parametrize(
    ("level", "sole", "off"), [(0.0, 0.0, 0), (0.0, -0.1, 100), (None, -0.1, 0), (None, 0.04, 40)]
)
def test_a_capture_that_sinks_under_its_floor(level: float | None, sole: float, off: float) -> None:
    """Its ground is 10 cm lower in the end: a person stays on the floor, or sinks where there is none."""
    heights = np.where(np.arange(25) < 20, 0.1, 0.0)
    feet = np.stack([0 * heights, heights, 0 * heights], axis=1)
    soles = np.where(np.arange(25) < 20, 0.0, sole)
    standing = {"l": np.ones(25, dtype=np.bool_)}
    (row,) = floors(Figure({"l_ankle": feet}, {}), {"l": soles}, standing, level)
    np.testing.assert_allclose(row.values, np.where(np.arange(25) < 20, 0, off), atol=1e-9)


def test_a_limb_that_was_not_matched_is_seen(source: SkeletonMotion, result: Animation) -> None:
    swing = Rotation.from_rotvec(np.linspace(0, 1, FRAMES)[:, None] * [1.0, 0.0, 0.0])
    moving = motion("standing", FRAMES, turns={"LeftArm": swing}, rate=15)
    mapped = {
        joint: n
        for joint, n in map_joints(moving.names, None, Skeleton.default())[1].items()
        if joint[:2] != "l_"
    }
    comparison = compare(moving, result, mapped)
    assert find(comparison, "unmatched", "left arm").grade == "poor"
    assert "1 moving joints are left over" in find(comparison, "unmatched", "left leg").sentence


def test_the_motion_shows_up_before_the_rest_pose(mapped: dict[str, int]) -> None:
    """Z up, in a file whose rest pose lies along x."""
    lying = Rotation.from_euler("z", -90, degrees=True)
    for world, expected in (
        (Rotation.identity(), [0, 1, 0]),
        (Rotation.from_euler("x", 90, degrees=True), [0, 0, 1]),
    ):
        captured = motion("standing", 3, world=world)
        np.testing.assert_allclose(find_up(captured, mapped)[1], expected, atol=1e-9)
        back = (lying.inv()).as_quat()[[3, 0, 1, 2]]
        rest = captured.offsets @ lying.as_matrix().T
        quaternions = captured.rotations.copy()
        quaternions[:, 0] = back
        np.testing.assert_allclose(
            find_up(replace(captured, offsets=rest, rotations=quaternions), mapped)[1], expected, atol=1e-9
        )


def test_long_motions_are_sampled_in_runs(
    source: SkeletonMotion, result: Animation, mapped: dict[str, int]
) -> None:
    comparison = compare(source, changed(result, "l_elbow_flexion", 60, slice(26, 30)), mapped, most=20)
    assert comparison.frames == 20
    assert find(comparison, "direction", "left forearm").worst == pytest.approx(60, abs=1)
    assert find(comparison, "direction", "left forearm").frame >= 26


def test_worst_frames_lie_apart() -> None:
    ones = (
        Difference("direction", "left forearm", 0.0, 90.0, 10),
        Difference("direction", "right forearm", 0.0, 80.0, 12),
        Difference("direction", "left thigh", 0.0, 30.0, 40),
        Difference("jump", "left forearm", 0.0, 46.0, 60),
        Difference("head", "head", 0.0, 1.0, 80),
    )
    comparison = Comparison(100, ()).with_more(ones)
    assert [one.frame for one in comparison.worst_frames(3, 10)] == [10, 40, 80]
    assert comparison.verdict == "poor"
    assert [one.part for one in comparison.reasons] == [
        "left forearm",
        "right forearm",
        "left thigh",
        "left forearm",
    ]


def test_the_bounds_are_those_of_the_documentation() -> None:
    """Which holds them because people must know what "poor" means."""
    page = (Path(__file__).parents[2] / "docs" / "motion-capture.md").read_text(encoding="utf-8")
    table = page.split("| fair from | poor from |")[1].split("\n\n")[0]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()[2:]]
    told = {}
    for names, _, fair, poor in rows:
        measures = ["clamped", "clamped root"] if names == "clamped" else names.split(", ")
        for name, *limits in zip(measures, fair.split(", "), poor.split(", "), strict=True):
            told[name] = [limit for limit in limits if limit != "any"]
    for name, limit in bounds().items():
        wanted = [f"{value:g} {limit.unit}" for value in (limit.fair, limit.poor)]
        assert told.pop(name) == (wanted if name != "unmatched" else [""])
    assert told == {}


def test_a_source_with_nothing_in_common(source: SkeletonMotion, mapped: dict[str, int]) -> None:
    empty = Animation(Fraction(15), np.arange(2), FaceTrack.empty(2))
    with pytest.raises(ModelError, match="no body"):
        compare(source, empty, mapped)


def test_sticks_stand_where_the_result_stands(
    source: SkeletonMotion, result: Animation, mapped: dict[str, int]
) -> None:
    (near,) = find_sticks(source, result, mapped, [4])
    (far,) = find_sticks(source, changed(result, "HumanoidRoot_tr_frontal", 2000), mapped, [4])
    np.testing.assert_allclose(
        far.lines - near.lines, np.broadcast_to([0, 0, 2.0], near.lines.shape), atol=2e-3
    )
    assert near.sides.count("l") == near.sides.count("r") == 8
    assert len(near.soles) == 2
    assert abs(near.soles[0][:, 1].mean()) < 0.03


def test_a_constant_turn_of_a_palm_is_seen_without_fingers(
    source: SkeletonMotion, result: Animation, mapped: dict[str, int]
) -> None:
    """The rest pose stands, so its palms face the thighs."""
    assert find(compare(source, result, mapped), "palm", "left hand").worst < 5
    one = find(compare(source, changed(result, "l_wrist_twisting", 90), mapped), "palm", "left hand")
    assert one.typical == pytest.approx(90, abs=5)
    assert one.grade == "poor"


def test_palms_of_hands_that_hang_at_rest_on_arms_that_do_not(mapped: dict[str, int]) -> None:
    """The hand's own end shows how it rests: a hand along -y in a T-pose has its palm at the thigh's side."""
    posed = motion("T", 3)
    rotations = np.array(posed.rotations)
    for side, turn in (("Left", 90), ("Right", -90)):
        quaternion = Rotation.from_euler("z", turn, degrees=True).as_quat()[[3, 0, 1, 2]]
        rotations[:, posed.names.index(f"{side}Hand")] = quaternion
    hands = np.array([posed.names.index(f"{side}Hand") for side in ("Left", "Right")])
    hanging = replace(
        posed, rotations=rotations, end_parents=hands, end_offsets=np.array([[0.0, -0.15, 0.0]] * 2)
    )
    result = from_skeleton(hanging)
    for side in ("left", "right"):
        assert find(compare(hanging, result, mapped), "palm", f"{side} hand").worst < 10


def test_a_wrung_forearm_is_seen_where_the_rest_pose_says_nothing(
    source: SkeletonMotion, result: Animation, mapped: dict[str, int]
) -> None:
    """One arm is longer than the other: nobody stands like that."""
    offsets = source.offsets.copy()
    offsets[mapped["l_wrist"]] *= 1.5
    uneven = replace(source, offsets=offsets)
    assert find(compare(uneven, result, mapped), "palm", "left hand").worst == 0
    one = find(compare(uneven, changed(result, "l_wrist_twisting", 180), mapped), "palm", "left hand")
    assert one.typical == pytest.approx(80, abs=15)


def test_a_capture_that_tears_is_compared_up_to_there(
    source: SkeletonMotion, result: Animation, mapped: dict[str, int]
) -> None:
    """A camera loses a person, who is then 4 m away, in another pose."""
    positions = source.positions.copy()
    positions[20:, 0] += 4.0
    torn = replace(source, positions=positions)
    spoilt = changed(result, "l_elbow_flexion", 60, slice(20, None))
    comparison = compare(torn, spoilt, mapped)
    one = find(comparison, "tear", "capture")
    assert one.worst == pytest.approx(4.0, abs=0.2)
    assert one.frame == 20
    assert find(comparison, "direction", "left forearm").worst < 1
    assert comparison.verdict == "fair"


@pytest.mark.parametrize(("bend", "jumps"), [(30.0, 0.0), (2.0, 80.0)])
def test_an_upper_arm_follows_the_plane_in_which_an_elbow_bends(bend: float, jumps: float) -> None:
    """The source's forearm leaps from one side to the other: no leap of the result, unless it is straight."""
    plane = Rotation.from_euler("y", [[0], [0], [80], [80]], degrees=True)
    forearm = plane.apply(Rotation.from_euler("x", bend, degrees=True).apply([0.0, -1.0, 0.0]))
    shoulder = np.zeros((4, 3))
    elbow = shoulder - [0.0, 1.0, 0.0]
    points = {"l_shoulder": shoulder, "l_elbow": elbow, "l_wrist": elbow + forearm}
    still = np.tile(np.eye(3), (4, 1, 1))
    source = Figure(points, {"l_shoulder": still}, {})
    result = Figure(points, {"l_shoulder": plane.as_matrix()}, {})
    row = next(row for row in measure_jumps(source, result) if row.part == "left upper arm")
    assert row.values.max() == pytest.approx(jumps, abs=0.5)


def test_a_foot_that_is_held_up_does_not_stand(mapped: dict[str, int]) -> None:
    """On one leg, with the other thigh level, still."""
    turns = {"LeftUpLeg": Rotation.from_euler("x", -90, degrees=True),
             "LeftLeg": Rotation.from_euler("x", 90, degrees=True)}  # fmt: skip
    stork = motion("standing", FRAMES, turns=turns, rate=15)
    comparison = compare(stork, from_skeleton(stork), mapped)
    floor = [one for one in comparison.differences if one.measure == "floor" and one.typical > 0]
    assert {one.part for one in floor} <= {"right sole"}
    assert all(one.worst < 10 for one in floor)


def test_runs_of_a_long_motion_have_one_floor(mapped: dict[str, int]) -> None:
    """Somebody steps on a box of 1 m: those who see that part only would take the box for the floor."""
    captured = motion("standing", 64, rate=15)
    positions = captured.positions.copy()
    positions[40:, 1] += 1.0
    captured = replace(captured, positions=positions)
    comparison = compare(captured, from_skeleton(captured), mapped, most=32)
    assert find(comparison, "floor", "left sole").worst < 25
