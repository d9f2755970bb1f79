"""The row below the timeline: time code, buttons to play and step, marks, speed, captures, sound."""

from __future__ import annotations

import math

from imgui_bundle import imgui

from fba_player._ui import _icons as icons
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
            ("first", icons.first, "first frame"),
            ("back", icons.back, "one frame back"),
            ("toggle", icons.pause if transport.playing else icons.play, "play, pause"),
            ("on", icons.on, "one frame forward"),
            ("last", icons.last, "last frame"),
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
                ("mark_in", icons.mark_in, "start of the loop here", transport.mark_in is not None),
                ("mark_out", icons.mark_out, "end of the loop here", transport.mark_out is not None),
                ("loop", icons.loop, "loop", transport.loop),
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
            ("fullscreen", icons.full_screen, "full screen", False),
            ("record", icons.record, "record to an MP4 file", session.recording is not None),
            ("screenshot", icons.camera, "picture of the view", False),
            ("interpolate", icons.smooth, "smooth between frames", False)
            if transport.interpolate
            else ("interpolate", icons.stepped, "frame by frame", False),
        ]
        if session.audio is not None:
            quiet = session.audio.muted
            text = f"sound at {session.audio.volume:.0%}; turn the wheel here for more or less"
            if session.sound_offset:
                when = "later" if session.sound_offset > 0 else "earlier"
                text += f"\nbegins {abs(session.sound_offset):.2f} s {when}"
            buttons.append(("mute", icons.muted if quiet else icons.sound, text, False))
        x = wide - SIDE_MARGIN + gap
        if x - (len(buttons) + 1) * (size + gap) - taken - SLIDER_GAP - SPEED_WIDTH >= LEAST_SLIDER:
            buttons.insert(4, ("lanes", icons.lanes, "lanes: what is said, felt and heard; all; none", False))
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
