"""Every FAP moves its own point by value x FAPU, in the direction that the table names.

The neutral face: its units, its symmetry, and the standard's rules for it.
"""

import numpy as np
import pytest

from fba.errors import ModelError
from fba.face import Fapu, FeaturePointFace, feature_point_names, neutral_points
from fba.parameters import Fap, faps, feature_points

PLACE = dict(zip(feature_point_names(), neutral_points(), strict=True))
FACE = FeaturePointFace()
ROW = {name: row for row, name in enumerate(feature_point_names())}
AXIS = {"left": (0, 1), "right": (0, -1), "up": (1, 1), "down": (1, -1), "forward": (2, 1)}
MILLIMETRES = {"IRISD": 11.7, "ES": 62.0, "ENS": 45.0, "MNS": 21.5, "MW": 52.0}
SHIFTING = [f for f in faps() if f.unit in MILLIMETRES and f.positive in AXIS and f.feature_points]


def moved(**values: float) -> np.ndarray:
    """Displacement (84, 3) in millimetres for FAPs given as f3=100."""
    vector = np.zeros(68)
    for name, value in values.items():
        vector[int(name[1:]) - 1] = value
    return (FACE(vector).astype(float) - FACE.points) * 1000


@pytest.mark.parametrize("fap", SHIFTING, ids=lambda f: f.name)
@pytest.mark.parametrize("value", [100, -70])
def test_own_point_moves_by_value_times_unit(fap: Fap, value: int) -> None:
    axis, sign = AXIS[fap.positive]
    expected = sign * value * MILLIMETRES[fap.unit] / 1024
    for point in fap.feature_points:
        shift = moved(**{f"f{fap.number}": value})[ROW[point]]
        assert shift[axis] == pytest.approx(expected, abs=2e-4)
        if fap.number != 3:  # the jaw swings on an arc
            assert np.abs(np.delete(shift, axis)).max() < 2e-4


def test_that_table_covers_every_shifting_fap() -> None:
    # 66 low-level FAPs, less 8 of the eyeballs and pupils, the tongue's roll, and 3 of the head
    assert len(SHIFTING) == 66 - 8 - 1 - 3


@pytest.mark.parametrize("fap", [f for f in SHIFTING if f.left_right_mate], ids=lambda f: f.name)
def test_the_mate_stays(fap: Fap) -> None:
    mate = faps()[fap.left_right_mate - 1]  # type: ignore[operator]
    shift = moved(**{f"f{fap.number}": 200})
    for point in mate.feature_points:
        assert np.abs(shift[ROW[point]]).max() < 1e-4


def test_open_jaw_swings_back_and_leaves_lips_and_upper_teeth() -> None:
    shift = moved(f3=1000)
    chin = shift[ROW["2.1"]]
    assert chin[1] == pytest.approx(-1000 * 21.5 / 1024, abs=1e-3)
    assert chin[2] < 0
    hinge = FACE.jaw_hinge * 1000
    for point in ("2.1", "2.10", "9.11", "6.1"):
        before = FACE.points[ROW[point]] * 1000 - hinge
        after = before + shift[ROW[point]]
        assert np.hypot(*after[1:]) == pytest.approx(np.hypot(*before[1:]), rel=1e-5)
    assert np.abs(shift[[ROW[p] for p in ("2.2", "2.3", "8.2", "9.10", "9.3")]]).max() < 1e-4


def test_lids_meet_at_1024() -> None:
    vector = np.zeros(68)
    vector[18], vector[20] = 700, 324
    points = FACE(vector)
    assert points[ROW["3.1"], 1] == pytest.approx(points[ROW["3.3"], 1], abs=1e-7)


@pytest.mark.parametrize(
    ("fap", "axis", "sign", "pupil", "other"),
    [
        (23, 0, 1, "3.5", "3.6"),
        (24, 0, 1, "3.6", "3.5"),
        (25, 1, -1, "3.5", "3.6"),
        (26, 1, -1, "3.6", "3.5"),
    ],
)
def test_eyeballs_turn_about_their_centre(fap: int, axis: int, sign: int, pupil: str, other: str) -> None:
    angle = 0.3
    vector = np.zeros(68)
    vector[fap - 1] = angle * 1e5
    points = FACE(vector).astype(float)
    radius = FACE.eyeball_radius
    shift = points[ROW[pupil]] - FACE.points[ROW[pupil]]
    assert shift[axis] == pytest.approx(sign * radius * np.sin(angle), abs=1e-7)
    assert shift[2] == pytest.approx(radius * (np.cos(angle) - 1), abs=1e-7)
    assert np.abs(points[ROW[other]] - FACE.points[ROW[other]]).max() < 1e-7


def test_pupils_grow_and_eyeballs_come_forward() -> None:
    vector = np.zeros(68)
    vector[28], vector[26] = 300, 100
    eyes = FACE.eyeballs(vector)
    assert eyes.pupils[0] * 1000 == pytest.approx([11.7 / 3 + 300 * 11.7 / 1024, 11.7 / 3])
    assert (eyes.centres[0, 0, 2] - FACE.eyeball_centres[0, 2]) * 1000 == pytest.approx(100 * 62 / 1024)


@pytest.mark.parametrize(
    ("fap", "point", "axis", "sign"),
    [(48, "9.3", 1, -1), (49, "9.3", 0, 1), (50, "11.4", 0, -1)],
    ids=["pitch down", "yaw left", "roll right"],
)
def test_the_head_turns_about_the_top_of_the_spine(fap: int, point: str, axis: int, sign: int) -> None:
    vector = np.zeros(68)
    vector[fap - 1] = 0.25 * 1e5
    points = FACE(vector).astype(float)
    assert sign * (points[ROW[point]] - FACE.points[ROW[point]])[axis] > 0.02
    centre = FACE.points[ROW["7.1"]]
    np.testing.assert_allclose(points[ROW["7.1"]], centre, atol=1e-7)
    before, after = (np.linalg.norm(p - centre, axis=1) for p in (FACE.points, points))
    np.testing.assert_allclose(after, before, atol=1e-7)
    turn = FACE.head_rotation(vector)
    assert np.arccos((np.trace(turn) - 1) / 2) == pytest.approx(0.25)


def test_tongue_rolls_both_borders_up() -> None:
    shift = moved(f47=60000)
    left, right = shift[ROW["6.3"]], shift[ROW["6.4"]]
    assert left[1] > 2
    assert left[1] == pytest.approx(right[1])
    assert left[0] == pytest.approx(-right[0], abs=1e-4)
    assert left[0] < -1


def test_frames_in_a_batch_equal_frames_alone() -> None:
    values = np.random.default_rng(3).integers(-300, 300, (5, 68))
    together = FACE(values)
    assert together.dtype == np.float32
    assert together.shape == (5, 84, 3)
    for row, one in zip(values, together, strict=True):
        np.testing.assert_allclose(FACE(row), one, atol=1e-7)
        np.testing.assert_allclose(FACE.local(row), FACE.local(row[None])[0], atol=1e-7)


@pytest.mark.parametrize("shape", [(67,), (2, 69), (1, 1, 68), ()])
def test_other_shapes_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="68"):
        FACE(np.zeros(shape))


def test_extreme_values_stay_finite() -> None:
    for value in (1860 * 1000, -1860 * 1000):
        assert np.isfinite(FACE(np.full(68, value))).all()


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
