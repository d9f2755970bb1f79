"""Icons of buttons, drawn as shapes: sharp at every size, without a font.

An icon is called with a draw list, its centre x and y, half its size, and a colour. The numbers of shapes
are in half sizes from the centre, x to the right, y down; angles are in radians.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from imgui_bundle import imgui

Icon = Callable[[imgui.ImDrawList, float, float, float, int], None]
Point = tuple[float, float]


def _icon(*shapes: Icon) -> Icon:
    def draw(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
        for shape in shapes:
            shape(to, x, y, r, colour)

    return draw


def _box(left: float, top: float, right: float, bottom: float, rounding: float = 0.0) -> Icon:
    return lambda to, x, y, r, colour: to.add_rect_filled(
        (x + left * r, y + top * r), (x + right * r, y + bottom * r), colour, rounding=rounding * r
    )


def _triangle(*corners: Point) -> Icon:
    def draw(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
        a, b, c = ((x + across * r, y + down * r) for across, down in corners)
        to.add_triangle_filled(a, b, c, colour)

    return draw


def _line(*points: Point, width: float) -> Icon:
    def draw(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
        to.path_clear()
        for across, down in points:
            to.path_line_to((x + across * r, y + down * r))
        to.path_stroke(colour, thickness=width * r)

    return draw


def _arc(across: float, radius: float, start: float, end: float, width: float) -> Icon:
    def draw(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
        to.path_clear()
        to.path_arc_to((x + across * r, y), radius * r, start, end)
        to.path_stroke(colour, thickness=width * r)

    return draw


def _ring(down: float, radius: float, width: float) -> Icon:
    return lambda to, x, y, r, colour: to.add_circle(
        (x, y + down * r), radius * r, colour, thickness=width * r
    )


def _dot(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    to.add_circle_filled((x, y), 0.48 * r, colour)


def _camera_body(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    low, high = (x - 0.9 * r, y - 0.5 * r), (x + 0.9 * r, y + 0.75 * r)
    to.add_rect(low, high, colour, rounding=0.2 * r, thickness=0.2 * r)


def _loudspeaker(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    _box(-0.95, -0.32, -0.5, 0.32)(to, x, y, r, colour)
    to.add_quad_filled(
        (x - 0.55 * r, y - 0.32 * r), (x + 0.05 * r, y - 0.8 * r), (x + 0.05 * r, y + 0.8 * r),
        (x - 0.55 * r, y + 0.32 * r), colour,
    )  # fmt: skip


def _cross(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    for side in (-1, 1):
        low, high = (x + 0.38 * r, y - side * 0.28 * r), (x + 0.94 * r, y + side * 0.28 * r)
        to.add_line(low, high, colour, thickness=0.18 * r)


def _loop_arrow(turn: float) -> Icon:
    x, y = 0.72 * math.cos(turn - 0.5), 0.72 * math.sin(turn - 0.5)
    corners = [
        (x + 0.42 * math.cos(turn + angle), y + 0.42 * math.sin(turn + angle)) for angle in (1.1, -3.0, -0.9)
    ]
    return _icon(_arc(0.0, 0.72, turn - 2.75, turn - 0.55, 0.2), _triangle(*corners))


play = _icon(_triangle((-0.62, -0.9), (-0.62, 0.9), (0.95, 0.0)))
pause = _icon(_box(-0.69, -0.85, -0.21, 0.85, 0.12), _box(0.21, -0.85, 0.69, 0.85, 0.12))
first = _icon(_box(-0.85, -0.75, -0.6, 0.75), _triangle((0.75, -0.75), (0.75, 0.75), (-0.5, 0.0)))
last = _icon(_box(0.6, -0.75, 0.85, 0.75), _triangle((-0.75, -0.75), (-0.75, 0.75), (0.5, 0.0)))
back = _icon(_triangle((0.1, -0.75), (0.1, 0.75), (-0.9, 0.0)), _box(0.42, -0.75, 0.68, 0.75))
on = _icon(_triangle((-0.1, -0.75), (-0.1, 0.75), (0.9, 0.0)), _box(-0.68, -0.75, -0.42, 0.75))
loop = _icon(_loop_arrow(0.0), _loop_arrow(math.pi))
mark_in = _icon(_line((0.2, -0.8), (-0.25, -0.8), (-0.25, 0.8), (0.2, 0.8), width=0.24))
mark_out = _icon(_line((-0.2, -0.8), (0.25, -0.8), (0.25, 0.8), (-0.2, 0.8), width=0.24))
smooth = _icon(
    _line(*((0.95 * (n / 12 - 1), -0.55 * math.sin(math.pi * n / 12)) for n in range(25)), width=0.2)
)
"""A wave: smooth motion between frames."""
stepped = _icon(
    _line((-0.95, 0.6), (-0.3, 0.6), (-0.3, 0.0), (0.3, 0.0), (0.3, -0.6), (0.95, -0.6), width=0.2)
)
"""Stairs: motion frame by frame."""
lanes = _icon(_box(-0.9, -0.7, 0.35, -0.35), _box(-0.3, -0.17, 0.9, 0.17), _box(-0.9, 0.35, 0.1, 0.7))
"""Bars one below the other: the lanes of the timeline."""
camera = _icon(_box(-0.42, -0.78, 0.42, -0.3, 0.12), _camera_body, _ring(0.1, 0.34, 0.2))
record = _icon(_ring(0.0, 0.85, 0.18), _dot)
sound = _icon(_loudspeaker, _arc(0.12, 0.42, -0.75, 0.75, 0.18), _arc(0.12, 0.8, -0.75, 0.75, 0.18))
muted = _icon(_loudspeaker, _cross)
full_screen = _icon(
    *(
        _line((0.8 * x, 0.25 * y), (0.8 * x, 0.75 * y), (0.3 * x, 0.75 * y), width=0.2)
        for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    )
)
