"""What a window shows until its first picture is drawn: the studio's grey and what is being loaded."""

from __future__ import annotations

from typing import Any

import numpy as np

from fba_player.view._font import label_font, shortened

GREY, LETTERS = (118, 122, 127), (236, 238, 240)
"""sRGB."""
HEIGHT = 22.0
"""Of the letters, in points."""


def draw_opening(context: Any, size: tuple[int, int], text: str, scale: float = 1.0) -> None:
    """Fill a window's framebuffer, without shaders, which take a while to be compiled.

    context: of moderngl. size: of the framebuffer in pixels. text: shown in the middle, cut to the width.
    scale: pixels per point.
    """
    from PIL import Image, ImageDraw

    picture = Image.new("RGBA", size, (*GREY, 255))
    pen, font = ImageDraw.Draw(picture), label_font(HEIGHT * scale)
    line = shortened(pen, text, font, size[0] * 0.9)
    pen.text((size[0] / 2, size[1] / 2), line, font=font, fill=LETTERS, anchor="mm")
    texture = context.texture(size, 4, np.ascontiguousarray(np.asarray(picture)[::-1]).tobytes())
    filled = context.framebuffer([texture])
    context.copy_framebuffer(context.screen, filled)
    filled.release()
    texture.release()
