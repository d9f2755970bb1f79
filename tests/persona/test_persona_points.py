"""The mask, what lays points on it, distances of masks, and other trackers' points."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from scipy.spatial import procrustes
from scipy.spatial.distance import cdist

from fba.capture.points import PointMotion
from fba.errors import FbaWarning, ModelError
from fba.face import FaceModel, FeaturePointFace
from fba.persona import TrackedFace, from_point_motion
from fba.persona._observation import find_rest
from fba.persona.points import fit_face_points, mask_distance, register
from fba.persona.points.layout import (
    PARTS,
    compute_vertices,
    part_points,
    points_of_face,
    standard_mask,
    standard_points,
    triangles,
)
from fba.persona.recognition._faps import mask_faps, measure_fapu
from tools.captures.tracked_actor import film

RANDOM = np.random.default_rng(0)


def face_seen(yaw: float, scale: float = 3.0) -> TrackedFace:
    """The standard face, turned to its left by some degrees, seen from far away."""
    faps = np.zeros(68)
    faps[48] = np.radians(yaw) / 1e-5
    points = points_of_face(FeaturePointFace()(faps).astype(np.float64))[:64]
    picture = scale * points[None, :, :2] * (1, -1) + (320, 240)
    angles = np.radians([[0.0, yaw, 0.0]])
    return TrackedFace(picture, angles, np.ones(1, dtype=bool), np.zeros(1), Fraction(30))


def test_the_mask_has_86_vertices_and_130_triangles_that_face_forward() -> None:
    assert standard_mask().shape == (86, 3)
    assert triangles().shape == (130, 3)
    points = standard_mask()[triangles()]
    across, up = (points[:, 1] - points[:, 0])[:, :2], (points[:, 2] - points[:, 0])[:, :2]
    assert ((across[:, 0] * up[:, 1] - across[:, 1] * up[:, 0]) > -1e-9).all()  # lips at rest touch
    edges = {tuple(sorted(pair)) for one in triangles().tolist() for pair in zip(one, one[1:] + one[:1])}  # noqa: B905
    assert len({vertex for edge in edges for vertex in edge}) == 83  # reds of lips have no triangles


def test_every_part_has_its_points() -> None:
    assert {part: len(part_points(part)) for part in PARTS} == {
        "mouth": 27, "left_eye": 8, "right_eye": 8, "left_brow": 5, "right_brow": 5,
    }  # fmt: skip
    left = standard_points()[part_points("left_eye"), 0]
    assert (left > 0).all()
    assert (standard_points()[part_points("right_eye"), 0] < 0).all()


def test_computed_vertices_are_those_of_table_4_1() -> None:
    points = RANDOM.normal(size=(80, 2))
    x, y = (
        {n + 1: value for n, value in enumerate(points[:, 0])},
        {n + 1: v for n, v in enumerate(points[:, 1])},
    )
    mask = compute_vertices(points)
    expected = {
        "A": ((x[64] + x[62]) / 2, y[62] + (y[7] - y[62]) / 2),
        "C": (x[13], y[13] - (y[62] - y[13])),
        "F": (x[56], y[17]),
        "J": (x[22], y[45]),
        "L": (x[39], y[39] - (y[54] - y[48])),
        "S": ((x[75] + x[76]) / 2, (y[75] + y[76]) / 2),
        "X": (x[65], y[65]),
        "Z": ((x[69] + x[68]) / 2, (y[69] + y[68]) / 2),
    }
    for letter, place in expected.items():
        np.testing.assert_allclose(mask[60 + ord(letter) - ord("A")], place, atol=1e-12)
    np.testing.assert_array_equal(mask[:60], points[:60])


def test_procrustes_finds_what_was_done() -> None:
    points = RANDOM.normal(size=(3, 9, 2))
    turn = np.array([[np.cos(0.4), -np.sin(0.4)], [np.sin(0.4), np.cos(0.4)]])
    found = fit_face_points(points, 2.5 * points @ turn.T + (4, -1))
    np.testing.assert_allclose(found.scale, 2.5)
    np.testing.assert_allclose(found.rotation, np.broadcast_to(turn, (3, 2, 2)), atol=1e-12)
    np.testing.assert_allclose(found.misfit, 0, atol=1e-12)
    np.testing.assert_allclose(found.apply(points), 2.5 * points @ turn.T + (4, -1), atol=1e-12)
    flat = fit_face_points(points[0], np.concatenate([points[0], np.zeros((9, 1))], axis=1))  # padded
    np.testing.assert_allclose(flat.apply(points[0])[:, :2], points[0], atol=1e-12)


def test_the_misfit_is_that_of_scipy_and_mirrors_may_be_refused() -> None:
    points, others = RANDOM.normal(size=(2, 8, 3))
    assert float(fit_face_points(points, others).misfit) == pytest.approx(procrustes(others, points)[2])
    mirrored = points * (-1, 1, 1)
    assert float(fit_face_points(points, mirrored).misfit) == pytest.approx(0, abs=1e-12)
    refused = fit_face_points(points, mirrored, mirror=False)
    assert float(np.linalg.det(refused.rotation)) == pytest.approx(1)
    with pytest.raises(ModelError, match="all coincide"):
        fit_face_points(np.ones((4, 2)), points[:4, :2])


def test_distances_of_sets() -> None:
    points, others = np.array([[0.0, 0], [3, 0]]), np.array([[0.0, 4]])
    assert float(mask_distance(points, others)) == 4.5  # mean of 4 and 5
    assert float(mask_distance(others, points)) == 4
    one, two = RANDOM.normal(size=(2, 20, 3))
    assert float(mask_distance(one, two)) == pytest.approx(cdist(one, two).min(axis=1).mean())


@pytest.mark.parametrize("yaw", [0.0, 15.0, -29.0])
def test_a_turned_face_is_laid_on_the_mask(yaw: float) -> None:
    found = register(face_seen(yaw))
    np.testing.assert_allclose(found.points[0], standard_points()[:64, :2], atol=1e-3)


def test_faces_turned_by_more_than_30_degrees_are_left_out() -> None:
    found = register(face_seen(31.0))
    assert (found.turned.tolist(), found.kept.tolist()) == ([True], [False])
    assert np.isnan(found.points).all()


def test_points_not_arranged_as_a_face_are_refused() -> None:
    face = replace(face_seen(0.0), points=RANDOM.normal(size=(1, 64, 2)))
    assert register(face).alien.tolist() == [True]


def test_rows_that_are_not_finite_are_not_tracked() -> None:
    points = np.repeat(face_seen(0.0).points, 3, axis=0)
    points[1, 5, 0] = np.nan
    face = TrackedFace(points, np.zeros((3, 3)), np.array([True, True, False]), np.arange(3.0), Fraction(1))
    assert face.tracked.tolist() == [True, False, False]
    with pytest.raises(ModelError, match=r"\(T, 64, 2\), not \(3, 68, 2\)"):
        TrackedFace(np.zeros((3, 68, 2)), np.zeros((3, 3)), np.ones(3), np.arange(3.0), Fraction(1))


@pytest.mark.parametrize("count", [68, 478])
def test_points_of_other_trackers(count: int) -> None:
    """Heads turn by up to 26 degrees; the angles are found, and points lie as the face's own do."""
    take = film(FaceModel.default(), count, frames=60, flat=True, turn=0.7)
    face = from_point_motion(take.motion)
    assert face.tracked.all()
    off = face.angles - take.faps[:, 47:50] * 1e-5
    assert np.degrees(np.abs(off).mean(axis=0)).max() < 3
    assert np.degrees(np.abs(off - off.mean(axis=0)).max()) < 4
    own = register(face).points[0]
    real = points_of_face(FaceModel.default().points)[:60, :2]
    laid = fit_face_points(real, own[:60])
    assert np.linalg.norm(laid.apply(real) - own[:60], axis=1).mean() < 1.5  # millimetres


