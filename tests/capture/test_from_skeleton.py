"""Captured skeletons become BAPs whose bones point where the source's bones point."""

from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import fba
from capture_bodies import ARM, bone_errors, limb_bones, motion, source_places
from fba import Animation
from fba.body import BapSolver, BodyModel, Skeleton
from fba.body.footing import GroundedPoser, lowest_sole
from fba.capture import SkeletonMotion, from_skeleton, retarget_report
from fba.capture.bones import match
from fba.capture.comparison._figure import find_up, result_figure, source_figure
from fba.capture.comparison._measurement import sole_heights, source_scale
from fba.capture.comparison._path_measures import find_floor, find_standing
from fba.errors import FbaWarning, FormatError, ModelError
from fba.formats.bvh import _reader as reader
from fba.parameters import bap_numbers, baps

NUMBERS = bap_numbers()
NAMES = {
    "HumanoidRoot": "Hips", "vl5": "Spine", "vl1": "Spine1", "vc7": "Neck", "skullbase": "Head",
    **{
        f"{side[0].lower()}_{ours}": side + theirs
        for side in ("Left", "Right")
        for ours, theirs in {
            "sternoclavicular": "Shoulder", "shoulder": "Arm", "elbow": "ForeArm", "wrist": "Hand",
            "hip": "UpLeg", "knee": "Leg", "ankle": "Foot", "metatarsal": "ToeBase",
        }.items()
    },
}  # fmt: skip
REAL = {
    "greta/Dance.bvh": ("chest", 120, 961),
    "greta/Fluid_gesture.bvh": ("chest", 120, 872),
    "greta/GangnamStyle.bvh": ("chest", 120, 1020),
    "greta/c-Walkaround.bvh": ("collar", 60, 534),
    "greta/c-ladder.bvh": ("collar", 60, 893),
    "greta/fast_gesture.bvh": ("chest", 120, 912),
    "greta/sad_walk_rd.bvh": ("chest", 120, 2620),
    "greta/strong_gesture.bvh": ("chest", 60, 909),
    "vreng/cmu_walk.bvh": ("poser", 120, 344),
}


def value(animation, name: str) -> np.ndarray:  # type: ignore[no-untyped-def]
    return animation.body.values[:, NUMBERS[name] - 1]


def worst(captured: SkeletonMotion) -> float:
    errors = bone_errors(captured, from_skeleton(captured).body.values, limb_bones(NAMES))
    return max(float(e.max()) for e in errors.values())


@pytest.mark.parametrize("rest", ["T", "A", "standing"])
def test_rest_poses_by_geometry(rest: str) -> None:
    captured = motion(rest)
    assert worst(captured) < 0.3  # of nearly straight limbs, within the hinges' play
    # the same arms hanging down, from each rest pose, are the same BAPs
    down = {"T": 90, "A": 45, "standing": 0}[rest]
    hanging = motion(
        rest,
        turns={
            "LeftArm": Rotation.from_euler("z", -down, degrees=True),
            "RightArm": Rotation.from_euler("z", down, degrees=True),
        },
    )
    reference = from_skeleton(motion("standing")).body.values
    assert np.abs(from_skeleton(hanging).body.values - reference).max() <= 3


def test_t_pose_raises_the_arms_sideways() -> None:
    matrices = BapSolver().pose(from_skeleton(motion("T")).body.values)[0]
    number = Skeleton.default().number
    for side, sign in (("l", 1), ("r", -1)):
        arm = matrices[number(f"{side}_wrist"), :3, 3] - matrices[number(f"{side}_shoulder"), :3, 3]
        np.testing.assert_allclose(arm / np.linalg.norm(arm), [sign, 0, 0], atol=3e-3)
        palm = matrices[number(f"{side}_wrist"), :3, :3] @ [-sign, 0, 0]
        assert palm[1] < -0.9  # palms, inward while standing, face the ground


def test_random_poses_keep_every_bone() -> None:
    generator = np.random.default_rng(11)
    count = 60
    turns = {
        name: Rotation.random(count, rng=generator) ** 0.25
        for name in NAMES.values()
        if not name.endswith(("Foot", "ToeBase"))
    }
    assert worst(motion("T", count, turns=turns)) < 5.0


def test_elbow_that_bends_sideways_turns_the_upper_arm() -> None:
    """The source's elbow abducts by 60 degrees; the standard's cannot."""
    captured = motion("standing", turns={"LeftForeArm": Rotation.from_euler("z", 60, degrees=True)})
    animation = from_skeleton(captured)
    assert worst(captured) < 0.5
    flexion = int(value(animation, "l_elbow_flexion")[0])
    assert flexion == pytest.approx(np.radians(60) * 1e5, abs=12_000)
    assert abs(int(value(animation, "l_shoulder_twisting")[0])) == pytest.approx(157_080, abs=12_000)
    hand = BapSolver().pose(animation.body.values)[0, Skeleton.default().number("l_wrist"), :3, :3]
    expected = Rotation.from_euler("z", 60, degrees=True)
    assert np.degrees((Rotation.from_matrix(hand) * expected.inv()).magnitude()) < 10


