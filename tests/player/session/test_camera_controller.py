"""How the camera of a window moves."""

from typing import Any

import numpy as np
import pytest

from fba.animation import Animation
from fba_player.scene.scene import Scene
from fba_player.session._camera_controller import GLIDE_SECONDS, ORBIT_SECONDS, Viewpoint
from fba_player.view._camera import Camera
from fba_player.view.protocols import Timed
from set_clock import Clock


class Walking(Timed[Any]):
    """A scene in which somebody walks two metres a second along x."""

    def camera(self, preset: str | None = None, aspect: float = 1.0) -> Camera:
        return Camera(distance=3.0)

    def travel(self, time: float) -> tuple[float, float, float]:
        return (2.0 * time, 0.0, 0.0)


@pytest.fixture
def clock() -> Clock:
    return Clock(5.0)


def test_it_glides_to_a_preset_and_arrives(talking: Animation, clock: Clock) -> None:
    scene = Scene(talking)
    viewpoint = Viewpoint(scene, 1.5, "front", clock=clock)
    viewpoint.preset("profile")
    assert viewpoint.gliding
    assert viewpoint.camera.yaw == pytest.approx(0)
    clock.now += GLIDE_SECONDS / 2
    assert viewpoint.camera.yaw == pytest.approx(45)  # eased, it is half way at half time
    clock.now += GLIDE_SECONDS / 2
    assert not viewpoint.gliding
    assert viewpoint.camera == scene.camera("profile", 1.5)


def test_a_new_glide_begins_where_it_is(clock: Clock) -> None:
    viewpoint = Viewpoint(Walking(), 1.0, Camera(yaw=0), clock=clock)  # type: ignore[arg-type]
    viewpoint.glide(Camera(yaw=80))
    clock.now += GLIDE_SECONDS / 2
    viewpoint.glide(Camera(yaw=0))
    assert viewpoint.camera.yaw == pytest.approx(40)


def test_by_hand_it_moves_at_once(clock: Clock) -> None:
    viewpoint = Viewpoint(Walking(), 1.0, Camera(), clock=clock)  # type: ignore[arg-type]
    viewpoint.glide(Camera(yaw=80))
    viewpoint.camera = Camera(yaw=-20)
    assert viewpoint.camera.yaw == -20
    assert not viewpoint.gliding
    viewpoint.reset()
    clock.now += GLIDE_SECONDS
    assert viewpoint.camera == Camera()


def test_between_cameras_it_takes_the_shorter_way() -> None:
    half = Camera(yaw=170, distance=1.0).between(Camera(yaw=-170, distance=4.0), 0.5)
    assert abs(half.yaw) == pytest.approx(180)
    assert half.distance == pytest.approx(2.0)  # as much nearer in the first half as in the second


def test_it_follows_and_stays_without_a_jump(clock: Clock) -> None:
    viewpoint = Viewpoint(Walking(), 1.0, Camera(), clock=clock)  # type: ignore[arg-type]
    assert viewpoint.camera_at(3.0).target == (6.0, 0.0, 0.0)
    viewpoint.follow = "none"
    assert viewpoint.camera_at(3.0).target == (6.0, 0.0, 0.0)
    assert viewpoint.camera_at(4.0).target == (6.0, 0.0, 0.0)
    viewpoint.follow = None
    assert viewpoint.camera_at(4.0).target == (6.0, 0.0, 0.0)
    assert viewpoint.camera_at(5.0).target == (8.0, 0.0, 0.0)


def test_it_turns_around_the_figure_and_stays_where_it_is(clock: Clock) -> None:
    viewpoint = Viewpoint(Walking(), 1.0, Camera(yaw=10), clock=clock)  # type: ignore[arg-type]
    viewpoint.toggle_orbit()
    assert viewpoint.gliding
    assert viewpoint.camera_at(0.0).yaw == pytest.approx(10)
    clock.now += ORBIT_SECONDS / 4
    assert viewpoint.camera_at(0.0).yaw == pytest.approx(100)
    assert "turn=100," in viewpoint.options()["camera"]
    assert viewpoint.options()["orbit"] == f"{ORBIT_SECONDS:g}"
    viewpoint.toggle_orbit()
    clock.now += 3.0
    assert not viewpoint.gliding
    assert viewpoint.camera_at(0.0).yaw == pytest.approx(100)


def test_a_view_of_the_face_follows_the_head(walking: Animation, clock: Clock) -> None:
    scene = Scene(walking)
    viewpoint = Viewpoint(scene, 1.5, clock=clock)
    whole = viewpoint.camera_at(0.2)
    viewpoint.preset("face")
    begun = viewpoint.camera_at(0.2)
    assert begun.target == pytest.approx(whole.target)  # it begins where it was
    clock.now += GLIDE_SECONDS
    moved = np.subtract(viewpoint.camera_at(0.2).target, scene.camera("face", 1.5).target)
    np.testing.assert_allclose(moved, scene.head_travel(0.2), atol=1e-9)
    assert viewpoint.options()["follow"] == "head"


