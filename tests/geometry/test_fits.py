"""Fits of points to points, against motions that are known and against SciPy."""

import numpy as np
import pytest
from scipy.spatial import procrustes
from scipy.spatial.transform import Rotation

from fba.geometry import fit_similarity, nearest_orthonormal, nearest_rotation, principal_axes

RNG = np.random.default_rng(7)
TURN = Rotation.from_rotvec((0.3, -1.1, 0.7)).as_matrix()
POINTS = RNG.normal(size=(12, 3))


@pytest.mark.parametrize("reflected", [False, True])
def test_a_similarity_is_recovered(reflected: bool) -> None:
    turn = TURN @ np.diag([-1.0, 1.0, 1.0]) if reflected else TURN
    fit = fit_similarity(POINTS, 2.5 * POINTS @ turn.T + (4, -1, 2), reflected=reflected)
    assert fit.rotation == pytest.approx(turn, abs=1e-12)
    assert float(fit.scale) == pytest.approx(2.5)
    assert fit.apply(POINTS) == pytest.approx(2.5 * POINTS @ turn.T + (4, -1, 2))
    assert float(fit.error) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize(("signs", "determinant"), [((1, 1, 1), 1), ((-1, 1, 1), -1)])
def test_a_fit_may_be_a_rotation_or_a_reflection(signs: tuple[int, int, int], determinant: int) -> None:
    fit = fit_similarity(POINTS, POINTS @ TURN.T * signs, reflected=None)
    assert np.linalg.det(fit.rotation) == pytest.approx(determinant)
    assert float(fit.misfit) == pytest.approx(0, abs=1e-12)


def test_the_misfit_is_the_disparity_of_scipy() -> None:
    others = RNG.normal(size=POINTS.shape)
    assert float(fit_similarity(POINTS, others, reflected=None).misfit) == pytest.approx(
        procrustes(others, POINTS)[2]
    )
    assert np.isnan(fit_similarity(POINTS, np.ones((12, 3))).misfit)
    assert np.isnan(fit_similarity(np.ones((12, 3)), POINTS).misfit)


def test_a_given_rotation_leaves_size_and_place_to_fit() -> None:
    """The centred points (-1, 0, 0) and (1, 0, 0) go to (-2, -1, 0) and (2, 1, 0): scale 4 / 2."""
    points, targets = np.array([[0.0, 5, 0], [2, 5, 0]]), np.array([[-2.0, 2, 7], [2, 4, 7]])
    fit = fit_similarity(points, targets, rotation=np.eye(3))
    assert float(fit.scale) == 2
    assert fit.apply(points) == pytest.approx(np.array([[-2.0, 3, 7], [2, 3, 7]]))
    assert float(fit.error) == 1


def test_flat_points_are_fitted_in_space() -> None:
    flat = POINTS[:, :2]
    targets = 3 * np.column_stack([flat, np.zeros(12)]) @ TURN.T + (4, -1, 2)
    assert fit_similarity(flat, targets).apply(flat) == pytest.approx(targets)


def test_weights_decide_between_two_motions() -> None:
    """The first six points turn, the others go away: what weighs nothing changes nothing."""
    targets = POINTS @ TURN.T
    targets[6:] += (9, 0, 0)
    weights = np.r_[np.ones(6), np.zeros(6)]
    fit = fit_similarity(POINTS, targets, weights)
    assert fit.rotation == pytest.approx(TURN, abs=1e-12)
    assert fit.apply(POINTS[:6]) == pytest.approx(targets[:6])


def test_noisy_points_fit_as_in_scipy() -> None:
    targets, weights = POINTS @ TURN.T + RNG.normal(size=POINTS.shape) / 5, RNG.random(12)
    share = weights / weights.sum()
    expected, _ = Rotation.align_vectors(targets - share @ targets, POINTS - share @ POINTS, weights=weights)
    assert fit_similarity(POINTS, targets, weights).rotation == pytest.approx(expected.as_matrix(), abs=1e-9)


def test_several_fits_at_once_equal_single_fits() -> None:
    several = RNG.normal(size=(4, 12, 3))
    fits = fit_similarity(several, several @ TURN.T * 3)
    assert fits.rotation == pytest.approx(np.tile(TURN, (4, 1, 1)), abs=1e-12)
    assert fits.scale == pytest.approx(np.full(4, 3.0))


def test_the_mean_of_rotations_lies_between_them() -> None:
    turns = Rotation.from_rotvec([(0, 0, 0.2), (0, 0, 0.6)]).as_matrix()
    expected = Rotation.from_rotvec((0, 0, 0.4)).as_matrix()
    assert nearest_rotation(turns.sum(axis=0)) == pytest.approx(expected, abs=1e-12)


def test_mirror_images_are_turned_back_or_kept() -> None:
    mirror = np.diag([1.0, 1.0, -0.5])
    assert np.linalg.det(nearest_rotation(mirror)) == pytest.approx(1)
    assert nearest_rotation(mirror, handed=-1.0) == pytest.approx(np.diag([1.0, 1.0, -1.0]))
    assert nearest_orthonormal(mirror) == pytest.approx(np.diag([1.0, 1.0, -1.0]))
    rows = nearest_orthonormal(np.array([[3.0, 0, 0], [0, 0.5, 0]]))
    assert rows == pytest.approx(np.eye(3)[:2])


def test_principal_axes_of_a_box() -> None:
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-3, 3) for z in (-2, 2)]) @ TURN.T
    axes, values = principal_axes(corners + 5.0)
    assert values == pytest.approx(np.sqrt(8) * np.array([3, 2, 1]))
    assert np.abs(axes @ TURN[:, [1, 2, 0]]) == pytest.approx(np.eye(3), abs=1e-12)
    assert principal_axes(corners[:2])[1][1:] == pytest.approx(0, abs=1e-12)
