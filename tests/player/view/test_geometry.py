"""Small geometry of the player: rotations, rectangles that are filled, eyeballs, hairs.

Cameras as text, as the command line takes them and the window copies them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fba.compiled import is_compiled
from fba.face.model import FaceModel, Part
from fba_player._figure._face_parts import find_hairs
from fba_player._figure.face import find_eyeball
from fba_player._mesh.primitives import sphere_mesh
from fba_player.gl._antialias_region import bounding_rectangles
from fba_player.gl._silhouette import TILE, Outliner
from fba_player.view._camera import Camera, Subject
from fba_player.view._geometry import rotation_vector, turn_partly
from fba_player.view._view import FaceMesh, FaceShape, Mesh, MeshShape, View


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.5, 2.0, 3.1, np.pi])
def test_a_rotation_as_axis_and_angle(angle: float) -> None:
    random = np.random.default_rng(3)
    for _ in range(50):
        axis = random.standard_normal(3)
        axis /= np.linalg.norm(axis)
        matrix = Rotation.from_rotvec(axis * angle).as_matrix()
        vector = rotation_vector(matrix)
        assert np.linalg.norm(vector) == pytest.approx(angle, abs=1e-7)
        np.testing.assert_allclose(Rotation.from_rotvec(vector).as_matrix(), matrix, atol=1e-7)


def square(x: float, half: float) -> Mesh:
    corners = np.array([[x - half, -half, 0], [x + half, -half, 0], [x + half, half, 0], [x - half, half, 0]])
    shape = MeshShape(np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32), np.zeros((4, 4), dtype=np.float32))
    return Mesh(shape, corners.astype(np.float32), np.zeros((4, 3), dtype=np.float32), np.eye(4))


def test_rectangles_hold_what_is_drawn() -> None:
    camera, size = Camera(distance=1 / np.tan(np.radians(12))), (200, 100)
    matrix = camera.projection_matrix(2.0) @ camera.view_matrix()  # 1 m is half the height
    left, right = square(-1.0, 0.2), square(0.8, 0.4)
    found = sorted(bounding_rectangles(View([left, right]), matrix, size))
    assert len(found) == 2
    for (x, y, wide, high), middle, half in zip(found, (50, 140), (10, 20), strict=True):
        assert x <= middle - half
        assert x + wide >= middle + half
        assert y <= 50 - half
        assert y + high >= 50 + half
        assert wide < 2.5 * half + 12
    assert bounding_rectangles(View([square(0, 0.1), square(0, 0.4)]), matrix, size) == bounding_rectangles(
        View([square(0, 0.4)]), matrix, size
    )
    assert bounding_rectangles(View(), matrix, size) == []
    assert bounding_rectangles(View([square(50, 0.1)]), matrix, size) == []


def test_what_reaches_behind_the_camera_may_fill_everything() -> None:
    camera = Camera(distance=1.0)
    matrix = camera.projection_matrix(1.0) @ camera.view_matrix()
    around = square(0, 5.0)
    deep = replace(
        around, positions=around.positions + np.array([[0, 0, 9], [0, 0, 0]] * 2, dtype=np.float32)
    )
    assert bounding_rectangles(View([deep]), matrix, (64, 64)) == [(0, 0, 64, 64)]


def eye_part(vertices: np.ndarray) -> Part:
    return Part("ball", "eye", vertices, sphere_mesh(20, 32)[1])


def test_an_eyeball_is_found_under_its_cornea() -> None:
    model = FaceModel.default()
    vertices = sphere_mesh(20, 32)[0].astype(float)
    front = vertices[:, 2] > 0.87
    vertices[front] *= (1 + 0.08 * (vertices[front, 2:] - 0.87) / 0.13) ** 1
    ball = find_eyeball(eye_part(vertices * 0.012 + (0.03, 0.01, -0.012)), model)
    assert ball is not None
    np.testing.assert_allclose(ball.centre, (0.03, 0.01, -0.012), atol=1e-4)
    assert ball.radius == pytest.approx(0.012, rel=0.01)
    assert ball.side == 0


def test_an_eye_that_is_not_round_is_drawn_as_a_mesh() -> None:
    model = FaceModel.default()
    vertices = sphere_mesh(20, 32)[0].astype(float)
    assert find_eyeball(eye_part(vertices * (0.012, 0.012, 0.004)), model) is None
    pair = np.concatenate([vertices * 0.012 + (0.03, 0, 0), vertices * 0.012 - (0.03, 0, 0)])
    both = Part("eyes", "eye", pair, np.zeros((0, 3), dtype=int))
    assert find_eyeball(both, model) is None
    assert find_eyeball(Part("few", "eye", vertices[:5] * 0.012, np.zeros((0, 3), dtype=int)), model) is None


def test_hairs_know_their_sides_and_their_tip() -> None:
    root = np.array([[-1, 0, 0], [1, 0, 0], [-0.5, 5, 0], [0.5, 5, 0], [0, 9, 0]]) * 2e-4
    triangles = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4]])
    two = np.concatenate([root, root + np.array([0.01, 0, 0])])
    found = find_hairs(Part("lash", "lash", two, np.concatenate([triangles, triangles + 5])))
    assert found is not None
    for start in (0, 5):
        rows = found[start : start + 5]
        np.testing.assert_allclose(rows[0, :3], (-1, 0, 0), atol=1e-6)
        np.testing.assert_allclose(rows[1, :3], (1, 0, 0), atol=1e-6)
        np.testing.assert_allclose(rows[:4, 3], (2e-4, 2e-4, 1e-4, 1e-4), rtol=1e-5)
        assert (rows[:4, 5] > 0.97).all()  # towards the tip
        assert rows[0, 7] == -rows[1, 7]
        np.testing.assert_array_equal(rows[4, :7], 0)


def test_broad_strips_are_not_hairs() -> None:
    vertices = np.array([[0, 0, 0], [0.02, 0, 0], [0, 0.01, 0], [0.02, 0.01, 0]])
    assert find_hairs(Part("strip", "lash", vertices, np.array([[0, 1, 2], [1, 3, 2]]))) is None
    assert find_hairs(Part("nothing", "lash", vertices, np.zeros((0, 3), dtype=int))) is None


@pytest.mark.skipif(not is_compiled(), reason="without numba, rectangles are smoothed instead")
def test_the_outline_of_a_ball_is_a_circle() -> None:
    vertices, triangles = sphere_mesh(24, 48)
    shape = FaceShape(triangles, np.zeros((len(vertices), 4), np.float32), np.ones(len(vertices), np.float32))
    light = np.ones((len(vertices), 4), dtype=np.float32)
    mesh = FaceMesh(shape, vertices * 0.1, vertices, light, np.eye(4), np.zeros(3), np.zeros(3))
    camera, size = Camera(distance=2.0), (200, 200)
    matrix = camera.projection_matrix(1.0) @ camera.view_matrix()
    outliner = Outliner()
    outliner.begin(size)
    outliner.add(mesh, matrix)
    middles = (outliner.tiles() + 1) * 100
    # A sphere of radius r at a distance d is seen under the angle asin(r / d).
    radius = 100 * np.tan(np.arcsin(0.1 / 2.0)) / np.tan(np.radians(12))
    low, high = middles - TILE / 2, middles + TILE / 2
    np.testing.assert_allclose(low / TILE, np.round(low / TILE), atol=1e-5)
    for angle in np.linspace(0, 2 * np.pi, 60):  # all of the circle lies in tiles
        x, y = 100 + radius * np.cos(angle), 100 + radius * np.sin(angle)
        assert ((low <= (x, y)) & ((x, y) <= high)).all(axis=1).any()
    away = np.abs(middles - 100)  # and no tile lies aside from it
    assert (np.linalg.norm(away + TILE / 2, axis=1) > radius - 3).all()
    assert (np.linalg.norm(np.maximum(away - TILE / 2, 0), axis=1) < radius + 3).all()
    assert len(middles) * TILE < 2 * np.pi * radius * 2
    outliner.begin(size)
    assert len(outliner.tiles()) == 0
    for wrong in (np.nan, np.inf, -np.inf, 1e38):  # edges that end nowhere are left out
        positions = mesh.positions.copy()
        positions[::7, 0], positions[1::7, 1], positions[2::7, 2] = wrong, -wrong, wrong
        outliner.add(mesh._replace(positions=positions), matrix)
    with pytest.raises(ValueError, match="1 positions for a shape of"):
        outliner.add(mesh._replace(positions=mesh.positions[:1]), matrix)


def test_the_neck_bends_between_shoulders_and_head() -> None:
    random = np.random.default_rng(3)
    places, centre = random.normal(size=(20, 3)), np.array([0.1, -0.4, 0.2])
    turn, sway = np.array([0.5, -0.8, 0.3]), np.linspace(0, 1, 20)
    wanted = [
        centre + Rotation.from_rotvec(turn * share).apply(place - centre)
        for place, share in zip(places, sway, strict=True)
    ]
    np.testing.assert_allclose(turn_partly(places, sway.astype(np.float32), turn, centre), wanted, atol=1e-6)
    np.testing.assert_array_equal(turn_partly(places, sway.astype(np.float32), np.zeros(3), centre), places)


def test_a_camera_is_read_back_from_its_text() -> None:
    camera = Camera(target=(0.25, 1.6, -0.5), yaw=-35.0, pitch=5.0, distance=1.25, field_of_view=30.0)
    assert Camera.parse(camera.text) == camera
    assert Camera.parse("tilt=10") == Camera(pitch=10.0)


def test_directions_alone_fit_the_subject_as_named_views_do() -> None:
    subject = Subject((0.1, 1.0, 0.0), half_height=0.9, half_width=0.4)
    assert Camera.preset("turn=25,tilt=8", subject) == Camera.preset("body", subject)
    wide = Camera.preset("turn=25,tilt=8,angle=50", subject)
    assert wide.target == subject.centre
    assert wide.distance < Camera.preset("body", subject).distance
    with pytest.raises(ValueError, match="gives a place"):
        Camera.preset("turn=25,distance=2", subject)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("sidewards", "no view 'sidewards': there are front"),
        ("turn=1,zoom=2", "'zoom=2' of 'turn"),
        ("at=1:2", "'at=1:2'"),
        ("at=1:2:nan", "'at=1:2:nan'"),
        ("turn=much", "'turn=much'"),
        ("tilt=95", "tilt=95 of the camera lies outside of -89 to 89"),
        ("distance=0", "distance=0"),
        ("angle=180", "angle=180"),
        ("", "no view ''"),
    ],
)
def test_other_texts_say_what_is_meant(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        Camera.parse(text)
