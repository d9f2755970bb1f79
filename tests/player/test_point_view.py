"""The view as feature points and bones: what it draws, and that it is drawn."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from player_tracks import body_track, face_track

from fba.animation import Animation
from fba.body import BapSolver, Skeleton
from fba.face import FeaturePointFace, feature_point_names, resolve
from player import Offscreen, Scene
from player.controls import Controls
from player.head import Head
from player.head.drawing import Drawing
from player.scene import HEAD_ON_BODY
from player.transport import Transport

ROW = {name: row for row, name in enumerate(feature_point_names())}
FACES: list[dict[int, int]] = [
    {},
    {3: 900, 5: -700, 12: 300, 31: 200, 19: 500, 23: 20000},
    {48: 30000, 49: -50000, 50: 20000, 14: 200, 47: 3000},
]


def face(faps: dict[int, int]) -> Animation:
    return Animation(25, np.arange(1), face_track([faps]))  # type: ignore[arg-type]


@pytest.mark.parametrize("faps", FACES, ids=["neutral", "face", "head"])
def test_a_sphere_stands_at_every_feature_point(faps: dict[int, int]) -> None:
    animation = face(faps)
    marks = Scene(animation, view="points").at(0.0).marks
    assert animation.face is not None
    expected = FeaturePointFace()(resolve(animation.face)[0])
    assert marks.shape == (84, 16)
    np.testing.assert_allclose(marks[:, :3], expected, atol=1e-6)
    np.testing.assert_allclose(marks[:, 4:7], expected, atol=1e-4)
    assert ((marks[:, 3] > 0.0005) & (marks[:, 3] < 0.002)).all()


def test_on_a_body_the_points_go_with_the_head() -> None:
    baps = {1: 0, 181: 100, 182: 200, 183: -300}
    animation = Animation(25, np.arange(1), face_track([{3: 500}]), body_track([baps]))  # type: ignore[arg-type]
    assert animation.face is not None
    assert animation.body is not None
    skeleton = Skeleton.default()
    joints = BapSolver(skeleton).pose(animation.body.values[0])
    shift = joints[0, :3, 3] - skeleton.centres[0]  # the root alone moves
    expected = FeaturePointFace()(resolve(animation.face)[0]) + HEAD_ON_BODY + shift
    np.testing.assert_allclose(Scene(animation, view="points").at(0.0).marks[:, :3], expected, atol=1e-5)


def test_every_bone_and_joint_has_its_capsule(walking: Animation) -> None:
    skeleton = Skeleton.default()
    assert walking.body is not None
    capsules = Scene(walking, view="points").at(0.2).capsules[2:]  # behind the eyeballs
    places = BapSolver(skeleton).pose(walking.body.values[5])[:, :3, 3]
    bones, joints = capsules[: len(places) - 1], capsules[len(places) - 1 :]
    np.testing.assert_allclose(joints[:, :3], places, atol=1e-6)
    np.testing.assert_allclose(bones[:, 4:7], places[1:], atol=1e-6)
    np.testing.assert_allclose(bones[:, :3], places[skeleton.parents[1:]], atol=1e-6)
    assert len(joints) == 87


@pytest.mark.parametrize("faps", FACES[:2], ids=["neutral", "face"])
def test_lines_pass_through_their_points(faps: dict[int, int]) -> None:
    vector = np.zeros(68, dtype=np.float32)
    for number, value in faps.items():
        vector[number - 1] = value
    drawing = Drawing(Head.default())
    points = FeaturePointFace().local(vector)
    vertices = drawing.meshes(vector, np.eye(4))[2].positions
    # Upper lids slide over the eyeball, so their points stay behind where they close.
    chains = {
        2: (1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14),
        3: (9, 13),
        4: range(1, 7),
        8: range(1, 9),
        9: (1, 2, 3, 4, 5, 6, 7, 12, 13, 14, 15),
        10: (1, 3, 7),
    }
    through = [f"{group}.{index}" for group, indices in chains.items() for index in indices]
    for name in through:
        nearest = np.linalg.norm(vertices - points[ROW[name]], axis=1).min()
        assert nearest < 0.0013, name  # a tube's radius, or half the way to its next ring


def test_extreme_faps_give_finite_lines() -> None:
    for value in (10**5, -(10**5)):
        vector = np.full(68, value, dtype=np.float32)
        for mesh in Drawing(Head.default()).meshes(vector, np.eye(4), bust=np.eye(4)):
            assert np.isfinite(mesh.positions).all()
            assert np.isfinite(mesh.normals).all()


def test_the_view_is_checked_and_may_change(talking: Animation) -> None:
    with pytest.raises(ValueError, match="figure, points"):
        Scene(talking, view="wire")
    scene = Scene(talking)
    assert scene.view == "figure"
    assert len(scene.at(0.0).marks) == 0
    controls = Controls(scene, Transport(scene.timeline), (100, 100))
    assert controls.key("p")
    assert scene.view == "points"
    assert len(scene.at(0.0).marks) == 84
    assert controls.key("p")
    assert len(scene.at(0.0).marks) == 0


@pytest.mark.usefixtures("opengl")
class TestPictures:
    def test_it_differs_from_the_figure_and_is_the_same_each_time(self, walking: Animation) -> None:
        scene = Scene(walking)
        with Offscreen(scene, (200, 150)) as offscreen:
            figure = offscreen.frame(0.1)
            scene.view = "points"
            points = offscreen.frame(0.1)
            np.testing.assert_array_equal(offscreen.frame(0.1), points)
            scene.view = "figure"
            np.testing.assert_array_equal(offscreen.frame(0.1), figure)
        with Offscreen(Scene(walking, view="points"), (200, 150)) as other:
            np.testing.assert_array_equal(other.frame(0.1), points)
        assert (np.abs(figure.astype(int) - points.astype(int)).max(axis=2) > 20).sum() > 300

    def test_orange_points_shine_where_they_are_projected(self) -> None:
        scene = Scene(face({}), view="points")
        camera = scene.camera("front", 4 / 3)
        with Offscreen(scene, (800, 600), camera) as offscreen:
            shown = offscreen.frame(0.0).astype(int)
        orange = (shown[..., 0] - shown[..., 2] > 70) & (shown[..., 1] - shown[..., 2] > 20)
        matrix = camera.projection_matrix(4 / 3) @ camera.view_matrix()
        for name in ("5.1", "5.2", "2.10", "11.1", "9.3", "4.3", "8.1", "2.1", "10.1"):
            clip = matrix @ [*FeaturePointFace().points[ROW[name]], 1.0]
            x, y = 400 * (1 + clip[0] / clip[3]), 300 * (1 - clip[1] / clip[3])
            assert orange[round(y) - 3 : round(y) + 4, round(x) - 3 : round(x) + 4].sum() >= 3, name
        assert orange.mean() < 0.02

    def test_what_is_hidden_shines_through_faintly(self) -> None:
        scene = Scene(face({}), view="points")
        with Offscreen(scene, (400, 300), scene.camera("profile", 4 / 3)) as offscreen:
            view = scene.at(0.0)
            whole = offscreen.frame(0.0).astype(int)
            behind = view.marks[:, 0] < -0.005  # the other side of the face
            assert behind.sum() > 25
            hidden = type(view)(view.meshes, view.capsules, view.marks[~behind], view.eyes)
            scene.at = lambda time: hidden  # type: ignore[method-assign]
            without = offscreen.frame(0.0).astype(int)
        faint = np.abs(whole - without)[100:220, 100:260].max(axis=2)
        assert (faint > 4).sum() > 10
        assert np.percentile(faint[faint > 4], 50) < 60

    def test_it_leaves_no_opengl_error(self, walking: Animation) -> None:
        with Offscreen(Scene(walking, view="points"), (64, 64)) as offscreen:
            offscreen.frame(0.0)
            with offscreen._gl:
                assert offscreen._gl.error == "GL_NO_ERROR"

    def test_a_real_stream(self, shared: Path) -> None:
        import fba

        animation = fba.read(shared / "vectors" / "real" / "angry_0.fba", bap_steps="visage")
        with Offscreen(Scene(animation, view="points"), (160, 120)) as offscreen:
            pictures = [offscreen.frame(time) for time in (0.0, 2.0)]
        assert (np.abs(pictures[0].astype(int) - pictures[1].astype(int)) > 8).sum() > 50


def test_the_hairline_is_part_of_the_mesh() -> None:
    surface = Head.default()._surface
    lines = [rows for name, rows in surface.parts.items() if name.startswith("hairline")]
    assert len(lines) == 3
    dark = Head.default()._skin.colours[:, :3].sum(axis=1)
    low, _, high = (dark[rows] for rows in lines)
    assert low.min() > 2.5 * high.max()  # skin just below it, hair just above, all along
