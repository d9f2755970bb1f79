"""Icons of buttons, drawn as shapes: sharp at every size, without a font.

Each is a function of (draw list, centre x, centre y, half size, colour).
"""

from __future__ import annotations

import math

from imgui_bundle import imgui


def play(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    to.add_triangle_filled(
        (x - 0.62 * r, y - 0.9 * r), (x - 0.62 * r, y + 0.9 * r), (x + 0.95 * r, y), colour
    )


def pause(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    for side in (-0.45, 0.45):
        _box(to, x + (side - 0.24) * r, y - 0.85 * r, x + (side + 0.24) * r, y + 0.85 * r, colour, 0.12 * r)


def stop(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    _box(to, x - 0.75 * r, y - 0.75 * r, x + 0.75 * r, y + 0.75 * r, colour, 0.15 * r)


def first(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    _box(to, x - 0.85 * r, y - 0.75 * r, x - 0.6 * r, y + 0.75 * r, colour)
    to.add_triangle_filled(
        (x + 0.75 * r, y - 0.75 * r), (x + 0.75 * r, y + 0.75 * r), (x - 0.5 * r, y), colour
    )


def last(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    _box(to, x + 0.6 * r, y - 0.75 * r, x + 0.85 * r, y + 0.75 * r, colour)
    to.add_triangle_filled(
        (x - 0.75 * r, y - 0.75 * r), (x - 0.75 * r, y + 0.75 * r), (x + 0.5 * r, y), colour
    )


def back(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    _arrow(to, x + 0.1 * r, y, 0.75 * r, -r, colour)
    _box(to, x + 0.42 * r, y - 0.75 * r, x + 0.68 * r, y + 0.75 * r, colour)


def on(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    _arrow(to, x - 0.1 * r, y, 0.75 * r, r, colour)
    _box(to, x - 0.68 * r, y - 0.75 * r, x - 0.42 * r, y + 0.75 * r, colour)


def loop(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    for turn in (0.0, math.pi):
        to.path_clear()
        to.path_arc_to((x, y), 0.72 * r, turn - 2.75, turn - 0.55)
        to.path_stroke(colour, thickness=0.2 * r)
        end_x, end_y = x + 0.72 * r * math.cos(turn - 0.5), y + 0.72 * r * math.sin(turn - 0.5)
        corners = [
            (end_x + 0.42 * r * math.cos(turn + angle), end_y + 0.42 * r * math.sin(turn + angle))
            for angle in (1.1, -3.0, -0.9)
        ]
        to.add_triangle_filled(corners[0], corners[1], corners[2], colour)


def mark_in(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    _bracket(to, x - 0.25 * r, y, r, 1.0, colour)


def mark_out(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    _bracket(to, x + 0.25 * r, y, r, -1.0, colour)


def smooth(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    """A wave: smooth motion between frames."""
    to.path_clear()
    for number in range(25):
        at = number / 24
        to.path_line_to((x + (2 * at - 1) * 0.95 * r, y - 0.55 * r * math.sin(2 * math.pi * at)))
    to.path_stroke(colour, thickness=0.2 * r)


def stepped(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    """Stairs: motion frame by frame."""
    to.path_clear()
    for at_x, at_y in ((-0.95, 0.6), (-0.3, 0.6), (-0.3, 0.0), (0.3, 0.0), (0.3, -0.6), (0.95, -0.6)):
        to.path_line_to((x + at_x * r, y + at_y * r))
    to.path_stroke(colour, thickness=0.2 * r)


def camera(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    _box(to, x - 0.42 * r, y - 0.78 * r, x + 0.42 * r, y - 0.3 * r, colour, 0.12 * r)
    thick = 0.2 * r
    to.add_rect(
        (x - 0.9 * r, y - 0.5 * r), (x + 0.9 * r, y + 0.75 * r), colour, rounding=0.2 * r, thickness=thick
    )
    to.add_circle((x, y + 0.1 * r), 0.34 * r, colour, thickness=thick)


def record(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    to.add_circle((x, y), 0.85 * r, colour, thickness=0.18 * r)
    to.add_circle_filled((x, y), 0.48 * r, colour)


def sound(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    """A loudspeaker with waves."""
    _loudspeaker(to, x, y, r, colour)
    for radius in (0.42, 0.8):
        to.path_clear()
        to.path_arc_to((x + 0.12 * r, y), radius * r, -0.75, 0.75)
        to.path_stroke(colour, thickness=0.18 * r)


def muted(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    """A loudspeaker with a cross."""
    _loudspeaker(to, x, y, r, colour)
    for way in (-1, 1):
        low, high = (x + 0.38 * r, y - way * 0.28 * r), (x + 0.94 * r, y + way * 0.28 * r)
        to.add_line(low, high, colour, thickness=0.18 * r)


def full_screen(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    """Four corners: full screen."""
    for side, way in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
        to.path_clear()
        to.path_line_to((x + side * 0.8 * r, y + way * 0.25 * r))
        to.path_line_to((x + side * 0.8 * r, y + way * 0.75 * r))
        to.path_line_to((x + side * 0.3 * r, y + way * 0.75 * r))
        to.path_stroke(colour, thickness=0.2 * r)


def _arrow(to: imgui.ImDrawList, x: float, y: float, half: float, length: float, colour: int) -> None:
    """Draw a triangle with its vertical side at x, pointing right, or left for a negative length."""
    to.add_triangle_filled((x, y - half), (x, y + half), (x + length, y), colour)


def _loudspeaker(to: imgui.ImDrawList, x: float, y: float, r: float, colour: int) -> None:
    _box(to, x - 0.95 * r, y - 0.32 * r, x - 0.5 * r, y + 0.32 * r, colour)
    to.add_quad_filled(
        (x - 0.55 * r, y - 0.32 * r), (x + 0.05 * r, y - 0.8 * r), (x + 0.05 * r, y + 0.8 * r),
        (x - 0.55 * r, y + 0.32 * r), colour,
    )  # fmt: skip


def _bracket(to: imgui.ImDrawList, x: float, y: float, r: float, way: float, colour: int) -> None:
    to.path_clear()
    for at_x, at_y in ((0.45, -0.8), (0.0, -0.8), (0.0, 0.8), (0.45, 0.8)):
        to.path_line_to((x + way * at_x * r, y + at_y * r))
    to.path_stroke(colour, thickness=0.24 * r)


def _box(
    to: imgui.ImDrawList, x0: float, y0: float, x1: float, y1: float, colour: int, rounding: float = 0.0
) -> None:
    to.add_rect_filled((x0, y0), (x1, y1), colour, rounding=rounding)
