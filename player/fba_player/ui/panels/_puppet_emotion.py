"""Emotions in the puppeteer panel: the plane of activation and evaluation, and a slider for each mood."""

from __future__ import annotations

from imgui_bundle import imgui

from fba.emotion import expressions, known_points
from fba.emotion.expression import NEUTRAL_POINT
from fba.emotion.plane import HIGHEST, LOWEST
from fba_player.session.mood import PuppetMood
from fba_player.ui import theme
from fba_player.ui.panels.panel import choose_name, heading, shorten, tooltip

TALLEST = 240.0
"""Height of the plane in points, at most."""
DOT, HANDLE = 2.5, 7.0
"""Radii of a named emotion and of the point, in points."""
LABEL_HEIGHT = 13.0
SIDE = 10.0
"""Space around the plane for the dots at its edge, in points."""


class EmotionTab:
    """Draws the plane and the sliders. areas: of the plane, (left, top, right, bottom), and of sliders by
    name, (left, right, middle), in points; for tests."""

    def __init__(self) -> None:
        self.plane = (0.0, 0.0, 0.0, 0.0)
        self.sliders: dict[str, tuple[float, float, float]] = {}

    def draw(self, mood: PuppetMood) -> None:
        """Draw the content."""
        heading("Activation and evaluation")
        self._plane(mood)
        heading("Moods")
        self.sliders = {}
        for name, intensity in mood.weights.items():
            self._slider(mood, name, intensity)
        self._add(mood)
        imgui.begin_disabled(not mood.active)
        if imgui.button("Release##mood"):
            mood.release()
        imgui.end_disabled()
        tooltip("the face follows the animation again")
        text = f"{mood.blend}: activation {mood.blend.activation:.1f}, evaluation {mood.blend.evaluation:.1f}"
        imgui.push_text_wrap_pos(0.0)
        imgui.text_colored(theme.FAINT, text if mood.active else "no mood")
        imgui.pop_text_wrap_pos()

    def _plane(self, mood: PuppetMood) -> None:
        """Draw the plane with the named emotions; the mouse drags the point."""
        wide = imgui.get_content_region_avail().x
        high = min(TALLEST, wide * 0.8)
        x, y = imgui.get_cursor_screen_pos()
        self.plane = (x + SIDE, y + SIDE, x + wide - SIDE, y + high - SIDE)
        imgui.invisible_button("plane", (max(wide, 1), high))
        if imgui.is_item_active():
            mood.move_point(*self._value(*imgui.get_io().mouse_pos))
        to = imgui.get_window_draw_list()
        to.add_rect_filled((x, y), (x + wide, y + high), theme.packed(theme.RAISED), rounding=6.0)
        left, top, right, bottom = self.plane
        middle_x, middle_y = self._place(*NEUTRAL_POINT)
        line = theme.packed(theme.LINE)
        to.add_line((left, middle_y), (right, middle_y), line)
        to.add_line((middle_x, top), (middle_x, bottom), line)
        faint = theme.packed(theme.FAINT)
        font = imgui.get_font()
        to.add_text(font, 11.0, (middle_x + 4, y + 2), faint, "active")
        to.add_text(font, 11.0, (middle_x + 4, y + high - 14), faint, "passive")
        to.add_text(font, 11.0, (x + 6, y + high - 14), faint, "negative")
        positive = imgui.calc_text_size("positive").x * 11.0 / imgui.get_font_size()
        to.add_text(font, 11.0, (x + wide - positive - 6, y + high - 14), faint, "positive")
        self._names(to, font)
        if mood.point is not None:
            point = self._place(*mood.point)
            to.add_circle_filled(point, HANDLE, theme.packed(theme.ACCENT))
            to.add_circle(point, HANDLE, theme.packed(theme.TEXT), thickness=1.5)

    def _names(self, to: imgui.ImDrawList, font: imgui.ImFont) -> None:
        """Draw a dot and a name for each named emotion, names beside each other rather than over another."""
        taken: list[tuple[float, float, float]] = []
        for name, point in sorted(known_points().items(), key=lambda one: -one[1][0]):
            x, y = self._place(*point)
            to.add_circle_filled((x, y), DOT, theme.packed(theme.WARM))
            wide = imgui.calc_text_size(name).x * 12.0 / imgui.get_font_size()
            right = x + 6 + wide < self.plane[2] + SIDE
            left = x + 6 if right else x - 6 - wide
            up = y - 7
            while any(abs(up - other) < LABEL_HEIGHT and left < end and begin < left + wide
                      for begin, end, other in taken):  # fmt: skip
                up += 2
            taken.append((left, left + wide, up))
            to.add_text(font, 12.0, (left, up), theme.packed(theme.TEXT, 0.8), name)

    def _place(self, activation: float, evaluation: float) -> tuple[float, float]:
        """Where a point of the plane is drawn: evaluation to the right, activation upwards."""
        left, top, right, bottom = self.plane
        along, up = ((value - LOWEST) / (HIGHEST - LOWEST) for value in (evaluation, activation))
        return left + along * (right - left), bottom - up * (bottom - top)

    def _value(self, x: float, y: float) -> tuple[float, float]:
        """Activation and evaluation at a place, in points; `PuppetMood.move_point` limits them."""
        left, top, right, bottom = self.plane
        along, up = (x - left) / max(right - left, 1.0), (bottom - y) / max(bottom - top, 1.0)
        return LOWEST + up * (HIGHEST - LOWEST), LOWEST + along * (HIGHEST - LOWEST)

    def _slider(self, mood: PuppetMood, name: str, intensity: float) -> None:
        x, y = imgui.get_cursor_screen_pos()
        wide = imgui.get_content_region_avail().x
        title = min(130.0, wide * 0.4)
        imgui.align_text_to_frame_padding()
        imgui.text_colored(theme.TEXT if intensity else theme.FAINT, shorten(name, title - 6))
        imgui.same_line(title)
        imgui.set_next_item_width(wide - title)
        changed, value = imgui.slider_float(
            f"##{name}", intensity, 0.0, 100.0, "%.0f", imgui.SliderFlags_.always_clamp
        )
        self.sliders[name] = (x + title, x + wide, y + imgui.get_frame_height() / 2)
        if changed:
            mood.set_weight(name, value)

    def _add(self, mood: PuppetMood) -> None:
        """Draw the list of the expressions that have no slider yet."""
        others = [one.name for one in expressions() if one.name not in mood.weights]
        chosen = choose_name("##more", ("more ...", *others), 0)
        if chosen:
            mood.set_weight(others[chosen - 1], 0.0)
