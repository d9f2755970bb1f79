"""The standard's tables: sizes, groups, steps and limits, against figures from outside the CSV files."""

import csv
from pathlib import Path

import numpy as np
import pytest

from fba import parameters

GROUP_NAMES_OF_FAPS = (2, 16, 12, 8, 4, 5, 3, 10, 4, 4)
FIRST_OF_FAP_GROUPS = (1, 3, 19, 31, 39, 43, 48, 51, 61, 65)
BAP_GROUP_SIZES = (3, 4, 4, 6, 6, 5, 5, 7, 7, 12, 15, 18, 18, 12, 16, 16, 13, 13, 6, 22, 22, 22, 22, 22)


def test_faps() -> None:
    faps = parameters.faps()
    assert [fap.number for fap in faps] == list(range(1, 69))
    assert len({fap.name for fap in faps}) == 68
    assert tuple(len(group) for group in parameters.fap_groups()) == GROUP_NAMES_OF_FAPS
    assert tuple(group[0] for group in parameters.fap_groups()) == FIRST_OF_FAP_GROUPS
    assert [number for group in parameters.fap_groups() for number in group] == list(range(1, 69))
    assert {fap.unit for fap in faps} == {"", "MNS", "MW", "IRISD", "ES", "ENS", "AU"}
    assert [fap.number for fap in faps if fap.direction == "U"] == [3, 14, 41, 42, 47]
    assert parameters.fap_numbers()["open_jaw"] == 3
    assert faps[2].label == "FAP 3 open_jaw"
    assert (faps[0].i_limits, faps[0].p_limits) == (None, None)


def test_limits_of_faps() -> None:
    """What the standard prints for the jaw and the head, and its largest limit."""
    faps = parameters.faps()
    assert (faps[2].step, faps[2].i_limits, faps[2].p_limits) == (4, (0, 1080), (-360, 360))
    assert (faps[47].step, faps[47].i_limits) == (170, (-1860, 1860))
    assert max(max(fap.i_limits) for fap in faps[2:] if fap.i_limits) == 1860
    assert faps[62].i_limits == (-680, 680)
    steps = parameters.fap_steps()
    assert steps.shape == (68,)
    assert steps.dtype == np.int64
    assert (steps[2:] > 0).all()
    with pytest.raises(ValueError, match="read-only"):
        steps[0] = 1


def test_mates_are_mutual() -> None:
    """Left and right, and inner and outer lips."""
    faps = parameters.faps()
    for fap in faps:
        for mate in (fap.left_right_mate,):
            if mate is not None:
                assert faps[mate - 1].left_right_mate == fap.number
        if fap.lip_mate is not None:
            assert faps[fap.lip_mate - 1].lip_mate == fap.number
            assert {fap.group, faps[fap.lip_mate - 1].group} == {2, 8}
    assert sum(fap.lip_mate is not None for fap in faps) == 20


def test_baps() -> None:
    baps = parameters.baps()
    assert [bap.number for bap in baps] == list(range(1, 297))
    assert len({bap.name for bap in baps}) == 296
    assert tuple(len(group) for group in parameters.bap_groups()) == BAP_GROUP_SIZES
    order = [number for group in parameters.bap_groups() for number in group]
    assert sorted(order) == list(range(1, 297))
    assert [list(group) for group in parameters.bap_groups()[19:]] == [
        list(range(first, first + 22)) for first in (187, 209, 231, 253, 275)
    ]
    assert [bap.number for bap in baps if bap.unit == "mm"] == [181, 182, 183]
    assert all(bap.i_limits is None and not bap.joint for bap in baps[186:])


def test_steps_of_baps() -> None:
    """How often each step stands in the standard's table; the vendor's table has its own."""
    values, counts = np.unique(parameters.bap_steps("iso"), return_counts=True)
    assert dict(zip(values.tolist(), counts.tolist(), strict=True)) == {
        1: 110,
        64: 15,
        128: 87,
        256: 82,
        512: 2,
    }
    assert np.flatnonzero(parameters.bap_steps() == 512).tolist() == [122, 123]
    vendor = parameters.bap_steps("visage")
    assert vendor[[180, 181, 182]].tolist() == [2, 2, 2]
    assert (vendor[:180] == 170).any()
    with pytest.raises(ValueError, match="bap_steps must be one of iso, visage, not 'vis'"):
        parameters.bap_steps("vis")


def test_limits_of_baps_are_multiples_of_60() -> None:
    for bap in parameters.baps()[:186]:
        assert bap.p_limits is not None
        for limit in (*bap.i_limits, *bap.p_limits):
            assert limit % 60 == 0
            assert abs(limit) <= 1860
        assert bap.i_limits[0] <= 0 <= bap.i_limits[1]


def test_feature_points_and_joints() -> None:
    points = parameters.feature_points()
    sizes = {group: sum(point.group == group for point in points) for group in range(2, 12)}
    assert sizes == {2: 14, 3: 14, 4: 6, 5: 4, 6: 4, 7: 1, 8: 10, 9: 15, 10: 10, 11: 6}
    assert all(point.name == f"{point.group}.{point.index}" for point in points)
    names = {point.name for point in points}
    for fap in parameters.faps():
        assert set(fap.feature_points) <= names
    joints = parameters.joints()
    assert len(joints) == 87
    seen: set[str | None] = {None}
    for joint in joints:
        assert joint.parent in seen  # parents come first
        seen.add(joint.name)
    assert [joint.name for joint in joints if joint.parent is None] == [joints[0].name]
    moved = {bap.joint for bap in parameters.baps() if bap.joint}
    assert moved <= seen


def test_high_level_names() -> None:
    assert len(parameters.VISEMES) == parameters.VISEME_SELECT_MAX + 1 == 15
    assert len(parameters.EXPRESSIONS) == parameters.EXPRESSION_SELECT_MAX + 1 == 7
    assert parameters.EXPRESSIONS[1:] == ("joy", "sadness", "anger", "fear", "disgust", "surprise")


def test_the_tables_as_given(shared: Path) -> None:
    """Every step, limit, group and mate as in the tables that came with the test material."""

    def rows(name: str) -> list[dict[str, str]]:
        with (shared / "spec" / name).open(newline="", encoding="utf-8") as file:
            return list(csv.DictReader(file))

    def limits(row: dict[str, str], kind: str) -> tuple[int, int] | None:
        low, high = row[f"{kind}_min_q"], row[f"{kind}_max_q"]
        return (int(low), int(high)) if low else None

    for row, fap in zip(rows("fap.csv"), parameters.faps(), strict=True):
        assert (int(row["fap_id"]), row["name_visual"], int(row["group"])) == (
            fap.number,
            fap.name,
            fap.group,
        )
        assert (limits(row, "i"), limits(row, "p")) == (fap.i_limits, fap.p_limits)
        assert int(row["quant_step"]) == fap.step
    for row, bap in zip(rows("bap.csv"), parameters.baps(), strict=True):
        assert (int(row["bap_id"]), row["name_visual"], int(row["group"])) == (
            bap.number,
            bap.name,
            bap.group,
        )
        assert (limits(row, "i"), limits(row, "p")) == (bap.i_limits, bap.p_limits)
        assert int(row["quant_step_standard"]) == bap.step_iso
        assert int(row["quant_step_visage"]) == bap.step_visage
        assert int(row["coding_order_index"]) == bap.coding_order
