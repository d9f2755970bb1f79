"""Silhouettes of meshes, beside exact areas and the formulas of a camera."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from fba.body import BodyModel
from fba.errors import ModelError
from fba.face import FaceModel
from fba.outlines import Figure, View, draw_silhouette
from fba.outlines._raster import fill_triangles
from fba.parameters import BAP_COUNT, FAP_COUNT, bap_numbers

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)


def ball() -> tuple[np.ndarray, np.ndarray]:
    points = np.random.default_rng(1).normal(size=(2000, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    return points, ConvexHull(points).simplices


@pytest.mark.parametrize("view", [View(), View(30, 20), View(-110, -40)])
def test_a_ball_is_a_disc_from_all_sides(view: View) -> None:
    mask = draw_silhouette(*ball(), view)
    assert mask.shape == pytest.approx((100, 100), abs=1)
    assert mask.sum() == pytest.approx(np.pi / 4 * 96**2, rel=0.01)


@pytest.mark.parametrize("view", [View(0, 0), View(33, 0), View(70, 25)])
def test_a_cube_covers_what_a_camera_sees(view: View) -> None:
    """The hull of its corners, projected by a camera at a distance of 4 radii, has this share of its box."""
    radius = np.sqrt(3.0)
    yaw, pitch = np.radians([view.yaw, view.pitch])
    back = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
    right = np.array([np.cos(yaw), 0, -np.sin(yaw)])
    up = np.cross(back, right)
    deep = 4 * radius - CUBE @ back
    seen = np.column_stack([CUBE @ right, CUBE @ up]) / deep[:, None]
    hull = ConvexHull(seen)
    box = np.ptp(seen, axis=0)
    mask = draw_silhouette(CUBE, ConvexHull(CUBE).simplices, view)
    assert mask.sum() == pytest.approx(hull.volume * (96 / box.max()) ** 2, rel=0.02)
    assert mask.shape == pytest.approx(tuple(box[::-1] * 96 / box.max() + 4), abs=1)


def test_a_camera_to_the_left_sees_the_left() -> None:
    """+x is the figure's left: seen from its front, it is to the right of the picture."""
    nose = np.array([[0, 0, 1], [0, 0.4, 0], [0, -0.4, 0], [0.3, 0, -0.1], [-0.3, 0, -0.1]], dtype=float)
    triangles = ConvexHull(nose).simplices
    left = draw_silhouette(nose, triangles, View(90))
    assert left[:, :20].sum() < left[:, -20:].sum()  # it looks to the left of the picture
    assert View(90).side == "left"
    assert View(-135, 30).side == "back right, +30 degrees"


def test_triangles_are_filled_on_both_faces() -> None:
    places = np.array([[1.0, 1.0], [8.0, 1.0], [1.0, 8.0]])
    masks = np.zeros((2, 10, 10), dtype=bool)
    for mask, order in zip(masks, ([0, 1, 2], [0, 2, 1]), strict=True):
        fill_triangles(places, np.array([order], dtype=np.int32), mask)
    y, x = np.mgrid[:10, :10] + 0.5
    assert np.array_equal(masks[0], (x >= 1) & (y >= 1) & (x + y <= 9))
    assert np.array_equal(masks[0], masks[1])


@pytest.mark.parametrize(
    ("vertices", "triangles", "text"),
    [
        (CUBE, np.empty((0, 3), dtype=int), "needs a mesh with triangles"),
        (CUBE * np.nan, np.array([[0, 1, 2]]), "finite vertices"),
        (CUBE, np.array([[0, 1, 8]]), "vertices beyond the 8"),
        (CUBE * 0, np.array([[0, 1, 2]]), "has no size"),
        (CUBE[:, ::-1] * [0, 1, 1], np.array([[0, 1, 2]]), "thin from this side"),
    ],
)
def test_meshes_that_cannot_be_drawn(vertices: np.ndarray, triangles: np.ndarray, text: str) -> None:
    with pytest.raises(ModelError, match=text):
        draw_silhouette(vertices, triangles)


def test_a_person_is_one_figure_that_moves() -> None:
    figure = Figure(FaceModel.default(), BodyModel.default())
    faps, baps = np.zeros(FAP_COUNT, dtype=np.int32), np.zeros(BAP_COUNT, dtype=np.int32)
    rest = figure.vertices(faps, baps)
    assert len(figure.joints) == len(rest) == figure.triangles.max() + 1
    assert 1.5 < np.ptp(rest[:, 1]) < 2.0
    baps[bap_numbers()["r_shoulder_abduct"] - 1] = -157_080
    raised = draw_silhouette(figure.vertices(faps, baps), figure.triangles)
    before = draw_silhouette(rest, figure.triangles)
    assert raised.shape[1] > 1.3 * before.shape[1]
    right_half = raised[:, : raised.shape[1] // 2]  # of the picture, where the right arm is
    assert right_half.any(axis=0).all() or right_half[:, 2:].any(axis=0).all()
    head = Figure(FaceModel.default(), None)
    assert head.vertices(faps, baps).shape == (head.triangles.max() + 1, 3)