def test_knee_swing_is_smooth_through_straight() -> None:
    angles = np.radians(30 + 32 * np.cos(np.linspace(0, 6 * np.pi, 300)))  # a little beyond straight, too
    sway = Rotation.from_rotvec(np.outer(np.radians(0.5) * np.sin(np.linspace(0, 17, 300)), [0, 0, 1]))
    turns = {"LeftLeg": Rotation.from_rotvec(np.outer(angles, [1, 0, 0])) * sway}
    animation = from_skeleton(motion("standing", 300, turns=turns))
    assert value(animation, "l_knee_flexion").min() < -90_000
    assert np.abs(np.diff(value(animation, "l_knee_flexion"))).max() < 15_000
    # no half turns of the leg where the knee passes straight; what sways there is within the hinge's play
    for name in ("l_hip_twisting", "l_knee_twisting", "l_ankle_twisting"):
        assert np.abs(value(animation, name)).max() < 50_000, name


def test_hips_turn_and_move() -> None:
    captured = motion(
        "standing",
        5,
        turns={"Hips": Rotation.from_rotvec(np.outer([0, 20, 40, 60, 80], [0, 1, 0]), degrees=True)},
    )
    animation = from_skeleton(captured, ground="none")
    found = value(animation, "HumanoidRoot_rt_body_turn")
    np.testing.assert_allclose(found, np.radians([0, 20, 40, 60, 80]) * 1e5, atol=2)
    shift = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.2, 0], [0, 0, -0.3], [0, 0, 0]])
    moved = replace(captured, positions=captured.positions + shift)
    change = from_skeleton(moved, ground="none").body.values - animation.body.values
    scale = (
        1000 * (0.42695 + 0.43398) / 0.9
    )  # mm, by length of leg: hip to knee to ankle, default over source
    expected = np.zeros((5, 3))
    expected[1, 1], expected[2, 0], expected[3, 2] = 0.1 * scale, 0.2 * scale, -0.3 * scale
    np.testing.assert_allclose(change[:, 180:183], expected, atol=2)
    assert not change[:, :180].any()


def test_units_do_not_matter_and_scale_does() -> None:
    in_metres = from_skeleton(motion("A")).body.values
    np.testing.assert_allclose(from_skeleton(motion("A", scale=39.37)).body.values, in_metres, atol=1)
    high = value(from_skeleton(motion("A"), scale=2.0, ground="none"), "HumanoidRoot_tr_vertical")[0]
    assert high == pytest.approx((2.0 * 0.95 - 0.9364) * 1000, abs=2)


def test_origin() -> None:
    captured = motion("standing", 3)
    walking = replace(captured, positions=captured.positions + np.array([[5, 0, 1], [6, 0, 1], [9, 0, 2]]))
    lateral = {
        o: value(from_skeleton(walking, origin=o), "HumanoidRoot_tr_lateral") for o in ("start", "middle")
    }
    assert lateral["start"][0] == 0
    assert lateral["middle"][0] == -lateral["middle"][2]
    assert value(from_skeleton(walking), "HumanoidRoot_tr_lateral")[0] > 4000
    with pytest.raises(ValueError, match="source, start, middle"):
        from_skeleton(walking, origin="nowhere")


@pytest.mark.parametrize("turn", ["x", "y"])
def test_sources_with_another_up_or_heading(turn: str) -> None:
    """z up (as after a quarter turn about x), or facing +x: same posture, heading kept."""
    reference = from_skeleton(motion("A")).body.values
    found = from_skeleton(motion("A", world=Rotation.from_euler(turn, 90, degrees=True))).body.values.copy()
    if turn == "y":
        assert found[0, 183] == pytest.approx(157_080, abs=2)
        found[:, 183] = reference[:, 183]
        found[:, 180:183] = reference[:, 180:183]
    np.testing.assert_allclose(found, reference, atol=2)


def test_only_mapped_joints_are_sent() -> None:
    animation = from_skeleton(motion("T"), spine="joints")
    sent = {baps()[c].joint for c in np.flatnonzero(animation.body.mask[0])}
    assert {"HumanoidRoot", "vl5", "l_shoulder", "r_knee", "l_metatarsal"} <= sent
    assert "l_acromioclavicular" in sent  # both joints of the clavicle move for the source's one
    assert not sent & {"vt3", "l_index1", ""}
    assert animation.face is None
    assert animation.body.mask.all(axis=0).sum() == animation.body.mask.any(axis=0).sum()


