"""Cameras as text, as the command line takes them and the window copies them."""

from __future__ import annotations

import pytest

from fba_player.view._camera import Camera


def test_a_camera_is_read_back_from_its_text() -> None:
    camera = Camera(target=(0.25, 1.6, -0.5), yaw=-35.0, pitch=5.0, distance=1.25, field_of_view=30.0)
    assert Camera.parse(camera.text) == camera
    assert Camera.parse("tilt=10") == Camera(pitch=10.0)


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
