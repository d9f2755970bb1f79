"""The solver undoes poses: within human limits, at gimbal lock, over smooth motions; the table of limits."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from fba.body import BapSolver, JointLimits, Skeleton, convention_names
from fba.body.solve._pose_loops import arc_tangent, sine_cosine
from fba.body.solve.conventions import convention
from fba.compiled import compiled
from fba.parameters import bap_numbers, baps

NUMBERS = bap_numbers()
QUARTER = 157_080
MIDDLE = {name: {convention(name).freedoms(j)[1] for j in convention(name).joints
                 if len(convention(name).freedoms(j)) == 3} for name in convention_names()}  # fmt: skip
"""0-based columns of the middle one of three freedoms: 90 degrees there are gimbal lock."""
ANGLES = [b for b in baps() if b.i_limits is not None]


def ranges(axes: str) -> np.ndarray:
    """(2, 296): the standard's ranges, in units; the middle freedoms end 1 degree before gimbal lock.

    The skull base, whose range is absurd (136 degrees each way), has 60 degrees.
    """
    result = np.zeros((2, 296), dtype=np.int64)
    for bap in ANGLES:
        assert bap.i_limits is not None
        result[:, bap.number - 1] = np.array(bap.i_limits) * bap.step_iso
        if bap.joint == "skullbase":
            result[:, bap.number - 1] = -104_720, 104_720
        if bap.number - 1 in MIDDLE[axes]:
            result[:, bap.number - 1] = result[:, bap.number - 1].clip(-QUARTER + 1745, QUARTER - 1745)
    return result


@settings(max_examples=60)
@given(st.integers(0, 2**32 - 1), st.sampled_from(convention_names()), st.floats(0.0, 1.0))
def test_random_poses_within_human_limits_come_back(seed: int, axes: str, reach: float) -> None:
    generator = np.random.default_rng(seed)
    low, high = ranges(axes)
    count = 40
    values = np.rint(generator.uniform(low, high + 1e-9, (count, 296)) * reach)
    values[generator.random((count, 296)) < 0.2] = 0
    values = values.astype(np.int32)
    values[:, 186:] = 0
    solver = BapSolver(axes=axes)
    matrices = solver.pose(values)
    for row, frame in zip(values, matrices, strict=True):  # each on its own: nothing known of a frame before
        assert np.abs(solver.solve(frame) - row).max() <= 1


@settings(max_examples=60)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([0, 1, 2, 5, 20, 100, 300]),
    st.sampled_from(convention_names()),
)
def test_same_rotations_at_and_near_gimbal_lock(seed: int, off: int, axes: str) -> None:
    generator = np.random.default_rng(seed)
    values = generator.integers(-300_000, 300_000, (8, 296))
    middle = sorted(MIDDLE[axes])
    signs = generator.choice([-1, 1], (8, len(middle)))
    values[:, middle] = signs * (QUARTER + generator.integers(-off, off + 1, (8, len(middle))))
    solver = BapSolver(axes=axes)
    wanted = solver.pose(values)[:, :, :3, :3]
    found = solver.pose(solver.solve(solver.pose(values)))[:, :, :3, :3]
    for joint in range(len(solver.skeleton)):
        turn = Rotation.from_matrix(found[:, joint].swapaxes(1, 2) @ wanted[:, joint]).magnitude()
        assert turn.max() < 1e-4, solver.skeleton.names[joint]


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1))
def test_smooth_motions_stay_smooth(seed: int) -> None:
    """Angles that swing through several turns come back as they were, without a jump or a flip."""
    generator = np.random.default_rng(seed)
    frames = 240
    time = np.arange(frames)[:, None] / 60
    size = generator.uniform(0, 900_000, 186)  # up to 9 rad
    size[sorted(MIDDLE["iso"])] = generator.uniform(0, 130_000, len(MIDDLE["iso"]))  # up to 75 degrees
    two = [c for j in convention("iso").joints if len(f := convention("iso").freedoms(j)) == 2 for c in f]
    size[two] = generator.uniform(0, 150_000, len(two))
    values = np.zeros((frames, 296))
    values[:, :186] = size * np.sin(generator.uniform(0.2, 1.5, 186) * time)
    values[:, 180:183] /= 100
    values = np.rint(values).astype(np.int32)
    solver = BapSolver()
    found = solver.solve(solver.pose(values))
    np.testing.assert_allclose(found, values, atol=1)


def test_arm_swings_on_through_gimbal_lock() -> None:
    """An arm raised sideways past 90 degrees: abduction goes on, and nothing turns half round."""
    rows = np.zeros((361, 296), dtype=np.int32)
    rows[:, NUMBERS["l_shoulder_abduct"] - 1] = np.rint(np.radians(np.arange(361) / 2) * 1e5)
    rows[:, NUMBERS["l_shoulder_flexion"] - 1] = 20_000
    rows[:, NUMBERS["l_shoulder_twisting"] - 1] = -30_000
    solver = BapSolver()
    found = solver.solve(solver.pose(rows))
    away = np.abs(np.arange(361) / 2 - 90) > 0.01
    np.testing.assert_allclose(found[away], rows[away], atol=1)
    assert np.abs(np.diff(found.astype(float), axis=0)).max() < 2000
    again = solver.pose(found)[:, :, :3, :3] - solver.pose(rows)[:, :, :3, :3]
    assert np.abs(again).max() < 1e-4


def test_frames_one_by_one_are_frames_together() -> None:
    generator = np.random.default_rng(5)
    values = np.cumsum(generator.integers(-4000, 4000, (70, 296)), axis=0).astype(np.int32)
    solver = BapSolver()
    matrices = solver.pose(values)
    together = solver.solve(matrices)
    row = solver.solve(matrices[0])
    for number in range(1, 70):
        row = solver.solve(matrices[number], previous=row)
        assert np.abs(row - together[number]).max() <= 1


@compiled
def sine_cosine_of(angle: float) -> tuple[float, float]:
    return sine_cosine(angle)


@compiled
def arc_tangent_of(y: float, x: float) -> float:
    return arc_tangent(y, x)


@given(st.floats(-21475.0, 21475.0))
def test_sine_and_cosine(angle: float) -> None:
    sine, cosine = sine_cosine_of(angle)
    assert sine == pytest.approx(math.sin(angle), abs=3e-16)
    assert cosine == pytest.approx(math.cos(angle), abs=3e-16)


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_arc_tangent(y: float, x: float) -> None:
    assume(max(abs(x), abs(y)) > 1e-300)
    found = arc_tangent_of(y, x)
    difference = math.remainder(found - math.atan2(y, x), 2 * math.pi)
    assert abs(difference) < 2e-11
    assert abs(found) <= math.pi


def test_pose_writes_into_out() -> None:
    solver = BapSolver()
    values = np.random.default_rng(1).integers(-90_000, 90_000, (5, 296)).astype(np.int32)
    out = np.full((5, 87, 4, 4), np.nan)
    assert solver.pose(values, out=out) is out
    np.testing.assert_array_equal(out, solver.pose(values))
    np.testing.assert_array_equal(out, solver.pose(values.astype(np.float64)))
    np.testing.assert_array_equal(out, solver.pose(values.astype(np.int64)))
    one = np.full((87, 4, 4), np.nan)
    solver.pose(values[2], out=one)
    np.testing.assert_array_equal(one, out[2])
    np.testing.assert_array_equal(solver.pose(values[::2]), out[::2])
    for bad in (np.zeros((4, 87, 4, 4)), np.zeros((5, 87, 4, 4), dtype=np.float32), out.T, [0.0]):
        with pytest.raises(ValueError, match="out must be"):
            solver.pose(values, out=bad)  # type: ignore[arg-type]
    frozen = np.zeros((5, 87, 4, 4))
    frozen.flags.writeable = False
    with pytest.raises(ValueError, match="out must be"):
        solver.pose(values, out=frozen)


def test_absurd_angles() -> None:
    """The largest 32-bit values: thousands of turns, still the right rotation."""
    solver = BapSolver()
    row = np.zeros(296, dtype=np.int64)
    row[NUMBERS["l_shoulder_flexion"] - 1] = 2**31 - 1
    turned = solver.pose(row)[Skeleton.default().number("l_shoulder"), :3, :3]
    wanted = Rotation.from_rotvec([-math.remainder((2**31 - 1) * 1e-5, 2 * math.pi), 0, 0]).as_matrix()
    np.testing.assert_allclose(turned, wanted, atol=1e-11)
    with pytest.raises(ValueError, match="32 bits"):
        solver.pose(row.astype(float) * 1e9)


def degrees(**angles: float) -> np.ndarray:
    row = np.zeros(296)
    for name, value in angles.items():
        row[NUMBERS[name] - 1] = np.radians(value) * 1e5
    return row


def within(**angles: float) -> bool:
    return not JointLimits.human().check(degrees(**angles))


@pytest.mark.parametrize(
    ("bap", "low", "high"),
    [
        ("l_hip_flexion", -20, 120), ("r_hip_flexion", -20, 120),
        ("l_hip_abduct", -31, 53), ("r_hip_abduct", -53, 31),
        ("l_knee_flexion", -113, 0), ("r_metatarsal_flexion", -10, 45),
        ("l_shoulder_flexion", -61, 188), ("l_shoulder_abduct", -48, 134), ("r_shoulder_abduct", -134, 48),
        ("r_elbow_flexion", 0, 142), ("l_ankle_flexion", -38, 35),
    ],
)  # fmt: skip
def test_table_of_typical_limits(bap: str, low: float, high: float) -> None:
    assert within(**{bap: low + 0.1})
    assert within(**{bap: high - 0.1})
    assert not within(**{bap: low - 0.1})
    assert not within(**{bap: high + 0.1})


def test_limits_open_the_way_people_move() -> None:
    """The far end of each range, posed: where the limb goes, on both sides."""
    solver, number = BapSolver(), Skeleton.default().number
    for side, outward in (("l", 1), ("r", -1)):
        far = {}
        for limit in JointLimits.human().limits:
            if limit.segment.startswith("left" if side == "l" else "right"):
                far[limit.segment.split(" ", 1)[1], limit.motion] = limit
        rest = solver.pose(np.zeros(296))
        shifts = {}
        for key, joint in {
            ("thigh", "flexion"): "knee", ("thigh", "abduction"): "knee", ("shin", "flexion"): "ankle",
            ("upper arm", "flexion"): "elbow", ("upper arm", "abduction"): "elbow",
            ("forearm", "flexion"): "wrist",
        }.items():  # fmt: skip
            limit = far[key]
            end = max(limit.low, limit.high, key=abs)
            row = np.zeros(296)
            row[limit.baps[0]] = np.radians(end) * 1e5
            place = number(f"{side}_{joint}")
            shifts[key] = solver.pose(row)[place, :3, 3] - rest[place, :3, 3]
        assert shifts["thigh", "flexion"][2] > 0.3  # forward
        assert shifts["thigh", "abduction"][0] * outward > 0.3
        assert shifts["shin", "flexion"][2] < -0.3
        assert shifts["upper arm", "flexion"][1] > 0.5  # above the head
        assert shifts["upper arm", "abduction"][0] * outward > 0.2
        assert shifts["forearm", "flexion"][2] > 0.1
    spine = {limit.name: limit for limit in JointLimits.human().limits}
    tilt = spine["spine 1 tilt"]
    row = np.zeros(296)
    row[tilt.baps[0]] = np.radians(tilt.low) * 1e5  # 29 degrees, against 17 the other way: bowing
    assert solver.pose(row)[number("skullbase"), 2, 3] - rest[number("skullbase"), 2, 3] > 0.2


def test_vertebrae_share_a_limit() -> None:
    assert within(vl5_roll=6, vl4_roll=6, vl3_roll=5)
    bent = degrees(vl5_roll=12, vl4_roll=12, vl3_roll=12)
    (found,) = JointLimits.human().check(bent)
    assert (found.limit.name, found.frames, found.first) == ("spine 1 roll", 1, 0)
    assert found.worst == pytest.approx(18)
    clamped = JointLimits.human().clamp(bent)
    assert clamped.shape == (296,)
    np.testing.assert_allclose(clamped, degrees(vl5_roll=6, vl4_roll=6, vl3_roll=6), atol=1)


def test_clamp_changes_only_what_is_too_much() -> None:
    rows = np.stack([degrees(l_knee_flexion=a, l_hip_flexion=10) for a in (-200, -100, 0, 5)])
    found = JointLimits.human().clamp(rows)
    np.testing.assert_allclose(found[:, NUMBERS["l_knee_flexion"] - 1],
                               np.radians([-113, -100, 0, 0]) * 1e5, atol=1)  # fmt: skip
    np.testing.assert_allclose(found[:, NUMBERS["l_hip_flexion"] - 1], np.radians(10) * 1e5, atol=1)
    assert not JointLimits.human().check(found)
    (excess,) = JointLimits.human().check(rows)
    assert (excess.frames, excess.first) == (2, 0)
    assert excess.worst == pytest.approx(87)
    assert "left shin flexion: beyond -113..0 degrees in 2 frames, by 87.0 at worst" in str(excess)


@pytest.mark.parametrize("kind", [JointLimits.human, JointLimits.iso])
def test_clamped_is_within(kind) -> None:  # type: ignore[no-untyped-def]
    rows = np.random.default_rng(3).integers(-300_000, 300_000, (50, 296))
    rows[:, 180:183] //= 1000
    limits = kind()
    assert len(limits.check(rows)) > 30
    clamped = limits.clamp(rows)
    assert not limits.check(clamped)
    np.testing.assert_array_equal(limits.clamp(clamped), clamped)
    np.testing.assert_array_equal(clamped[:, 180:183], rows[:, 180:183])


def test_whole_turns_do_not_count() -> None:
    assert within(l_elbow_flexion=90 + 360)
    assert within(l_shoulder_flexion=-175)  # 185 the other way round
    assert not JointLimits.iso().check(degrees(l_elbow_flexion=-340))


def test_standards_ranges() -> None:
    (found,) = JointLimits.iso().check(degrees(l_shoulder_flexion=90))
    assert found.limit.high == pytest.approx(np.degrees(1860 * 64e-5))
    assert not JointLimits.iso().check(degrees(l_shoulder_flexion=68))


def test_wrong_input_to_limits() -> None:
    for bad in (np.zeros((2, 100)), np.full((1, 296), np.nan), np.zeros((1, 1, 296))):
        with pytest.raises(ValueError, match="JointLimits"):
            JointLimits.human().check(bad)
        with pytest.raises(ValueError, match="JointLimits"):
            JointLimits.human().clamp(bad)
    assert JointLimits.human().check(np.zeros((0, 296))) == ()
    assert JointLimits.human().clamp(np.zeros((0, 296))).shape == (0, 296)
