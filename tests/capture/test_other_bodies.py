"""Bodies that lack joints, sources of few joints, and other orders of the axes, by geometry."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from test_from_skeleton import NAMES

from capture_bodies import motion
from fba.animation import Animation
from fba.body import BapSolver, Skeleton, convention_names
from fba.capture import RetargetReport, SkeletonMotion, from_skeleton, retarget_report
from fba.capture._skeleton import is_direct
from fba.errors import FbaWarning, ModelError
from fba.parameters import bap_numbers, joints

NUMBERS = bap_numbers()
WAVING = {
    "LeftArm": Rotation.from_rotvec(np.outer([-30, -10, 10, 30], [0, 0, 1]), degrees=True),
    "LeftForeArm": Rotation.from_rotvec(np.outer([-20, -40, -60, -80], [0, 1, 0]), degrees=True),
    "RightLeg": Rotation.from_rotvec(np.outer([10, 30, 50, 70], [1, 0, 0]), degrees=True),
}


def body_without(*missing: str) -> BapSolver:
    """The default body without joints whose name, or whose name less its side, is given; children move up."""
    left_out = {joint.name for joint in joints() if {joint.name, joint.name[2:]} & set(missing)}
    table = {joint.name: joint for joint in joints()}
    parents: dict[str, str | None] = {}
    for joint in joints():
        above = joint.parent
        while above in left_out:
            above = table[above].parent
        if joint.name not in left_out:
            parents[joint.name] = above
    return BapSolver(Skeleton.from_parents(parents, {name: table[name].centre for name in parents}))


def part_of(captured: SkeletonMotion, *names: str) -> SkeletonMotion:
    """The source with these joints only, whose parents must be among them."""
    kept = [captured.names.index(name) for name in names]
    parents = [int(captured.parents[number]) for number in kept]
    return SkeletonMotion(
        names,
        np.array([-1 if parent < 0 else kept.index(parent) for parent in parents]),
        captured.offsets[kept],
        captured.rotations[:, kept],
        captured.positions,
        captured.rate,
    )


def value(animation: Animation, name: str) -> np.ndarray:
    return animation.body.values[:, NUMBERS[name] - 1]


@pytest.mark.parametrize(
    "missing", ["acromioclavicular", "skullbase", "subtalar", "metatarsal midtarsal", "vl2 vl3 vl4"]
)
def test_a_body_without_some_joints_still_points_every_bone(missing: str) -> None:
    solver = body_without(*missing.split())
    captured = motion("T", 4, turns=WAVING)
    animation = from_skeleton(captured, solver=solver, plant=False)
    report = retarget_report(captured, animation, solver=solver)
    assert report.frames == 4
    assert {"l_elbow", "r_knee", "l_shoulder", "r_hip"} <= {bone.joint for bone in report.bones}
    assert report.worst < 0.5
    assert (report.feet is None) == (missing in ("subtalar", "metatarsal midtarsal"))


def test_a_body_without_the_root_is_refused() -> None:
    """Its legs alone, which hang on the sacrum."""
    body = Skeleton.default()
    number = body.number
    legs = [number(f"{side}_{joint}") for side in "lr" for joint in ("hip", "knee", "ankle")]
    kept = [number("sacroiliac"), *legs]
    names = tuple(body.names[joint] for joint in kept)
    solver = BapSolver(Skeleton(names, np.array([-1, 0, 1, 2, 0, 4, 5]), body.centres[kept]))
    captured = motion("T", 4)
    animation = from_skeleton(captured)
    for convert in (
        lambda: from_skeleton(captured, solver=solver),
        lambda: retarget_report(captured, animation, solver=solver),
        lambda: from_skeleton(captured, joints={"Hips": "sacroiliac"}, solver=solver),
    ):
        with pytest.raises(ModelError, match=r"root of the body's skeleton is 'sacroiliac'.*HumanoidRoot"):
            convert()


def test_a_report_names_unknown_joints() -> None:
    captured = motion("T", 4)
    animation = from_skeleton(captured)
    with pytest.raises(ValueError, match="the motion has no joint 'Hip'"):
        retarget_report(captured, animation, joints={"Hip": "HumanoidRoot"})
    with pytest.raises(ValueError, match="one source joint must be given for HumanoidRoot"):
        retarget_report(captured, animation, joints={"LeftUpLeg": "l_hip"})


@pytest.mark.parametrize("axes", convention_names())
def test_every_order_of_the_axes_points_every_bone(axes: str) -> None:
    """With flexion innermost, an elbow reaches any direction alone; elsewhere the upper arm turns, too."""
    solver = BapSolver(axes=axes)
    captured = motion("T", 4, turns=WAVING)
    animation = from_skeleton(captured, solver=solver, plant=False)
    assert retarget_report(captured, animation, solver=solver).worst < 0.5


def test_a_source_without_hips_moves_by_its_root() -> None:
    """Shoulders tell left from right; 0.1 of its units to its left are 0.1 of the arms' ratio in metres."""
    names = ("Hips", "Spine", "Spine1", "Neck", "Head")
    arms = tuple(
        f"{side}{part}" for side in ("Left", "Right") for part in ("Shoulder", "Arm", "ForeArm", "Hand")
    )
    captured = part_of(motion("standing", 2), *names, *arms)
    moved = replace(captured, positions=captured.positions + np.array([[0, 0, 0], [0.1, 0, 0]]))
    animation = from_skeleton(moved)
    centres = {joint.name: np.array(joint.centre) for joint in joints()}
    arm = sum(
        float(np.linalg.norm(centres[f"l_{b}"] - centres[f"l_{a}"]))
        for a, b in (("shoulder", "elbow"), ("elbow", "wrist"))
    )
    step = int(np.diff(value(animation, "HumanoidRoot_tr_lateral"))[0])
    assert step == pytest.approx(1000 * 0.1 * arm / 0.6, abs=2)
    assert value(animation, "HumanoidRoot_tr_vertical")[0] == pytest.approx(
        1000 * (arm / 0.6 - centres["HumanoidRoot"][1]), abs=2
    )
    report = retarget_report(moved, animation)
    assert report.feet is None
    assert report.worst < 0.5


