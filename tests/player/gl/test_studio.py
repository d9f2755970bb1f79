"""The backdrop, which is kept while a camera stays."""

from typing import Any

import numpy as np
import numpy.typing as npt

from fba_player.gl._renderer import Renderer
from fba_player.view._camera import Camera
from fba_player.view._view import View

SIZE = (32, 24)


def test_every_picture_has_its_backdrop_whatever_cameras_came_before(context: Any) -> None:
    renderer, target = Renderer(context), context.simple_framebuffer(SIZE)
    view = View(ground=True)

    def picture(yaw: float) -> npt.NDArray[np.uint8]:
        target.use()
        target.clear(1, 0, 1, 1, depth=1.0)
        renderer.draw(view, Camera((0.0, 0.5, 0.0), yaw=yaw, distance=2.0), SIZE)
        return np.frombuffer(target.read(components=3), dtype=np.uint8)

    first, other = picture(10.0), picture(60.0)
    assert (first != other).any()
    for yaw, expected in ((10.0, first), (10.0, first), (60.0, other), (10.0, first), (60.0, other)):
        np.testing.assert_array_equal(picture(yaw), expected)
    renderer.close()
    target.release()
