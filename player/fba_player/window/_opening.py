"""The page that a window shows before its first picture: the studio, a name, and what is being prepared."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from fba.arrays import UInt8
from fba.sampling import smoothstep
from fba_player.view._font import label_font, shortened

TEXT, FAINT, ACCENT, LINE = (232, 235, 238), (204, 208, 214), (92, 173, 230), (108, 113, 121)
"""sRGB, as in the panels; fainter text is lighter than there, as the backdrop is."""
NAME, SMALL = 26.0, 14.0
"""Heights of text in points."""
BAR = (220.0, 3.0)
"""Width and height of the bar that shows how far it is, in points."""
KEYS = "Space plays and pauses      F1 shows all keys      Esc closes"
LEAST_HEIGHT = 200.0
"""Points; lower windows have the name only."""


def opening_picture(size: tuple[int, int], scale: float, name: str, step: str, done: float) -> UInt8:
    """Return the page, uint8 (height, width, 4), bottom row first.

    size: in pixels. scale: pixels per point. name: of what is opened. step: what is being prepared.
    done: share of the preparation that is done.
    """
    from PIL import Image, ImageDraw

    wide, high = size
    picture = Image.fromarray(_backdrop(size))
    pen, (x, y) = ImageDraw.Draw(picture), (wide / 2, high * 0.45)

    def write(at: float, text: str, points: float, colour: tuple[int, int, int]) -> None:
        font = label_font(points * scale)
        pen.text((x, at), shortened(pen, text, font, wide * 0.9), font=font, fill=colour, anchor="mm")

    write(y, name, NAME, TEXT)
    if high >= LEAST_HEIGHT * scale:
        across, thick = min(BAR[0] * scale, wide * 0.9), BAR[1] * scale
        left, top = x - across / 2, y + 34 * scale
        pen.rectangle((left, top, left + across, top + thick), fill=LINE)
        pen.rectangle((left, top, left + across * done, top + thick), fill=ACCENT)
        write(top + 24 * scale, step, SMALL, TEXT)
        write(high - 40 * scale, KEYS, SMALL, FAINT)
    return np.asarray(picture.convert("RGBA"))[::-1]


@lru_cache(maxsize=1)
def _backdrop(size: tuple[int, int]) -> UInt8:
    """Return the backdrop of studio.frag, top row first, so that nothing jumps when the figure appears."""
    across, up = np.linspace(-1, 1, size[0]), np.linspace(1, -1, size[1])[:, None]
    share = smoothstep((up + 1.1) / 2.1)[..., None]
    light = (1 - share) * (0.155, 0.165, 0.185) + share * (0.42, 0.44, 0.475)
    light = light * (1 - 0.15 * (across**2 + up**2))[..., None]
    toned = light * (1 + light * 0.06) / (1 + light * 0.5)
    return np.asarray((1.23460 * np.sqrt(toned) - 0.21734 * toned - 0.02316) * 255, np.uint8)
