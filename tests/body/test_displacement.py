"""How far two motions of a body are apart, against distances worked out by hand."""

import math

import numpy as np
import pytest

from fba.body import Skeleton
from fba.body.displacement import displacements
from fba.body.stance import find_standing, sole_points
from fba.parameters import BAP_COUNT, bap_numbers

SKELETON = Skeleton.default()


def still(count: int = 30, **baps: float) -> np.ndarray:
    """BAPs (count, 296) of a body that does not move."""
    result = np.zeros((count, BAP_COUNT))
    for name, value in baps.items():
        result[:, bap_numbers()[name] - 1] = value
    return result


def test_a_way_of_the_root_moves_every_joint_in_the_world_and_none_as_seen_from_the_root() -> None:
    moved = still(HumanoidRoot_tr_lateral=3, HumanoidRoot_tr_frontal=4)
    assert displacements(still(), moved, 25).joints == pytest.approx(0.005, abs=1e-9)
    assert displacements(still(), moved, 25, frame="root").joints == pytest.approx(0.0, abs=1e-9)


def test_a_turned_elbow_moves_points_below_it_along_chords() -> None:
    """Points 3 cm along the axis of the turn and across it; the shoulder above it stays."""
    apart = displacements(still(), still(l_elbow_flexion=20_000), 25).joints[0]  # 0.2 rad about x
    elbow, wrist = (SKELETON.centres[SKELETON.number(name)] for name in ("l_elbow", "l_wrist"))
    chord = 2 * math.sin(0.1)
    farthest = max(math.hypot(*(wrist - elbow + 0.03 * axis)[1:]) for axis in np.eye(3))
    assert apart[SKELETON.number("l_wrist")] == pytest.approx(chord * farthest, rel=1e-6)
    assert apart[SKELETON.number("l_elbow")] == pytest.approx(
        chord * 0.03, rel=1e-6
    )  # 3 cm, as others measure
    assert apart[SKELETON.number("l_shoulder")] == 0.0


def test_soles_count_while_they_stand() -> None:
    """The right foot stands; the left knee is drawn up, by a hip that is bent."""
    source = still(l_hip_flexion=-120_000, l_knee_flexion=-120_000)
    off = source.copy()
    off[:, bap_numbers()["HumanoidRoot_tr_vertical"] - 1] += 4
    feet = displacements(source, off, 25).feet
    assert feet[:, 0] == pytest.approx(0.0, abs=0.0)
    assert feet[:, 1] == pytest.approx(0.004, abs=1e-9)


def test_a_turned_ankle_moves_the_heel_of_a_foot_that_stands() -> None:
    turned = displacements(still(), still(r_subtalar_flexion=5_000), 25).feet[0, 1]
    sole = sole_points(SKELETON, "r")
    assert sole is not None
    centre = SKELETON.centres[SKELETON.number("r_subtalar")]
    reach = max(math.hypot(*(point - centre)[:2]) for point in sole.values())  # it turns about z
    assert turned == pytest.approx(2 * math.sin(0.025) * reach, rel=1e-6)


def test_feet_do_not_stand_in_the_air_or_in_a_single_frame() -> None:
    points = np.zeros((2, 2, 20, 3))
    assert find_standing(np.zeros((2, 20)), points, 25.0).all()
    assert not find_standing(np.full((2, 20), 0.2), points, 25.0).any()
    assert not find_standing(np.zeros((2, 1)), points[:, :, :1], 25.0).any()
    still_single = displacements(still(1), still(1, HumanoidRoot_tr_vertical=4), 25)
    assert still_single.feet.tolist() == [[0.0, 0.0]]


def test_shares_within_a_limit() -> None:
    moved = still(10)
    moved[:5, bap_numbers()["HumanoidRoot_tr_vertical"] - 1] = 4
    apart = displacements(still(10), moved, 25)
    assert apart.share_within(0.0039) == 0.5
    assert apart.share_within(0.0041) == 1.0


def test_motions_of_other_lengths_are_not_compared() -> None:
    with pytest.raises(ValueError, match="the source has 3 frames, what is shown 4"):
        displacements(still(3), still(4), 25)
