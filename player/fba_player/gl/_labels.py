"""Labels in a picture, drawn by Pillow: a legend and the names of points, where there is room."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64, Int64, Intp, UInt8
from fba_player.view._font import label_font
from fba_player.view._geometry import overlap
from fba_player.view._view import Legend

TEXT = (240, 242, 245, 255)
FAINT = (186, 192, 200, 255)
SHADE = (18, 21, 26, 190)
MIN_NAMES_HEIGHT = 96
"""Pixels: lower pictures have no names."""
MIN_LEGEND_HEIGHT = 240
"""Pixels: lower pictures have no legend."""
MAX_NAMES = 45
"""If more points are in view, none is named."""
NAME_GAP = 2.0
"""Pixels between a dot and its name."""
NAME_ROWS = 4
"""Largest number of rows of names one above another, where they would overlap."""


def legend_picture(legend: Legend, scale: float) -> UInt8:
    """Return uint8 (H, W, 4): a colour bar with a title and numbers. scale: 1 in a picture 720 high."""
    from PIL import Image, ImageDraw

    title, small = label_font(round(17 * scale)), label_font(round(14 * scale))
    pad, bar = 12 * scale, 14 * scale
    inner = max(220 * scale, title.getlength(legend.title), small.getlength(legend.unit))
    width, height = round(inner + 2 * pad), round(88 * scale + pad)
    picture = Image.new("RGBA", (width, height), (0, 0, 0, 0))
    draw = ImageDraw.Draw(picture)
    draw.rounded_rectangle((0, 0, width - 1, height - 1), radius=8 * scale, fill=SHADE)
    draw.text((pad, 8 * scale), legend.title, font=title, fill=TEXT)
    draw.text((pad, 30 * scale), legend.unit, font=small, fill=FAINT)
    top, columns = 54 * scale, round(inner)
    stops = np.array(legend.stops)
    for column in range(columns):
        at = column / max(columns - 1, 1) * (len(stops) - 1)
        colour = [np.interp(at, np.arange(len(stops)), stops[:, i]) for i in range(3)]
        fill = tuple(round(255 * float(v)) for v in colour)
        draw.line((pad + column, top, pad + column, top + bar), fill=(*fill, 255))
    for share, anchor in ((0.0, "la"), (0.5, "ma"), (1.0, "ra")):
        below = (pad + share * (columns - 1), top + bar + 4 * scale)
        draw.text(below, f"{legend.most * share:.3g}", font=small, fill=TEXT, anchor=anchor)
    return np.asarray(picture)


def names_picture(names: tuple[str, ...], pixels: int) -> tuple[UInt8, Int64]:
    """Return all names below each other, uint8 (H, W, 4), and their boxes, int64 (N, 4).

    A box is left, top, width and height.
    """
    from PIL import Image, ImageDraw

    font = label_font(pixels)
    row, pad = round(pixels * 1.35), max(round(pixels * 0.3), 2)
    widths = [int(np.ceil(font.getlength(name))) + 2 * pad for name in names]
    picture = Image.new("RGBA", (max(widths, default=1), max(row * len(names), 1)), (0, 0, 0, 0))
    draw = ImageDraw.Draw(picture)
    for number, (name, width) in enumerate(zip(names, widths, strict=True)):
        top = number * row
        draw.rounded_rectangle((0, top, width - 1, top + row - 1), radius=row * 0.3, fill=SHADE)
        draw.text((pad, top + row / 2), name, font=font, fill=TEXT, anchor="lm")
    boxes = [(0, number * row, width, row) for number, width in enumerate(widths)]
    return np.asarray(picture), np.array(boxes, dtype=np.int64).reshape(-1, 4)


def place_names(dots: Float64, sizes: Int64, radius: float, size: tuple[int, int]) -> tuple[Intp, Float64]:
    """Return the indices (M,) of names for which there is room, and their upper left corners (M, 2), pixels.

    dots: (N, 2), pixels from the upper left, NaN for hidden ones. sizes: (N, 2), of the names. Each name is
    beside its dot, or above its point if radius is 0, in rows where they are close; none overlaps another.
    Nothing is drawn if the picture has more than `MAX_NAMES` dots.
    """
    inside = np.isfinite(dots).all(axis=1) & ((dots >= 0) & (dots < size)).all(axis=1)
    if inside.sum() > MAX_NAMES:
        return np.zeros(0, dtype=np.intp), np.zeros((0, 2))
    reach = radius + NAME_GAP
    taken = [(x - radius, y - radius, x + radius, y + radius) for x, y in dots[inside]]
    shown, corners = [], []
    for number in np.flatnonzero(inside):
        (x, y), (wide, high) = dots[number], sizes[number]
        middle = min(max(x - wide / 2, 0.0), size[0] - wide)
        above = [(middle, y - high * row) for row in range(1, NAME_ROWS + 1)] if radius == 0 else []
        beside = [(x + reach, y - high / 2), (x - reach - wide, y - high / 2)]
        beyond = [(x - wide / 2, y - reach - high), (x - wide / 2, y + reach)]
        for left, top in (*above, *beside, *beyond):
            box = (left, top, left + wide, top + high)
            within = left >= 0 and top >= 0 and box[2] <= size[0] and box[3] <= size[1]
            if within and not any(overlap(box, other) > 0 for other in taken):
                taken.append(box)
                shown.append(number)
                corners.append((round(left), round(top)))
                break
    return np.array(shown, dtype=np.intp), np.array(corners, dtype=np.float64).reshape(-1, 2)