def test_left_and_right_by_the_knees() -> None:
    """Hips at one point and no shoulders: the knees tell left from right, if these are apart."""
    legs = tuple(f"{side}{part}" for side in ("Left", "Right") for part in ("UpLeg", "Leg", "Foot"))
    captured = part_of(motion("standing"), "Hips", "Spine", *legs)
    offsets = np.array(captured.offsets)
    for side, x in (("Left", 0.1), ("Right", -0.1)):
        offsets[captured.names.index(f"{side}UpLeg")] = 0
        offsets[captured.names.index(f"{side}Leg")] = [x, -0.45, 0]
    by_knees = from_skeleton(replace(captured, offsets=offsets))
    assert abs(value(by_knees, "HumanoidRoot_rt_body_turn")[0]) < 10
    other_way = replace(captured, offsets=offsets * [-1, 1, 1])
    assert abs(value(from_skeleton(other_way), "HumanoidRoot_rt_body_turn")[0]) == pytest.approx(
        314_159, abs=10
    )
    with pytest.raises(ModelError, match="no pair of hips or shoulders apart, so left and right are unknown"):
        from_skeleton(replace(captured, offsets=offsets * [0, 1, 1]))


def test_ends_give_hands_and_heads_their_directions() -> None:
    """A hand has no joint after it; the end of its bone says where it points, unless it has no length."""
    captured = motion("standing")
    hand, other = captured.names.index("LeftHand"), captured.names.index("RightHand")
    ends = {"end_parents": np.array([hand, other]), "end_offsets": np.array([[0.05, -0.1, 0], [0, 0, 0]])}
    animation = from_skeleton(replace(captured, **ends))
    plain = from_skeleton(captured)
    matrices = [BapSolver().pose(a.body.values)[0] for a in (animation, plain)]  # type: ignore[union-attr]
    number = Skeleton.default().number
    turned = Rotation.from_matrix(
        matrices[0][number("l_wrist"), :3, :3] @ matrices[1][number("l_wrist"), :3, :3].T
    )
    centres = {joint.name: np.array(joint.centre) for joint in joints()}
    own = centres["l_middle1"] - centres["l_wrist"]
    wanted = np.degrees(np.arctan2(0.05, 0.1) - np.arctan2(own[0], -own[1]))
    assert turned.as_euler("zyx", degrees=True)[0] == pytest.approx(wanted, abs=3)
    np.testing.assert_allclose(matrices[0][number("r_wrist")], matrices[1][number("r_wrist")], atol=1e-4)


def test_a_report_of_given_joints() -> None:
    captured = motion("T", 3)
    table = {theirs: ours for ours, theirs in NAMES.items()}
    report = retarget_report(captured, from_skeleton(captured), joints=table)
    assert report.family == ""
    assert report.mean == pytest.approx(sum(bone.mean for bone in report.bones) / len(report.bones))
    assert report.worst == max(bone.worst for bone in report.bones)
    assert report.unused == ()


def test_a_report_counts_feet_within_a_centimetre() -> None:
    captured = motion("standing", 20)
    animation = from_skeleton(captured)
    for millimetres, within in ((8, 1.0), (12, 0.75)):
        values = animation.body.values.copy()
        values[::4, NUMBERS["HumanoidRoot_tr_vertical"] - 1] += millimetres
        report = retarget_report(captured, replace(animation, body=replace(animation.body, values=values)))
        assert report.feet.within == within
        assert report.feet.worst == pytest.approx(millimetres / 1000, abs=0.001)


def test_a_report_without_bones_or_frames() -> None:
    empty = RetargetReport("", 1, (), None, (), ())
    assert (empty.mean, empty.worst) == (0, 0)
    captured = motion("T", 3)
    animation = from_skeleton(captured)
    with pytest.raises(ModelError, match="no frame in common"):
        retarget_report(
            replace(captured, rotations=captured.rotations[:0], positions=captured.positions[:0]), animation
        )


