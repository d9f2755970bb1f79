"""Every FAP moves its own point by value x FAPU, in the direction that the table names."""

from __future__ import annotations

import numpy as np
import pytest

from fba.face import FeaturePointFace, feature_point_names
from fba.parameters import Fap, faps

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
