"""Limits of human motion: the table's numbers, seen as motions of limbs."""

import numpy as np
import pytest

from fba.body import BapSolver, JointLimits, Skeleton
from fba.parameters import bap_numbers

NUMBERS = bap_numbers()


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
