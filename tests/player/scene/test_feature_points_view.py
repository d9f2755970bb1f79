"""The view as feature points and bones: what it draws, and that it is drawn."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fba.animation import Animation
from fba.body import BapSolver, BodyModel, GroundedPoser
from fba.face import feature_point_names, resolve
from fba.face.deform._deformer import Deformer
from fba.face.model import FaceModel
from fba.player import Offscreen, Scene
from fba_player._figure.face import build_figure
from fba_player.scene._feature_points_view import PointView
from fba_player.scene._skin_lines import skin_lines
from player_tracks import body_track, face_track

ROW = {name: row for row, name in enumerate(feature_point_names())}
FACES: list[dict[int, int]] = [
    {},
    {3: 900, 5: -700, 12: 300, 31: 200, 19: 500, 23: 20000},
    {48: 30000, 49: -50000, 50: 20000, 14: 200, 47: 3000},
]


def face(faps: dict[int, int]) -> Animation:
    return Animation(25, np.arange(1), face_track([faps]))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def view() -> PointView:
    return PointView(build_figure(FaceModel.default()))


@pytest.mark.parametrize("faps", FACES, ids=["neutral", "face", "head"])
def test_a_sphere_stands_at_every_feature_point(faps: dict[int, int]) -> None:
    animation = face(faps)
    marks = Scene(animation, view="points").view_at(0.0).marks
    assert animation.face is not None
    model = FaceModel.default()
    expected = Deformer(model).feature_points(resolve(animation.face, model)[0])
    assert marks.shape == (84, 16)
    np.testing.assert_allclose(marks[:, :3], expected, atol=1e-6)
    np.testing.assert_allclose(marks[:, 4:7], expected, atol=1e-4)
    assert ((marks[:, 3] > 0.0005) & (marks[:, 3] < 0.002)).all()


def test_points_that_a_face_lacks_are_left_out() -> None:
    model = FaceModel.default()
    points, bound = model.points.copy(), model.bound.copy()
    points[ROW["10.1"]], bound[ROW["10.1"]] = np.nan, -1
    scene = Scene(face({}), replace(model, points=points, bound=bound), view="points")
    assert scene.view_at(0.0).marks.shape == (83, 16)


def test_on_a_body_the_points_go_with_the_head() -> None:
    baps = {1: 0, 181: 100, 182: 200, 183: -300}
    animation = Animation(25, np.arange(1), face_track([{3: 500}]), body_track([baps]))  # type: ignore[arg-type]
    assert animation.face is not None
    body = BodyModel.default()
    joints = BapSolver(body.skeleton).pose(animation.body.values[0])
    shift = joints[0, :3, 3] - body.skeleton.centres[0]  # the root alone moves
    scene = Scene(animation, view="points")
    alone = Deformer(scene.model).feature_points(resolve(animation.face, scene.model)[0])
    # The skull stands in the default posture as it was modelled, but elsewhere.
    skull = body.skeleton.number("skullbase")
    stands = body.eyes.mean(axis=0) + body.skeleton.centres[skull] - body.bind[skull, :3, 3]
    expected = alone - scene.figure.between_eyes + stands + shift
    np.testing.assert_allclose(scene.view_at(0.0).marks[:, :3], expected, atol=1e-5)


def test_every_bone_and_joint_has_its_capsule(walking: Animation) -> None:
    skeleton = BodyModel.default().skeleton
    capsules = Scene(walking, view="points").view_at(0.2).capsules[2:]  # behind the eyeballs
    places = GroundedPoser(skeleton).pose(walking.body.values[5])[:, :3, 3]
    bones, joints = capsules[: len(places) - 1], capsules[len(places) - 1 :]
    np.testing.assert_allclose(joints[:, :3], places, atol=1e-6)
    np.testing.assert_allclose(bones[:, 4:7], places[1:], atol=1e-6)
    np.testing.assert_allclose(bones[:, :3], places[skeleton.parents[1:]], atol=1e-6)
    assert len(joints) == 87


@pytest.mark.parametrize("faps", FACES[:2], ids=["neutral", "face"])
def test_lines_pass_through_their_points(view: PointView, faps: dict[int, int]) -> None:
    vector = np.zeros(68, dtype=np.float32)
    for number, value in faps.items():
        vector[number - 1] = value
    points = Deformer(FaceModel.default()).feature_points(vector, local=True)
    vertices = view.meshes(vector, np.eye(4))[0].positions
    chains = {
        2: (1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14),
        3: (1, 2, 3, 4, 7, 8, 9, 10, 11, 12, 13, 14),
        4: range(1, 7),
        8: range(1, 11),
        9: (1, 2, 3, 4, 5, 6, 7, 12, 13, 14, 15),
        10: range(1, 11),
    }
    for name in [f"{group}.{index}" for group, indices in chains.items() for index in indices]:
        nearest = np.linalg.norm(vertices - points[ROW[name]], axis=1).min()
        assert nearest < 0.0013, name  # a tube's radius


def test_lines_lie_on_the_skin_and_on_their_own_lip() -> None:
    model = FaceModel.default()
    lines = skin_lines(model)
    assert len(lines) == 19
    still = model.vertices.copy()
    for line in lines:
        assert (line.shares >= -1e-9).all()
        np.testing.assert_allclose(line.shares.sum(axis=1), 1)
    # Where only the lower lip moves, a line along the upper one stays.
    lowered = Deformer(model).local(np.bincount([4, 51], [-300, -300], 68).astype(np.float32))
    upper, lower = lines[0], lines[1]
    assert np.abs(upper.positions(lowered) - upper.positions(still))[2:-2].max() < 0.0008
    assert np.abs(lower.positions(lowered) - lower.positions(still)).max() > 0.004


def test_extreme_faps_give_finite_lines(view: PointView) -> None:
    for value in (10**5, -(10**5)):
        vector = np.full(68, value, dtype=np.float32)
        for mesh in view.meshes(vector, np.eye(4)):
            assert np.isfinite(mesh.positions).all()
            assert np.isfinite(mesh.normals).all()


def test_the_view_is_checked_and_may_change(talking: Animation) -> None:
    with pytest.raises(ValueError, match="figure, points"):
        Scene(talking, view="wire")
    scene = Scene(talking)
    assert (scene.view, len(scene.view_at(0.0).marks)) == ("figure", 0)
    scene.view = "points"
    assert len(scene.view_at(0.0).marks) == 84
    scene.view = "figure"
    assert len(scene.view_at(0.0).marks) == 0


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
        for name in ("5.1", "5.2", "2.10", "11.1", "9.3", "4.3", "8.1", "2.1", "3.7"):
            clip = matrix @ [*FaceModel.default().points[ROW[name]], 1.0]
            x, y = 400 * (1 + clip[0] / clip[3]), 300 * (1 - clip[1] / clip[3])
            assert orange[round(y) - 3 : round(y) + 4, round(x) - 3 : round(x) + 4].sum() >= 3, name
        assert orange.mean() < 0.02

    def test_what_is_hidden_shines_through_faintly(self) -> None:
        scene = Scene(face({}), view="points")
        with Offscreen(scene, (400, 300), scene.camera("profile", 4 / 3)) as offscreen:
            view = scene.view_at(0.0)
            whole = offscreen.frame(0.0).astype(int)
            behind = view.marks[:, 0] < -0.005  # the other side of the face
            assert behind.sum() > 25
            hidden = replace(view, marks=view.marks[~behind])
            scene.view_at = lambda time, seen=None: hidden  # type: ignore[method-assign]
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
