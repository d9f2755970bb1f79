"""The overlay of the picture: file name and panel buttons at the top, notices above the bar."""

from __future__ import annotations

from imgui_bundle import imgui

from fba_player._ui import theme
from fba_player._ui._docks import EDGE
from fba_player._ui.panels.panel import STANDING, Panel, tooltip
from fba_player.playback._timeline import clock_text
from fba_player.playback.live import LiveAnimation
from fba_player.scene.compare import CompareScene
from fba_player.scene.scene import Scene
from fba_player.session._keys import key_of
from fba_player.session._session import Session

NOTICE_DISTANCE = 54.0
"""Points from the bar to notices, which leaves room for two lines of text at the mouse of the timeline."""
FADE_SECONDS = 0.4
"""Seconds in which a notice fades."""
MAX_BUTTONS_SHARE = 0.55
"""Share of the window's width; wider buttons become one with a menu, so that they do not cover the figure."""
SLOW = 0.9
"""Speed below which a recording says that the window is slower than its film."""
MAX_NAME_SHARE = 0.25
"""Share of the window's width that the name and the facts may take together: a figure is in the middle."""
WELCOME_HEIGHT = 50.0
"""Points that the strip of hints takes above the bar."""
HINTS = (
    ("panel file", "contents of the file"), ("panel curves", "curves"), ("panel puppet", "move it by hand"),
    ("panel files", "open, export"), ("lanes", "lanes of the timeline"), ("panel help", "all keys"),
)  # fmt: skip
"""Actions, and what the strip in the first window says of their keys."""
BUTTONS_HEIGHT = 34.0
"""Height of the buttons of the panels in points."""
MAX_NOTICE_WIDTH = 420.0
"""Points; longer notices have several lines."""
MIN_NAME_WIDTH = 560.0
"""Width in points below which the name is left out."""


def draw_work(session: Session) -> float:
    """Draw how far a recording and an export are in the upper left corner; return their width in points."""
    taken = _draw_recording(session)
    export = session.exports.now
    if export is None:
        return taken
    x, y = EDGE + 4 + taken, EDGE + 7
    to = imgui.get_background_draw_list()
    text = f"Export {export.share:.0%}" if export.total else "Export begins"
    to.add_rect_filled((x, y + 3), (x + 60, y + 15), theme.packed(theme.GROUND), rounding=3.0)
    to.add_rect_filled((x, y + 3), (x + 60 * export.share, y + 15), theme.packed(theme.ACCENT), rounding=3.0)
    _draw_shadowed(to, (x + 70, y), theme.packed(theme.TEXT), text)
    return taken + 90.0 + float(imgui.calc_text_size(text).x)


def _draw_recording(session: Session) -> float:
    if session.recording is None:
        return 0.0
    to = imgui.get_background_draw_list()
    x, y = EDGE + 4, EDGE + 7
    text = f"REC {clock_text(session.recording)[:-2]}"
    if session.recording_speed < SLOW:
        text += f"   shown at {session.recording_speed:.0%} of the speed, all frames are in the film"
    to.add_circle_filled((x + 6, y + 9), 6.0, theme.packed(theme.ALERT))
    _draw_shadowed(to, (x + 20, y), theme.packed(theme.TEXT), text)
    return 40.0 + float(imgui.calc_text_size(text).x)


def live_message(session: Session) -> str:
    """Return what a live stream says of itself, such as that a part was lost, else ""."""
    scene = session.scene
    animation: object = scene.animation if isinstance(scene, Scene) else None
    return animation.message if isinstance(animation, LiveAnimation) else ""


def draw_name(session: Session, display: tuple[float, float], taken: float, room: float) -> None:
    """Draw the name and rate of the file in the upper left corner, unless the picture has names or a legend.

    taken: points that are used at the left. room: right limit in points.
    """
    scene = session.scene
    if isinstance(scene, CompareScene) and scene.arrangement != "over":
        return
    if display[0] < MIN_NAME_WIDTH or display[1] < 200 or scene.switches["influence"] is not None:
        return
    to = imgui.get_background_draw_list()
    x, y = EDGE + 4 + taken, EDGE + 7
    name = session.source.name or scene.title
    message = live_message(session)
    facts = message or _facts(session)
    right = room if message else min(room, MAX_NAME_SHARE * display[0])
    if imgui.calc_text_size(name + facts).x + x > right:
        facts = ""
    while name and imgui.calc_text_size(name).x + x > room:
        name = name[: max(len(name) - 8, 0)]
    _draw_shadowed(to, (x, y), theme.packed(theme.TEXT), name)
    _draw_shadowed(to, (x + imgui.calc_text_size(name).x + 14, y), theme.packed(theme.TEXT, 0.72), facts)


