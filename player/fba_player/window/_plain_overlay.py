"""What a window without imgui draws with Pillow: a plain timeline and a help page.

imgui-bundle has no wheels for Macs with Intel processors, nor for Python 3.15, where moderngl can be
installed: the window then opens without panels (see the markers in pyproject.toml).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fba_player.gl._resources import load_program
from fba_player.session._controls import BAR_HEIGHT, Controls
from fba_player.session._keys import keys
from fba_player.view._font import label_font

if TYPE_CHECKING:
    from PIL.Image import Image

TEXT = (236, 239, 243, 255)
FAINT = (176, 183, 192, 255)
ACCENT = (94, 176, 229, 255)
SHADE = (18, 21, 26, 168)
TRACK = (255, 255, 255, 54)


class Overlay:
    """Draws the timeline, the status text and the help over the bound framebuffer."""

    def __init__(self, context: Any) -> None:
        self._gl = context
        self._program = load_program(context, "overlay")
        self._square = context.buffer(reserve=4 * 4 * 4, dynamic=True)
        self._array = context.vertex_array(self._program, [(self._square, "2f 2f", "in_place", "in_texture")])
        self._textures: dict[str, Any] = {}
        self._help: tuple[float, Image] | None = None

    def draw(self, controls: Controls) -> None:
        """Draw the timeline and status, and the help if it is open."""
        session = controls.session
        gl, (width, height) = self._gl, session.size
        gl.enable_only(gl.BLEND)
        gl.blend_func = gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA
        bar = bar_picture(controls)
        self._show("bar", bar, 0, height - bar.height, session.size)
        if "help" in session.open:
            if self._help is None or self._help[0] != session.scale:
                self._help = (session.scale, help_picture(session.scale))
            panel = self._help[1]
            left, top = max((width - panel.width) // 2, 0), max((height - panel.height) // 2, 0)
            self._show("help", panel, left, top, session.size)

    def close(self) -> None:
        for part in (*self._textures.values(), self._array, self._square, self._program):
            part.release()
        self._textures.clear()

    def _show(self, name: str, picture: Image, x: int, y: int, size: tuple[int, int]) -> None:
        """Draw a picture with its upper left corner at x, y in a framebuffer of this size."""
        texture = self._textures.get(name)
        if texture is None or texture.size != picture.size:
            if texture is not None:
                texture.release()
            texture = self._textures[name] = self._gl.texture(picture.size, 4)
            texture.filter = (self._gl.NEAREST, self._gl.NEAREST)
        texture.write(picture.tobytes())
        wide, high = texture.size
        corners = [(x, y, 0, 0), (x + wide, y, 1, 0), (x, y + high, 0, 1), (x + wide, y + high, 1, 1)]
        self._square.write(np.array(corners, dtype="f4").tobytes())
        self._program["size"].value = (float(size[0]), float(size[1]))
        texture.use(0)
        self._array.render(self._gl.TRIANGLE_STRIP)


def bar_picture(controls: Controls) -> Image:
    """Return a picture of the bar at the bottom: the timeline, and below it the status text."""
    from PIL import Image, ImageDraw

    session = controls.session
    scale, transport = session.scale, session.transport
    width, height = max(session.size[0], 1), max(round(BAR_HEIGHT * scale), 1)
    picture = Image.new("RGBA", (width, height), SHADE)
    draw = ImageDraw.Draw(picture)
    low, high = controls.bar()
    middle, half = 15 * scale, 3 * scale
    at = low + (high - low) * transport.share
    draw.rounded_rectangle((low, middle - half, high, middle + half), radius=half, fill=TRACK)
    if at > low + 1:
        draw.rounded_rectangle((low, middle - half, at, middle + half), radius=half, fill=ACCENT)
    knob = 6.5 * scale
    draw.ellipse((at - knob, middle - knob, at + knob, middle + knob), fill=TEXT)
    font = label_font(13 * scale)
    line = 28 * scale
    state = "playing" if transport.playing else "paused"
    draw.text((low, line), f"{state}   {transport.text()}", font=font, fill=TEXT)
    texts = [notice.text for notice in session.notices()[-1:]] or [session.scene.title[:60]]
    hint = "   ".join([*filter(None, texts), "F1 help"])
    wide = draw.textlength(hint, font=font)
    if wide < (high - low) * 0.45:
        draw.text((high - wide, line), hint, font=font, fill=FAINT)
    return picture


def help_picture(scale: float) -> Image:
    """Return a picture of the help: two columns of keys."""
    from PIL import Image, ImageDraw

    rows = [row for row in keys() if not row.action.startswith("panel") or row.action == "panel help"]
    half = (len(rows) + 1) // 2
    font, line, column = label_font(12 * scale), 19 * scale, 434 * scale
    width, height = round(2 * column), round((half + 1) * line + 26 * scale)
    picture = Image.new("RGBA", (width, height), (0, 0, 0, 0))
    draw = ImageDraw.Draw(picture)
    draw.rounded_rectangle((0, 0, width - 1, height - 1), radius=10 * scale, fill=(18, 21, 26, 222))
    top = 16 * scale
    draw.text((20 * scale, top), "Keys", font=font, fill=ACCENT)
    for number, row in enumerate(rows):
        side, down = divmod(number, half)
        x, y = side * column + 20 * scale, top + (down + 1) * line
        draw.text((x, y), row.shown, font=font, fill=TEXT)
        draw.text((x + 136 * scale, y), row.does, font=font, fill=FAINT)
    return picture
