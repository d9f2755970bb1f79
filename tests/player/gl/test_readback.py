"""Pictures read back while the card goes on drawing."""

from __future__ import annotations

from typing import Any

import numpy as np

from fba_player.gl._framebuffer import Readback
from fba_player.session._captures import read_pixels


def test_the_picture_read_is_that_of_the_moment_when_reading_began(context: Any) -> None:
    readback = Readback(context)
    for size in ((6, 4), (6, 4), (3, 5)):
        screen = context.framebuffer([context.renderbuffer(size, 4)])
        screen.clear(0.2, 0.4, 0.6, 1.0)
        screen.clear(1.0, 0.0, 0.0, 1.0, viewport=(0, 0, 2, 1))  # at the bottom
        expected = read_pixels(screen, size).copy()
        fetch = readback.start(screen, size)
        screen.clear(0.0, 0.0, 0.0, 0.0)  # the next picture
        pixels = fetch()
        np.testing.assert_array_equal(pixels, expected)
        assert pixels.shape == (size[1], size[0], 4)
        assert pixels[-1, 0, 0] == 255
    readback.close()
    readback.close()
