"""Keys and mouse, without a window."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fba.animation import Animation
from player.camera import Camera, Subject
from player.controls import HELP, Controls
from player.scene import Scene
from player.transport import Transport


@pytest.fixture
def controls(talking: Animation) -> Controls:
    scene = Scene(talking)
    return Controls(scene, Transport(scene.timeline), (1000, 600))


def test_keys_drive_the_transport(controls: Controls) -> None:
    controls.key("right")
    assert controls.transport.frame == 1
    controls.key("end")
    assert controls.transport.frame == 9
    controls.key("left")
    assert controls.transport.frame == 8
    controls.key("home")
    assert controls.transport.frame == 0
    controls.key("space")
    assert controls.transport.playing
    controls.key("+")
    assert controls.transport.speed == 1.25
    controls.key("0")
    assert controls.transport.speed == 1.0
    loop = controls.transport.loop
    controls.key("l")
    assert controls.transport.loop is not loop


def test_help_and_closing(controls: Controls) -> None:
    controls.key("f1")
    assert controls.help
    controls.key("f1")
    assert not controls.help
    assert not controls.key("x")
    assert not controls.closing
    controls.key("q")
    assert controls.closing


def test_every_key_of_the_help_means_something(controls: Controls) -> None:
    for keys, _ in HELP:
        for name in keys.lower().replace(",", " ").split():
            if keys not in ("timeline", "drag", "right drag", "wheel"):
                assert controls.key({"esc": "escape"}.get(name, name)), name


def test_the_timeline_seeks_by_click_and_drag(controls: Controls) -> None:
    low, high = controls.bar()
    controls.press("left", (low + high) / 2, 590)
    assert controls.transport.share == pytest.approx(0.5)
    camera = controls.camera
    controls.move(high + 200, 100)  # dragged off the bar it still seeks
    assert controls.transport.share == 1.0
    controls.release()
    controls.move(low, 595)
    assert controls.transport.share == 1.0
    assert controls.camera == camera


def test_the_mouse_moves_the_camera(controls: Controls) -> None:
    before = controls.camera
    controls.press("left", 500, 300)
    controls.move(600, 330)
    controls.release()
    assert controls.camera.yaw == pytest.approx(before.yaw - 35)
    assert controls.camera.pitch == pytest.approx(before.pitch + 10.5)
    controls.press("right", 500, 300)
    controls.move(500, 400)
    controls.release()
    assert controls.camera.target[1] > before.target[1]
    controls.scroll(1)
    assert controls.camera.distance == pytest.approx(before.distance * 0.9)
    controls.key("r")
    assert controls.camera == before
    controls.key("3")
    assert controls.camera.yaw == 90


def test_camera_looks_where_it_should() -> None:
    front = Camera(target=(0, 1, 0), distance=2)
    np.testing.assert_allclose(front.eye, [0, 1, 2])
    np.testing.assert_allclose(Camera(yaw=90, distance=2).eye, [2, 0, 0], atol=1e-12)  # the subject's left
    np.testing.assert_allclose(Camera(pitch=30, distance=2).eye, [0, 1, math.sqrt(3)], atol=1e-12)
    clip = front.projection_matrix(1.5) @ front.view_matrix() @ [0, 1, 0, 1]
    np.testing.assert_allclose(clip[:2] / clip[3], [0, 0], atol=1e-12)
    left = front.projection_matrix(1.5) @ front.view_matrix() @ [0.1, 1.1, 0, 1]
    assert left[0] / left[3] > 0  # the subject's left is on the right of a picture from the front
    assert left[1] / left[3] > 0


@pytest.mark.parametrize("aspect", [0.5, 1.0, 16 / 9])
@pytest.mark.parametrize("preset", ["front", "three-quarter", "profile", "body"])
def test_presets_have_the_subject_in_view(preset: str, aspect: float) -> None:
    subject = Subject((0.5, 1.0, -0.3), 0.8, 0.6)
    camera = Camera.preset(preset, subject, aspect)
    matrix = camera.projection_matrix(aspect) @ camera.view_matrix()
    for offset in ((0, 0.8, 0), (0, -0.8, 0)):
        clip = matrix @ [*(np.array(subject.centre) + offset), 1]
        assert abs(clip[1] / clip[3]) <= 1.05
        assert abs(clip[1] / clip[3]) > 0.3 or aspect < 1


def test_camera_limits() -> None:
    camera = Camera().orbit(720 + 200, 500)
    assert (camera.yaw, camera.pitch) == (-160, 89)
    for _ in range(200):
        camera = camera.zoom(0.5)
    assert camera.distance == 0.05
    with pytest.raises(ValueError, match="three-quarter"):
        Camera.preset("behind", Subject((0, 0, 0), 1, 1))