@pytest.mark.parametrize("prefix", ["mixamorig:", "mixamorig_", "Bob 1:Bip ", "CHARACTER-"])
def test_names_with_prefixes(prefix: str) -> None:
    family, found = match(motion("T", prefix=prefix).names)
    assert family == "arm"
    assert len(found) == len(NAMES)


def test_names_in_another_case() -> None:
    _, found = match([name.upper().replace("LEFT", "left_") for name in motion().names])
    assert found["l_elbow"] == motion().names.index("LeftForeArm")


def test_names_of_the_standard() -> None:
    captured = motion("T")
    renamed = SkeletonMotion(
        tuple(f"j{n}" for n in range(len(captured.names))), captured.parents, captured.offsets,
        captured.rotations, captured.positions, captured.rate,
    )  # fmt: skip
    with pytest.raises(ModelError, match="no known skeleton family"):
        from_skeleton(renamed)
    table = {f"j{captured.names.index(theirs)}": ours for ours, theirs in NAMES.items()}
    assert from_skeleton(renamed, joints=table) == from_skeleton(captured)
    for bad in ({"j0": "tail"}, {"none": "HumanoidRoot"}, {"j1": "vl5"}):
        with pytest.raises(ValueError, match="joint"):
            from_skeleton(renamed, joints=bad)


def test_resampling_turns_by_slerp() -> None:
    turns = {"LeftArm": Rotation.from_rotvec(np.outer([0, -40, -80], [1, 0, 0]), degrees=True)}
    captured = motion("standing", 3, turns=turns, rate=Fraction(30))
    animation = from_skeleton(captured, 60)
    assert (animation.rate, len(animation)) == (60, 5)
    flexion = value(animation, "l_shoulder_flexion")
    np.testing.assert_allclose(np.diff(flexion), np.radians(20) * 1e5, rtol=0.02)
    assert len(from_skeleton(captured, "30000/1001")) == 2
    half = Rotation.from_rotvec(np.outer([0, 160], [0, 0, 1]), degrees=True)
    quarters = motion("T", 2, turns={"Hips": half}, rate=1).resample(4).rotations[:, 0]
    np.testing.assert_allclose(
        2 * np.degrees(np.arctan2(quarters[:, 3], quarters[:, 0])), [0, 40, 80, 120, 160]
    )
    with pytest.raises(ValueError, match="positive"):
        from_skeleton(captured, -1)
    with pytest.raises(ModelError, match="500000"):
        from_skeleton(captured, 10**12)


def test_bodies_that_cannot_be_placed() -> None:
    flat = motion("T", scale=0.0)
    with pytest.raises(ModelError, match="no human skeleton is found: there are 21 joints, all at one place"):
        from_skeleton(flat)
    empty = motion("T", frames=0)
    with pytest.raises(ModelError, match="no frames"):
        from_skeleton(empty)
    with pytest.raises(ValueError, match="scale"):
        from_skeleton(motion("T"), scale=float("nan"))
    nose = ("Hips", "Spine", "Spine1", "Neck", "Head", "LeftUpLeg", "RightUpLeg")
    whole = motion("T")
    keep = [whole.names.index(name) for name in nose]
    parents = np.array([-1, 0, 1, 2, 3, 0, 0])
    legless = SkeletonMotion(
        nose, parents, whole.offsets[keep], whole.rotations[:, keep], whole.positions, whole.rate
    )
    with pytest.raises(
        ModelError, match=r"no human skeleton is found: no arms or legs.*Hips as HumanoidRoot"
    ):
        from_skeleton(legless)
    given = ("HumanoidRoot", "vl5", "vl3", "vc7", "skullbase", "l_hip", "r_hip")
    with pytest.warns(FbaWarning) as said:
        from_skeleton(legless, joints=dict(zip(nose, given, strict=True)))
    texts = [str(warning.message) for warning in said]
    assert any("unit is unknown" in text for text in texts)
    assert any("no joints for l_knee, l_ankle, r_knee, r_ankle;" in text for text in texts)


def test_a_file_without_a_figure_is_refused(shared: Path) -> None:
    """A picture of a fox whose star alone moves."""
    with pytest.raises(FormatError, match=r"no human skeleton is found: there is but one joint \(Star.001\)"):
        fba.read(shared / "data/foreign/bodies/fox.glb")


def test_contradictory_motion() -> None:
    good = motion("T", 2)
    for change in (
        {"parents": np.array([*good.parents[:-1], 99])},
        {"parents": np.zeros_like(good.parents)},
        {"offsets": good.offsets[:-1]},
        {"positions": np.full((2, 3), np.nan)},
        {"rotations": good.rotations * 2},
        {"rate": Fraction(0)},
    ):
        fields = {
            f: getattr(good, f) for f in ("names", "parents", "offsets", "rotations", "positions", "rate")
        }
        with pytest.raises(ModelError):
            SkeletonMotion(**{**fields, **change})