def test_points_in_another_order_are_refused() -> None:
    motion = film(FaceModel.default(), 68, frames=20, flat=True).motion
    with pytest.raises(ModelError, match="another tracker's, or in another order"):
        from_point_motion(PointMotion(np.roll(motion.positions, 9, axis=1), motion.times, motion.rate))


def test_a_film_that_does_not_begin_at_rest_has_its_rest_found() -> None:
    points = np.tile(standard_points()[:64, :2], (120, 1, 1))
    points += np.random.default_rng(2).normal(0, 0.1, points.shape)
    upper, lower, lip = [14 - 1, 23 - 1], [11 - 1, 13 - 1], 33 - 1
    opening = points[0, upper, 1] - points[0, lower, 1]
    points[:50, upper, 1] -= 0.7 * opening  # eyes half shut
    points[80:, lip, 1] -= 12.0  # the mouth open
    angles, times = np.zeros((120, 3)), np.arange(120) / 30
    with pytest.warns(FbaWarning, match=r"does not rest in the first second.*frames from (\d\.\d\d) to"):
        rows = find_rest(points, angles, times)
    assert len(rows) >= 5
    assert 50 <= rows[0] <= rows[-1] < 80
    angles[50:70, 1] = 0.6  # turned away
    with pytest.warns(FbaWarning, match="does not rest"):
        rows = find_rest(points, angles, times)
    assert 70 <= rows[0] <= rows[-1] < 80


def test_the_first_second_is_taken_where_it_rests() -> None:
    points = np.tile(standard_points()[:64, :2], (90, 1, 1))
    points[40:, 33 - 1, 1] -= 12.0
    assert find_rest(points, np.zeros((90, 3)), np.arange(90) / 30).tolist() == list(range(30))
    assert find_rest(points[50:53], np.zeros((3, 3)), np.arange(3) / 30).tolist() == [0, 1, 2]


def test_lids_open_only_so_far() -> None:
    moved = np.zeros((1, 86, 3))
    moved[:, :, 1] = 40.0
    faps = mask_faps(moved, measure_fapu(standard_points()[:64, :2]), np.zeros(5))
    assert faps[0, [18, 19]].tolist() == [-450, -450]
    moved[:, :, 1] = -40.0
    assert mask_faps(moved, measure_fapu(standard_points()[:64, :2]), np.zeros(5))[0, 20] == -150