def test_a_report_of_someone_who_never_touches_the_ground() -> None:
    """Feet that fly 1 m and more above 0 stand on no ground."""
    captured = motion("standing", 30)
    flying = replace(captured, positions=captured.positions + np.array([0, 1.0, 0]))
    assert retarget_report(flying, from_skeleton(flying)).feet is None


def test_a_standard_skeleton_scaled_and_moved() -> None:
    """A source of the standard's own joints is converted joint for joint: twice as large, the same BAPs."""
    skeleton = Skeleton.default()
    offsets = skeleton.offsets * 2
    count = 3
    rotations = np.tile([1.0, 0.0, 0.0, 0.0], (count, len(skeleton), 1))
    path = np.array([[1.0, 0, 3.0], [2.0, 0, 3.0], [4.0, 0, 3.0]])
    source = SkeletonMotion(
        skeleton.names, skeleton.parents, offsets, rotations, offsets[0] + 2 * path, 25
    )  # fmt: skip
    assert is_direct(source, skeleton)
    lateral = {
        origin: value(from_skeleton(source, origin=origin), "HumanoidRoot_tr_lateral").tolist()
        for origin in ("source", "start", "middle")
    }
    assert lateral == {"source": [1000, 2000, 4000], "start": [0, 1000, 3000], "middle": [-1500, -500, 1500]}
    assert value(from_skeleton(source, scale=0.25), "HumanoidRoot_tr_lateral").tolist() == [500, 1000, 2000]
    with pytest.raises(ValueError, match="scale must be a positive number, not 0"):
        from_skeleton(source, scale=0.0)


def test_of_a_standard_skeleton_with_long_arms_the_legs_give_the_scale() -> None:
    """Steps must be as long as the legs take them, whatever the arms."""
    skeleton = Skeleton.default()
    offsets = skeleton.offsets
    for name in ("l_elbow", "r_elbow", "l_wrist", "r_wrist"):
        offsets[skeleton.number(name)] *= 1.5
    still = np.tile([1.0, 0.0, 0.0, 0.0], (2, len(skeleton), 1))
    path = offsets[0] + np.array([[0, 0, 0], [1.0, 0, 0]])
    source = SkeletonMotion(skeleton.names, skeleton.parents, offsets, still, path, 25)
    assert is_direct(source, skeleton)
    assert value(from_skeleton(source), "HumanoidRoot_tr_lateral").tolist() == [0, 1000]


@pytest.mark.parametrize("change", ["another root", "another parent", "no knee", "a bent knee"])
@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_what_only_looks_like_the_standard_skeleton_is_retargeted(change: str) -> None:
    """Joints with the standard's names that hang elsewhere, or rest otherwise: bones still point right."""
    skeleton = Skeleton.default()
    names, parents = list(skeleton.names), skeleton.parents.copy()
    offsets = skeleton.offsets
    knee = names.index("l_knee")
    if change == "another parent":
        parents[names.index("l_shoulder")] = names.index("vt1")
        offsets[names.index("l_shoulder")] = (
            skeleton.centres[names.index("l_shoulder")] - skeleton.centres[names.index("vt1")]
        )
    elif change == "a bent knee":
        offsets[knee + 1] = Rotation.from_euler("x", 20, degrees=True).apply(offsets[knee + 1])
    elif change == "no knee":
        names[knee] = "l_patella"
    else:
        names[0], names[1] = "sacroiliac", "HumanoidRoot"
    still = np.tile([1.0, 0.0, 0.0, 0.0], (2, len(names), 1))
    source = SkeletonMotion(tuple(names), parents, offsets, still, np.tile(offsets[0], (2, 1)), 25)
    assert not is_direct(source, skeleton)
    assert retarget_report(source, from_skeleton(source, ground="none")).worst < 0.5


def test_contradictions_name_what_is_wrong() -> None:
    good = motion("T", 2)
    with pytest.raises(ModelError, match=r"offsets has shape \(20, 3\), not \(21, 3\)"):
        replace(good, offsets=good.offsets[:-1])
    with pytest.raises(ModelError, match="an end hangs on a joint that is not there"):
        replace(good, end_parents=np.array([99]), end_offsets=np.zeros((1, 3)))
    with pytest.raises(ValueError, match="more than the 6000000 that the limit `frames` allows"):
        good.resample(10**12)


def test_few_joints_warn_of_the_missing_ones() -> None:
    legs = ("LeftUpLeg", "LeftLeg", "RightUpLeg", "RightLeg")
    captured = part_of(motion("standing"), "Hips", "Spine", "Spine1", "Neck", "Head", *legs)
    with pytest.warns(FbaWarning, match="no joints for l_ankle, r_ankle; they stay as they are"):
        from_skeleton(captured, scale=1.0)