def test_forward_kinematics_against_scipy() -> None:
    turns = {name: Rotation.random(4, rng=np.random.default_rng(2)) for name in ("Hips", "Spine", "LeftArm")}
    captured = motion("A", 4, turns=turns)
    assert captured.world() is captured.world()
    assert not captured.world()[0].flags.writeable
    np.testing.assert_allclose(captured.world()[1], source_places(captured), atol=1e-12)
    hand, elbow = (captured.world()[1][0, captured.names.index(n)] for n in ("LeftHand", "LeftForeArm"))
    assert np.linalg.norm(hand - elbow) == pytest.approx(ARM, abs=1e-4)


GROUNDED = {
    "greta/c-ladder.bvh": 0.3  # climbs
}
"""Least share of frames in which the shown person's soles are within 5 mm of the ground; others: 0.95."""
STANCE = 0.85
"""Least share of frames in which a sole is within 5 mm of the ground, of those in which that foot stands. The
others are of a straight leg behind, whose foot is about to leave, or has just come."""


def standing_soles(captured: SkeletonMotion, mapped: dict[str, int], animation: Animation) -> np.ndarray:
    """Heights in metres of the shown person's soles, of each foot while the source's stands."""
    solver, rate = BapSolver(), float(captured.rate)
    up = find_up(captured, mapped)
    neutral = result_figure(solver, np.zeros((1, 296), dtype=np.int32))
    source = source_figure(captured, mapped, up, source_scale(captured, mapped, neutral, up))
    stands = find_standing(source, rate, find_floor([source], rate).lows)
    heights = sole_heights(solver, animation.body.values)
    return np.concatenate([heights[side][stands[side]] for side in "lr"])


@pytest.mark.parametrize("name", REAL)
@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_real_captures_keep_every_bone(shared: Path, name: str) -> None:
    family, rate, frames = REAL[name]
    captured = reader.read_motion(shared / "data" / name)
    found, mapped = match(captured.names)
    assert (found, captured.rate, len(captured)) == (family, rate, frames)
    animation = from_skeleton(captured)
    bones = limb_bones({joint: captured.names[number] for joint, number in mapped.items()})
    errors = bone_errors(captured, animation.body.values, bones)
    assert len(errors) >= 12
    for bone, angles in errors.items():
        # thighs and shanks of the other proportions of cmu_walk turn a little more, for the feet to stand
        assert angles.mean() < (1.0 if name != "vreng/cmu_walk.bvh" else 1.7), bone
        assert angles.max() < 5.0, bone
    # of 16 bones, four rest where they are by definition: see limb_bones
    assert sum(angles.mean() for angles in errors.values()) / 16 < 0.35
    report = retarget_report(captured, animation)  # says the same as the independent measurement
    for bone in report.bones:
        if (bone.joint, bone.aim) in errors:
            assert bone.mean == pytest.approx(errors[bone.joint, bone.aim].mean(), abs=1e-6)
            assert bone.worst == pytest.approx(errors[bone.joint, bone.aim].max(), abs=1e-6)
    assert np.abs(animation.body.values[:, :180]).max() <= 314_160
    low = BapSolver().pose(animation.body.values)[:, :, 1, 3].min(axis=1)
    # the balls of the feet reach the ground; those of people who sit on the edges of their shoes are above it
    assert abs(np.percentile(low, 5) - 0.0092) < (0.011 if "gesture" in name else 0.006)
    assert low.min() > -0.045
    assert report.feet.mean < 0.005
    assert report.feet.worst < 0.0125
    assert report.feet.within > 0.985
    shown = GroundedPoser(BodyModel.default().skeleton)
    rows = np.unique(np.linspace(0, len(animation) - 1, 100).astype(int))
    lowest = lowest_sole(BodyModel.default().skeleton, shown.pose(animation.body.values[rows]))
    assert lowest is not None
    assert (np.abs(lowest) < 0.005).mean() > GROUNDED.get(name, 0.95)
    assert (np.abs(standing_soles(captured, mapped, animation)) < 0.005).mean() > STANCE


@pytest.mark.filterwarnings("ignore::fba.FbaWarning")
def test_twist_of_nearly_straight_legs_does_not_jump(shared: Path) -> None:
    """A sad walk on knees that bend a few degrees in all directions: thighs do not spin about themselves."""
    animation = from_skeleton(reader.read_motion(shared / "data/greta/sad_walk_rd.bvh"))
    for name in ("l_hip_twisting", "r_hip_twisting", "l_knee_twisting", "r_knee_twisting"):
        steps = np.abs(np.diff(value(animation, name).astype(float)))
        assert steps.max() < 30_000, name  # 0.3 rad a frame at 120 frames/s