def test_a_view_fits_again_where_the_bar_is_hidden(talking: Animation, clock: Clock) -> None:
    scene = Scene(talking)
    viewpoint = Viewpoint(scene, 1.6, "front", clock=clock)
    viewpoint.covered = 0.2
    viewpoint.refit()
    clock.now += GLIDE_SECONDS
    above = viewpoint.camera
    assert above.distance > scene.camera("front", 1.6).distance
    viewpoint.covered = 0.0
    viewpoint.refit()
    assert viewpoint.gliding
    clock.now += GLIDE_SECONDS
    assert viewpoint.camera == scene.camera("front", 1.6)


@pytest.mark.parametrize("above", [0.0, 0.1])
@pytest.mark.parametrize("preset", ["front", "three-quarter", "profile", "body", "side", "back", None])
def test_views_fit_between_what_is_covered(
    talking: Animation, clock: Clock, preset: str | None, above: float
) -> None:
    scene = Scene(talking)
    viewpoint = Viewpoint(scene, 1.6, clock=clock)
    viewpoint.covered, viewpoint.covered_above = 0.25, above
    camera, subject = viewpoint.fit(preset), scene.subject
    matrix = camera.projection_matrix(1.6) @ camera.view_matrix()
    ends = []
    for side in (-1, 1):
        x, y, z = subject.centre
        clip = matrix @ np.array([x, y + side * subject.half_height, z, 1])
        ends.append(clip[1] / clip[3])
    assert ends[0] > -0.52  # the lowest quarter of -1..1 ends at -0.5
    assert ends[1] < 1.02 - 2 * above
    assert ends[1] - ends[0] > 1.4 - 2 * above


def test_between_columns_the_face_stands_in_what_is_free(talking: Animation, clock: Clock) -> None:
    scene = Scene(talking)
    aspect = 16 / 9
    viewpoint = Viewpoint(scene, aspect, "front", clock=clock)
    x, y, z = scene.face_subject.centre

    def across(camera: Camera, reach: float = 0.0) -> float:
        """Share of the picture's width at which the face's middle is, or what is so far beside it (m)."""
        clip = camera.projection_matrix(aspect) @ camera.view_matrix() @ np.array([x + reach, y, z, 1.0])
        return float(clip[0] / clip[3] + 1) / 2

    whole = viewpoint.camera_at(0.0)
    assert across(whole) == pytest.approx(0.5, abs=0.001)
    viewpoint.uncover(0.4, 0.1)
    assert viewpoint.gliding
    assert across(viewpoint.camera_at(0.0)) == pytest.approx(0.5, abs=0.001)  # it begins where it was
    clock.now += GLIDE_SECONDS
    assert not viewpoint.gliding
    assert across(viewpoint.camera_at(0.0)) == pytest.approx(0.65, abs=0.001)
    assert viewpoint.camera_without_panels(0.0) == whole  # as a picture without panels shows it
    viewpoint.uncover(0.4, 0.4, smoothly=False)
    half = scene.face_subject.half_width
    assert across(viewpoint.camera_at(0.0), -half) > 0.399
    assert across(viewpoint.camera_at(0.0), half) < 0.601
    viewpoint.uncover(0.0, 0.0, smoothly=False)
    assert viewpoint.camera_at(0.0) == whole


def test_a_given_camera_keeps_its_distance_between_columns(clock: Clock) -> None:
    viewpoint = Viewpoint(Walking(), 2.0, Camera(distance=5.0), clock=clock)  # type: ignore[arg-type]
    viewpoint.uncover(0.3, 0.0, smoothly=False)
    assert viewpoint.camera_at(0.0).distance == 5.0


def test_a_named_view_fits_the_picture_again_when_its_shape_changes(talking: Animation, clock: Clock) -> None:
    scene = Scene(talking)
    viewpoint = Viewpoint(scene, 16 / 9, clock=clock)
    viewpoint.preset("front")
    clock.now += GLIDE_SECONDS
    viewpoint.aspect = 0.4
    viewpoint.refit()
    assert viewpoint.camera == scene.camera("front", 0.4)
    assert viewpoint.camera.distance > 1.5 * scene.camera("front", 16 / 9).distance
    mine = viewpoint.camera.orbit(20, 0)
    viewpoint.camera = mine
    viewpoint.aspect = 2.0
    viewpoint.refit()
    assert viewpoint.camera == mine  # what was moved by hand stays
