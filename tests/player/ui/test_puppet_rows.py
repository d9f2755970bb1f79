"""What the puppeteer's sliders are: every FAP once, the body within human limits, left and right mirrored."""

from __future__ import annotations

import numpy as np
import pytest

import fba
from fba.animation import Animation, BodyTrack
from fba.body import BapSolver, Skeleton
from fba.body.solve.limits import JointLimits
from fba_player._ui.panels._puppet_rows import Group, Row, groups


def test_every_fap_has_one_slider() -> None:
    numbers = [number for group in groups() if group.kind == "fap" for number in group.numbers]
    assert sorted(numbers) == list(range(3, 69))


def test_faps_that_go_one_way_begin_at_zero() -> None:
    rows = {row.numbers[0]: row for group in groups() if group.kind == "fap" for row in group.rows}
    one_way = [fap.number for fap in fba.parameters.faps() if fap.direction == "U"]
    assert [number for number, row in sorted(rows.items()) if row.low == 0] == one_way
    assert all(row.low in (0, -row.high) for row in rows.values())
    assert (rows[49].unit, rows[49].high) == ("deg", 40)  # the gallery shows 45000e-5 rad, 25.8 degrees


def test_names_are_short_and_tell_sides_apart() -> None:
    for group in groups():
        titles = [row.title for row in group.rows]
        assert len(set(titles)) == len(titles)
        assert max(map(len, titles)) < 24
        for row in group.rows:
            assert row.title.endswith((" L", " R")) == bool(row.side)


def mirrored_rows() -> list[tuple[Group, Row, Row]]:
    return [
        (group, row, group.rows[row.mirror])
        for group in groups()
        for row in group.rows
        if row.kind == "bap" and row.side == "l" and row.mirror is not None
    ]


@pytest.mark.parametrize(
    ("group", "row", "other"), mirrored_rows(), ids=lambda one: getattr(one, "title", "")
)
def test_both_sides_are_mirror_images(group: Group, row: Row, other: Row) -> None:
    skeleton = Skeleton.default()
    solver = BapSolver(skeleton)
    baps = np.zeros(296)
    angle = (row.high if row.high > -row.low else row.low) * 0.8
    for one, sign in ((row, 1.0), (other, -1.0 if row.flipped else 1.0)):
        for number in one.numbers:
            baps[number - 1] = sign * angle / row.scale / len(one.numbers)
    turned, rest = solver.pose(baps), solver.pose(np.zeros(296))
    names = list(skeleton.names)
    moved = 0.0
    for place, name in enumerate(names):
        if name.startswith("l_"):
            left, right = turned[place], turned[names.index("r_" + name[2:])]
            np.testing.assert_allclose(left[:3, 3] * (-1, 1, 1), right[:3, 3], atol=2e-3)
            flip = np.diag([-1.0, 1.0, 1.0])
            np.testing.assert_allclose(flip @ left[:3, :3] @ flip, right[:3, :3], atol=1e-6)
            moved = max(moved, float(np.abs(left - rest[place]).max()))
    assert moved > 0.05


def test_the_body_stays_within_human_limits_and_fits_a_stream() -> None:
    human = {limit.baps for limit in JointLimits.human().limits}
    for end in ("low", "high"):
        baps = np.zeros((2, 296), np.int32)
        limited = np.zeros((2, 296), np.int32)
        for group in groups():
            for row in group.rows:
                if row.kind == "bap":
                    for number in row.numbers:
                        value = round(getattr(row, end) / row.scale / len(row.numbers))
                        baps[1, number - 1] = value
                        if tuple(number - 1 for number in row.numbers) in human:
                            limited[1, number - 1] = value
        assert not JointLimits.human().check(limited[:, :186])
        assert np.count_nonzero(limited[1]) > 40
        take = Animation(25, np.arange(2), body=BodyTrack(baps, np.ones(baps.shape, bool)))  # type: ignore[arg-type]
        assert fba.encode(take, fba.EncoderOptions(bap_steps="visage"))
