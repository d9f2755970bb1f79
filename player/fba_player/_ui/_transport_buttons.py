"""The row below the timeline: time code, buttons to play and step, marks, speed, captures, sound."""

from __future__ import annotations

import math
from collections.abc import Callable

from imgui_bundle import imgui

from fba_player._ui import theme
from fba_player._ui.panels.panel import icon_button, tooltip
from fba_player.playback._transport import SPEEDS
from fba_player.session._actions import act
from fba_player.session._keys import key_of
from fba_player.session._session import Session

SIDE_MARGIN = 18.0
"""Points at the left and the right of the row."""
BUTTON_SIZE = 30.0
BUTTON_GAP = 4.0
"""Width and height of a button, and the space between two, in points."""

LEAST_SLIDER, SLIDER_GAP, SPEED_WIDTH = 60.0, 26.0, 38.0
"""Least width of the slider of the speed, the space around it and for the speed beside it, in points."""


class Buttons:
    """Draws the row; buttons without room are left out."""

    def __init__(self) -> None:
        self.slider = (0.0, 0.0)
        self.speed = self.taken = (0.0, 0.0)
        """Left and right end of the slider, of the speed beside it, of the buttons before; for tests."""

    def draw(self, session: Session, wide: float, y: float) -> None:
        """Draw the row. wide: of the display, y: of the upper edge, in points."""
        transport = session.transport
        room = wide >= 640
        if room:
            self._clock(session, y, full=wide >= 860)
        size, gap, big = BUTTON_SIZE, BUTTON_GAP, 38.0
        buttons = [
            ("first", first, "first frame"),
            ("back", back, "one frame back"),
            ("toggle", pause if transport.playing else play, "play, pause"),
            ("on", on, "one frame forward"),
            ("last", last, "last frame"),
        ]
        x = wide / 2 - (4 * size + big + 4 * gap) / 2
        for action, icon, text in buttons:
            across = big if action == "toggle" else size
            imgui.set_cursor_screen_pos((x, y - (across - size) / 2))
            if icon_button(action, icon, across, filled=action == "toggle"):
                act(session, action)
            tooltip(text, key_of(action))
            x += across + gap
        if wide >= 460:
            x += 10
            marks = (
                ("mark_in", mark_in, "start of the loop here", transport.mark_in is not None),
                ("mark_out", mark_out, "end of the loop here", transport.mark_out is not None),
                ("loop", loop, "loop", transport.loop),
            )
            for action, icon, text, lit in marks:
                imgui.set_cursor_screen_pos((x, y))
                colour = theme.WARM if lit and action != "loop" else None
                if icon_button(action, icon, size, lit=lit, colour=colour):
                    act(session, action)
                tooltip(text, key_of(action))
                x += size + gap
        self.taken = (SIDE_MARGIN, x)
        self.slider = self.speed = (0.0, 0.0)
        if room:
            self._right(session, wide, y, x)

    def _clock(self, session: Session, y: float, *, full: bool) -> None:
        transport = session.transport
        imgui.set_cursor_screen_pos((SIDE_MARGIN, y + 3))
        imgui.push_font(None, theme.LARGE)
        imgui.text_unformatted(transport.timecode())
        imgui.pop_font()
        if full:
            imgui.same_line(0, 16)
            imgui.set_cursor_pos_y(imgui.get_cursor_pos_y() + 4)
            text = transport.frame_text()
            imgui.text_colored(theme.FAINT, text + ("   waiting" if transport.waiting else ""))

    def _right(self, session: Session, wide: float, y: float, taken: float) -> None:
        transport = session.transport
        size, gap = BUTTON_SIZE, BUTTON_GAP
        buttons = [
            ("fullscreen", full_screen, "full screen", False),
            ("record", record, "record to an MP4 file", session.recording is not None),
            ("screenshot", camera, "picture of the view", False),
            ("interpolate", smooth, "smooth between frames", False)
            if transport.interpolate
            else ("interpolate", stepped, "frame by frame", False),
        ]
        if session.audio is not None:
            quiet = session.audio.muted
            text = f"sound at {session.audio.volume:.0%}; turn the wheel here for more or less"
            if session.sound_offset:
                when = "later" if session.sound_offset > 0 else "earlier"
                text += f"\nbegins {abs(session.sound_offset):.2f} s {when}"
            buttons.append(("mute", muted if quiet else sound, text, False))
        x = wide - SIDE_MARGIN + gap
        if x - (len(buttons) + 1) * (size + gap) - taken - SLIDER_GAP - SPEED_WIDTH >= LEAST_SLIDER:
            buttons.insert(4, ("lanes", lanes, "lanes: what is said, felt and heard; all; none", False))
        for action, icon, text, lit in buttons:
            x -= size + gap
            if x < taken + 8:
                return
            imgui.set_cursor_screen_pos((x, y))
            if icon_button(action, icon, size, colour=theme.ALERT if lit else None):
                act(session, action)
            if action == "mute" and session.audio is not None and imgui.is_item_hovered():
                louder = session.audio.volume + 0.05 * imgui.get_io().mouse_wheel
                session.audio.volume = min(max(louder, 0.0), 1.0)
            tooltip(text, key_of(action))
        text = f"{transport.speed:g}x"
        wide_text = imgui.calc_text_size(text).x
        room = x - taken - SLIDER_GAP
        if room < LEAST_SLIDER:
            return
        slider = min(118.0, room - SPEED_WIDTH if room >= LEAST_SLIDER + SPEED_WIDTH else room)
        if x - slider - 20 - wide_text > taken + 6:  # else the tooltip says it
            self.speed = (x - slider - 20 - wide_text, x - slider - 20)
            imgui.set_cursor_screen_pos((self.speed[0], y + 7))
            imgui.text_colored(theme.FAINT if transport.speed == 1.0 else theme.ACCENT, text)
        self.slider = (x - slider - 12, x - 12)
        imgui.set_cursor_screen_pos((self.slider[0], y + 2))
        imgui.set_next_item_width(slider)
        flags = imgui.SliderFlags_.logarithmic | imgui.SliderFlags_.always_clamp
        changed, speed = imgui.slider_float("##speed", transport.speed, SPEEDS[0], SPEEDS[-1], "", flags)
        if changed:
            transport.set_speed(snap_speed(speed))
        if imgui.is_item_hovered() and imgui.is_mouse_double_clicked(0):
            transport.set_speed(1.0)
        tooltip(f"speed {text}; double click for normal", f"{key_of('slower')} {key_of('faster')}")


def snap_speed(speed: float) -> float:
    """Return the speed for a position of the slider: one of `SPEEDS` if it is near, else with two digits."""
    speed = min(max(speed, SPEEDS[0]), SPEEDS[-1])
    near = min(SPEEDS, key=lambda step: abs(math.log(step / speed)))
    return near if abs(math.log(near / speed)) < 0.045 else round(speed, 2)


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
