"""Views and the shape that they show: an exact camera is found again, and so is a head from two of them."""

from __future__ import annotations

import numpy as np
import pytest

from fba.arrays import Float64
from fba.face import FaceModel
from fba.face.feature_points import MIRRORED
from fba.face.fitting import FRONT_POINTS, SIDE_POINTS
from fba.face.fitting._views import (
    Observation,
    View,
    _slopes,
    _turned,
    face_covariance,
    first_view,
    fit_views,
    solve,
)
from fba.geometry import fit_similarity
from fba.parameters import point_rows
from fba.rotations import turn

BASE = FaceModel.default().points


def camera(yaw: float, pitch: float, distance: float = 1.5) -> View:
    """A camera at these degrees to the subject's left and above."""
    around = turn(np.array([0.0, 1.0, 0.0]), np.radians(-yaw))
    up = turn(np.array([1.0, 0.0, 0.0]), np.radians(pitch))
    return View(up @ around, 3000.0, np.array([500.0, 600.0]), distance)


def observe(view: View, points: Float64, names: tuple[str, ...]) -> Observation:
    rows = [point_rows()[name] for name in names]
    return Observation(rows, view.project(points[rows]))


def other_head(seed: int) -> Float64:
    """Feature points of another head, alike on both sides."""
    random = np.random.default_rng(seed)
    known = np.isfinite(BASE[:, 0])
    shift = random.multivariate_normal(
        np.zeros(3 * known.sum()), face_covariance(BASE[known]), method="cholesky"
    )
    points = BASE.copy()
    points[known] += shift.reshape(-1, 3)
    return points


def test_the_camera_s_angles_are_those_of_its_place() -> None:
    assert camera(10, -5).degrees == pytest.approx((10, -5), abs=0.2)
    assert camera(90, 0).degrees == pytest.approx((90, 0), abs=1e-6)


def test_slopes_are_those_of_small_differences() -> None:
    view, points = camera(20, 8), BASE[[point_rows()[name] for name in ("3.5", "9.3", "10.5")]]
    by_point, by_view = _slopes(view, points)
    step = 1e-6
    for axis in range(3):
        moved = points + step * np.eye(3)[axis]
        assert (view.project(moved) - view.project(points)) / step == pytest.approx(
            by_point[:, :, axis], rel=1e-3, abs=0.1
        )
        other = View(_turned(view.rotation, step * np.eye(3)[axis]), view.scale, view.shift, view.distance)
        assert (other.project(points) - view.project(points)) / step == pytest.approx(
            by_view[:, :, axis], rel=1e-3, abs=0.1
        )


@pytest.mark.parametrize(("yaw", "pitch"), [(0, 0), (10, -10), (-25, 15)])
def test_a_view_of_a_known_head_is_exact(yaw: float, pitch: float) -> None:
    true = camera(yaw, pitch)
    seen = observe(true, BASE, FRONT_POINTS)
    (found,) = fit_views(BASE, [first_view(BASE, seen, 1.5)], [seen])
    assert found.degrees == pytest.approx(true.degrees, abs=1e-3)
    assert found.scale == pytest.approx(true.scale, rel=1e-5)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_two_views_show_a_head_s_depth(side: float) -> None:
    points = other_head(4)
    true = [camera(7, 4), camera(side * 82, -3)]
    names = SIDE_POINTS if side > 0 else tuple(MIRRORED.get(name, name) for name in SIDE_POINTS)
    seen = [observe(true[0], points, FRONT_POINTS), observe(true[1], points, names)]
    first = [first_view(BASE, seen[0], 1.5), first_view(BASE, seen[1], 1.5, side=side)]
    found, views = solve(BASE, fit_views(BASE, first, seen), seen)
    rows = [point_rows()[name] for name in FRONT_POINTS]
    away, alone = (
        np.linalg.norm(fit_similarity(one[rows], points[rows]).apply(one[rows]) - points[rows], axis=1)
        for one in (found, BASE)
    )
    assert away.mean() < 0.4 * alone.mean()
    for view, one in zip(views, seen, strict=True):
        off = np.linalg.norm(view.project(found[one.rows]) - one.places, axis=1) / view.scale
        assert off.max() < 0.001
    assert abs(views[1].degrees[0]) == pytest.approx(82, abs=6)


@pytest.mark.parametrize("seed", [4, 5])
def test_hair_on_the_skull_changes_little_of_the_face_s_depth(seed: int) -> None:
    haired, bald = other_head(seed), other_head(seed)
    bald[[point_rows()["11.4"], point_rows()["11.6"]]] += [(0, -0.018, 0), (0, -0.012, 0.013)]
    rows, found = [point_rows()[name] for name in FRONT_POINTS], []
    for points in (haired, bald):
        seen = [observe(camera(7, 4), points, FRONT_POINTS), observe(camera(82, -3), points, SIDE_POINTS)]
        first = [first_view(BASE, seen[0], 1.5), first_view(BASE, seen[1], 1.5, side=1.0)]
        shape = solve(BASE, fit_views(BASE, first, seen), seen)[0]
        found.append(fit_similarity(shape[rows], haired[rows]).apply(shape[rows]))
    assert np.linalg.norm(found[0] - found[1], axis=1).mean() < 0.00025


def test_a_wrong_point_moves_the_others_little() -> None:
    points = other_head(5)
    seen = observe(camera(0, 0), points, FRONT_POINTS)
    wrong = Observation(seen.rows, seen.places + 60.0 * (np.arange(len(seen.rows)) == 9)[:, None])
    first = first_view(BASE, seen, 1.5)
    good, bad = (solve(BASE, [first], [one])[0] for one in (seen, wrong))
    others = [row for k, row in enumerate(seen.rows) if abs(k - 9) > 3]
    assert np.abs(good - bad)[others].max() < 0.004
