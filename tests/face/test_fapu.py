"""The neutral face: its units, its symmetry, and the standard's rules for it."""

from __future__ import annotations

import numpy as np
import pytest

from fba.errors import ModelError
from fba.face import Fapu, FeaturePointFace, feature_point_names, neutral_points
from fba.parameters import feature_points

PLACE = dict(zip(feature_point_names(), neutral_points(), strict=True))


def test_units_are_the_neutral_distances_over_1024() -> None:
    fapu = FeaturePointFace().fapu
    # distances of neutral.csv in millimetres, by hand
    for unit, millimetres in (("IRISD", 11.7), ("ES", 62.0), ("ENS", 45.0), ("MNS", 21.5), ("MW", 52.0)):
        assert fapu[unit] * 1024 * 1000 == pytest.approx(millimetres, rel=1e-9)
    assert fapu.AU == 1e-5


def test_every_point_of_the_standard_has_a_place() -> None:
    assert feature_point_names() == tuple(point.name for point in feature_points())
    assert neutral_points().shape == (84, 3)
    assert np.isfinite(neutral_points()).all()


def test_left_and_right_mirror_exactly() -> None:
    places = neutral_points()
    for place in places:
        assert (places == place * (-1.0, 1.0, 1.0)).all(axis=1).any()
    on_midline = {name for name, place in PLACE.items() if place[0] == 0}
    assert on_midline == {
        "2.1", "2.2", "2.3", "2.10", "6.1", "6.2", "7.1", "8.1", "8.2", "9.3", "9.8", "9.9", "9.10", "9.11",
        "9.12", "9.15", "11.1", "11.4", "11.5", "11.6",
    }  # fmt: skip


def test_neutral_face_keeps_the_rules_of_the_standard() -> None:
    lips = [PLACE[f"2.{i}"][1] for i in range(2, 10)]
    assert len(set(lips)) == 1  # touching, on a level line
    assert PLACE["9.10"][1] == PLACE["9.11"][1]  # teeth touching
    assert {PLACE[f"6.{i}"][1] for i in range(1, 5)} == {
        PLACE["9.11"][1]
    }  # tongue flat, its tip at the teeth
    pupils = FeaturePointFace().eyeballs(np.zeros(68)).pupils
    assert pupils[0] == pytest.approx([0.0117 / 3, 0.0117 / 3])
    gaze = FeaturePointFace().eyeballs(np.zeros(68)).gaze
    np.testing.assert_array_equal(gaze[0], [[0, 0, 1], [0, 0, 1]])


@pytest.mark.parametrize(
    ("point", "ends", "axis"),
    [
        ("2.6", ("2.2", "2.4"), 0),
        ("2.9", ("2.3", "2.5"), 0),
        ("4.3", ("4.1", "4.5"), 0),
        ("8.5", ("8.3", "8.1"), 0),
        ("8.8", ("8.4", "8.2"), 0),
        ("10.3", ("10.1", "10.5"), 1),
    ],
)
def test_points_defined_as_midway(point: str, ends: tuple[str, str], axis: int) -> None:
    assert PLACE[point][axis] == pytest.approx((PLACE[ends[0]][axis] + PLACE[ends[1]][axis]) / 2, abs=1e-9)


@pytest.mark.parametrize(
    ("unit", "point"), [("IRISD", "3.1"), ("ES", "3.5"), ("ENS", "9.15"), ("MNS", "2.2"), ("MW", "8.3")]
)
def test_a_face_without_extent_is_refused(unit: str, point: str) -> None:
    flat = neutral_points().copy()
    rows = dict(zip(feature_point_names(), range(84), strict=True))
    other = {"3.1": ("3.1", "3.2"), "3.5": ("3.5",), "9.15": ("9.15",), "2.2": ("2.2",), "8.3": ("8.3",)}[
        point
    ]
    for name in other:
        flat[rows[name]] = -1.0 if point != "2.2" else 1.0
        if point == "9.15":
            flat[rows[name]] = 1.0
    with pytest.raises(ModelError, match=f"{unit}0"):
        Fapu.measure(flat)


def test_points_that_are_not_finite_are_named() -> None:
    broken = neutral_points().copy()
    broken[feature_point_names().index("5.3")] = np.nan
    with pytest.raises(ModelError, match=r"5\.3"):
        FeaturePointFace(broken)
    with pytest.raises(ModelError, match="shape"):
        FeaturePointFace(np.zeros((83, 3)))