def draw_buttons(session: Session, panels: list[Panel], display: tuple[float, float]) -> float:
    """Draw a button for each panel, or one for all, in the upper right corner; return their left edge."""
    if not buttons_bottom(display):
        return display[0]
    labels = [panel.label for panel in panels]
    wide = _width(labels)
    together = wide > MAX_BUTTONS_SHARE * display[0]
    if together:
        wide = _width(["Panels"])
    left = display[0] - EDGE - wide
    imgui.set_next_window_pos((left, EDGE))
    imgui.set_next_window_size((wide, BUTTONS_HEIGHT))
    imgui.push_style_var(imgui.StyleVar_.window_padding, (5, 4))
    imgui.push_style_var(imgui.StyleVar_.item_spacing, (4, 4))
    imgui.push_style_var(imgui.StyleVar_.frame_padding, (11, (26 - imgui.get_font_size()) / 2))
    imgui.begin("##buttons", None, STANDING)
    if together:
        if _flat_button("Panels", lit=bool(session.open)):
            imgui.open_popup("panels")
    else:
        for panel in panels:
            if _flat_button(panel.label, lit=panel.name in session.open):
                session.toggle_panel(panel.name)
            tooltip(panel.title, panel.key)
            imgui.same_line()
    imgui.pop_style_var(3)
    if imgui.begin_popup("panels"):
        for panel in panels:
            if imgui.menu_item(panel.title, panel.key, panel.name in session.open)[0]:
                session.toggle_panel(panel.name)
        imgui.end_popup()
    imgui.end()
    return left


def buttons_bottom(display: tuple[float, float]) -> float:
    """Return the points that the buttons of the panels take at the top; 0 in a display without room."""
    return 0.0 if display[0] < 130 or display[1] < 200 else EDGE + BUTTONS_HEIGHT


def _width(labels: list[str]) -> float:
    return sum(imgui.calc_text_size(label).x + 22 for label in labels) + 4 * (len(labels) - 1) + 10


def _flat_button(label: str, *, lit: bool) -> bool:
    imgui.push_style_color(imgui.Col_.button, (0.36, 0.68, 0.90, 0.22) if lit else (0, 0, 0, 0))
    imgui.push_style_color(imgui.Col_.text, theme.TEXT if lit else theme.FAINT)
    imgui.push_style_var(imgui.StyleVar_.frame_border_size, 0.0)
    pressed = imgui.button(label)
    imgui.pop_style_var()
    imgui.pop_style_color(2)
    return bool(pressed)


def draw_welcome(session: Session, display: tuple[float, float], above: float) -> None:
    """Draw where things are, above the bar, until the user has read it; opening a panel counts as that."""
    memory = session.memory
    if memory is None or not session.greets or display[0] < 640 or display[1] < 300:
        return
    hints = [(key_of(action), text) for action, text in HINTS]
    if _hints_width(hints) > display[0] - 2 * EDGE:
        hints = hints[-1:]
    width = _hints_width(hints)
    imgui.set_next_window_pos(((display[0] - width) / 2, display[1] - above - 52))
    imgui.set_next_window_size((width, 40))
    imgui.push_style_var(imgui.StyleVar_.window_padding, (16, 7))
    imgui.begin("##welcome", None, STANDING)
    for key, text in hints:
        imgui.align_text_to_frame_padding()
        imgui.text_colored(theme.ACCENT, key)
        imgui.same_line(0, 6)
        imgui.text_unformatted(text)
        imgui.same_line(0, 24)
    if imgui.button("Got it") or session.open:
        memory.welcome()
    imgui.end()
    imgui.pop_style_var()


def _hints_width(hints: list[tuple[str, str]]) -> float:
    texts = sum(imgui.calc_text_size(key).x + imgui.calc_text_size(text).x + 30 for key, text in hints)
    return texts + float(imgui.calc_text_size("Got it").x) + 2 * 16 + 2 * imgui.get_style().frame_padding.x


def draw_notices(session: Session, display: tuple[float, float], left: float, above: float) -> None:
    """Draw the notices above the bar, at the left of the figure. left: points that panels take there."""
    to = imgui.get_foreground_draw_list()
    y = display[1] - above - NOTICE_DISTANCE - (WELCOME_HEIGHT if session.greets else 0.0)
    for notice in reversed(session.notices()):
        alpha = min((notice.until - session.clock()) / FADE_SECONDS, 1.0)
        colour = {"error": theme.ALERT, "warning": theme.WARM}.get(notice.kind, theme.ACCENT)
        wide = max(min(display[0] - left - EDGE, MAX_NOTICE_WIDTH) - 34, 60)
        size = imgui.calc_text_size(notice.text, False, wide)
        x = left + EDGE + 20
        y -= size.y + 16
        corner = (x - 20, y), (x + size.x + 14, y + size.y + 16)
        to.add_rect_filled(*corner, theme.packed((0.105, 0.112, 0.124, 0.96), alpha), rounding=8.0)
        bar = (x - 13, y + 8), (x - 10, y + size.y + 8)
        to.add_rect_filled(*bar, theme.packed(colour, alpha), rounding=1.5)
        font, shade = (imgui.get_font(), imgui.get_font_size()), theme.packed(theme.TEXT, alpha)
        to.add_text(*font, (x, y + 8), shade, notice.text, wide)
        y -= 8


def _facts(session: Session) -> str:
    if isinstance(session.scene, CompareScene):
        return ""  # each file has its own label
    info = session.source.info
    parts = [f"{session.scene.timeline.frames} frames", f"{float(session.scene.timeline.rate):g} frames/s"]
    if info.size and info.plane_bits is not None:
        parts.append(f"{info.bits_per_second / 1000:.1f} kbit/s")
    return "   ".join(parts)


def _draw_shadowed(to: imgui.ImDrawList, place: tuple[float, float], colour: int, text: str) -> None:
    """Draw text with a shadow, readable over light and dark."""
    x, y = place
    to.add_text((x + 1, y + 1), theme.packed((0, 0, 0, 0.55), (colour >> 24) / 255), text)
    to.add_text((x, y), colour, text)
