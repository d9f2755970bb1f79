"""Visemes, expressions and moods in the puppeteer panel; a mood has sliders and a place in a plane."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from imgui_bundle import imgui

from fba.emotion import NEUTRAL_POINT, expressions, known_points
from fba.emotion.plane import SCALE_MAX, SCALE_MIN
from fba.parameters import EXPRESSIONS, INTENSITY_MAX, VISEMES
from fba_player._ui import theme
from fba_player._ui.panels.panel import choose_name, heading, shorten, tooltip, wrapped
from fba_player.session._puppet import Expression, PuppetMood, Viseme
from fba_player.session.performer import Performer
from fba_player.view._geometry import Box, overlap

MAX_PLANE_HEIGHT = 240.0
MIN_PLANE_HEIGHT = 104.0
"""Limits of the plane's height in points; within them it leaves room for what is below it."""
TWO_COLUMNS_WIDTH = 300.0
"""Width in points from which the sliders stand in two columns."""
MAX_TITLE_WIDTH = 130.0
"""Width in points of a slider's title, at most."""
EMOTION_RADIUS = 2.5
"""Radius of the dot of a named emotion, in points."""
HANDLE_RADIUS = 7.0
"""Radius of the point that the mouse drags, in points."""
EMOTION_TEXT = 12.0
"""Size of the names of emotions, in points."""
NAMES_APART = 6.0
"""Points between two names beside each other."""
AXIS_TEXT = 11.0
"""Size of the names at the ends of the axes, in points."""
SIDE_SPACE = 10.0
"""Space around the plane for the dots at its edge, in points."""


class EmotionTab:
    """Draws the plane and the sliders.

    For tests, in points: plane, its left, top, right and bottom; sliders, their left, right and middle by
    name; labels, the boxes of the names of emotions; hidden, the height of what has to be scrolled to.
    """

    def __init__(self) -> None:
        self.plane = (0.0, 0.0, 0.0, 0.0)
        self.sliders: dict[str, tuple[float, float, float]] = {}
        self.labels: dict[str, Box] = {}
        self.hidden = 0.0

    def draw(self, mood: PuppetMood) -> None:
        heading("Activation and evaluation")
        columns = 2 if imgui.get_content_region_avail().x >= TWO_COLUMNS_WIDTH else 1
        rows = -(-len(mood.weights) // columns) + 1  # and a heading, and two lines of text
        below = rows * imgui.get_frame_height_with_spacing() + 3.5 * imgui.get_text_line_height_with_spacing()
        self._plane(mood, below)
        heading("Moods")
        self.sliders = {}
        left, gap = imgui.get_cursor_pos_x(), imgui.get_style().item_spacing.x
        wide = (imgui.get_content_region_avail().x - (columns - 1) * gap) / columns
        for number, (name, intensity) in enumerate(mood.weights.items()):
            column = number % columns
            if column:
                imgui.same_line()
            imgui.set_cursor_pos_x(left + column * (wide + gap))
            self._slider(mood, name, intensity, wide)
        self._add(mood, imgui.get_content_region_avail().x * 0.6)
        imgui.same_line()
        imgui.begin_disabled(not mood.active)
        if imgui.button("Release##mood"):
            mood.release()
        imgui.end_disabled()
        tooltip("the face follows the animation again")
        text = f"{mood.blend}: activation {mood.blend.activation:.1f}, evaluation {mood.blend.evaluation:.1f}"
        wrapped(text if mood.active else "no mood", theme.FAINT)
        self.hidden = imgui.get_scroll_max_y()

    def _plane(self, mood: PuppetMood, below: float) -> None:
        """Draw the plane with the named emotions; the mouse drags the point. below: height left free."""
        wide, room = imgui.get_content_region_avail()
        high = min(max(min(MAX_PLANE_HEIGHT, room - below), MIN_PLANE_HEIGHT), wide * 0.8)
        x, y = imgui.get_cursor_screen_pos()
        self.plane = (x + SIDE_SPACE, y + SIDE_SPACE, x + wide - SIDE_SPACE, y + high - SIDE_SPACE)
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
        font = imgui.get_font()
        ends = (
            ("active", middle_x + 4, y + 2),
            ("passive", middle_x + 4, y + high - 14),
            ("negative", x + 6, y + high - 14),
            ("positive", x + wide - _width("positive", AXIS_TEXT) - 6, y + high - 14),
        )
        for text, at, above in ends:
            to.add_text(font, AXIS_TEXT, (at, above), theme.packed(theme.FAINT), text)
        taken = [(at, above, at + _width(text, AXIS_TEXT), above + AXIS_TEXT) for text, at, above in ends]
        places = {name: self._place(*point) for name, point in known_points().items()}
        sizes = {name: (_width(name, EMOTION_TEXT), EMOTION_TEXT) for name in places}
        self.labels = place_labels(places, sizes, (x, y, x + wide, y + high), taken)
        for name, place in places.items():
            to.add_circle_filled(place, EMOTION_RADIUS, theme.packed(theme.WARM))
            to.add_text(font, EMOTION_TEXT, self.labels[name][:2], theme.packed(theme.TEXT, 0.8), name)
        if mood.point is not None:
            point = self._place(*mood.point)
            to.add_circle_filled(point, HANDLE_RADIUS, theme.packed(theme.ACCENT))
            to.add_circle(point, HANDLE_RADIUS, theme.packed(theme.TEXT), thickness=1.5)

    def _place(self, activation: float, evaluation: float) -> tuple[float, float]:
        """Return where a point of the plane is drawn: evaluation to the right, activation upwards."""
        left, top, right, bottom = self.plane
        along, up = ((value - SCALE_MIN) / (SCALE_MAX - SCALE_MIN) for value in (evaluation, activation))
        return left + along * (right - left), bottom - up * (bottom - top)

    def _value(self, x: float, y: float) -> tuple[float, float]:
        """Return the activation and evaluation at a place, in points; `PuppetMood.move_point` limits them."""
        left, top, right, bottom = self.plane
        along, up = (x - left) / max(right - left, 1.0), (bottom - y) / max(bottom - top, 1.0)
        return SCALE_MIN + up * (SCALE_MAX - SCALE_MIN), SCALE_MIN + along * (SCALE_MAX - SCALE_MIN)

    def _slider(self, mood: PuppetMood, name: str, intensity: float, wide: float) -> None:
        x, y = imgui.get_cursor_screen_pos()
        start = imgui.get_cursor_pos_x()
        title = min(MAX_TITLE_WIDTH, wide * 0.45)
        imgui.align_text_to_frame_padding()
        imgui.text_colored(theme.TEXT if intensity else theme.FAINT, shorten(name, title - 6))
        imgui.same_line()
        imgui.set_cursor_pos_x(start + title)
        imgui.set_next_item_width(wide - title)
        changed, value = imgui.slider_float(
            f"##{name}", intensity, 0.0, 100.0, "%.0f", imgui.SliderFlags_.always_clamp
        )
        self.sliders[name] = (x + title, x + wide, y + imgui.get_frame_height() / 2)
        if changed:
            mood.set_weight(name, value)

    def _add(self, mood: PuppetMood, wide: float) -> None:
        """Draw the list of the expressions that have no slider yet."""
        others = [expression.name for expression in expressions() if expression.name not in mood.weights]
        chosen = choose_name("##more", ("more ...", *others), 0, wide)
        if chosen:
            mood.set_weight(others[chosen - 1], 0.0)


def place_labels(
    dots: Mapping[str, tuple[float, float]],
    sizes: Mapping[str, tuple[float, float]],
    within: Box,
    taken: Sequence[Box] = (),
) -> dict[str, Box]:
    """Return the places for the names of dots where they cover no dot and no other name, the nearest first.

    dots: x and y by name. sizes: width and height of each name. taken: boxes that are to stay free as well.
    Where there is no free place, the one that covers least is taken.
    """
    clear, apart = EMOTION_RADIUS + 2, NAMES_APART
    points = [(x - clear, y - clear, x + clear, y + clear) for x, y in dots.values()]
    used = [*taken, *points]
    placed: dict[str, Box] = {}
    for name, (x, y) in sorted(dots.items(), key=lambda dot: dot[1][1]):
        wide, high = sizes[name]
        beside, middle = clear + 1, y - high / 2
        best, least = (x, y, x, y), math.inf
        for step in range(4):
            up, down = y - clear - high - step * high / 2, y + clear + step * high / 2
            corners = [(x + beside, middle), (x - beside - wide, middle)] if not step else []
            corners += [(x + side, at) for at in (down, up) for side in (beside, -wide / 2, -beside - wide)]
            for left, top in corners:
                box = (left, top, left + wide, top + high)
                covers = sum(overlap(box, other) for other in used) + wide * high - overlap(box, within)
                if covers < least - 0.5:
                    best, least = box, covers
        placed[name] = best
        used.append((best[0] - apart, best[1], best[2] + apart, best[3]))
    return placed


def _width(text: str, size: float) -> float:
    """Return the width of a text in letters of a size, in points."""
    return float(imgui.calc_text_size(text).x * size / imgui.get_font_size())


def draw_visemes(performer: Performer) -> None:
    """Draw the choice of two visemes and their mix."""
    heading("Visemes")
    puppet, now = performer.puppet, performer.puppet.viseme
    first = _choice("first##viseme", VISEMES, now.select1)
    second = _choice("second##viseme", VISEMES, now.select2)
    blend = _slider("share of first", now.blend)
    if (first, second, blend) != (now.select1, now.select2, now.blend):
        puppet.viseme = Viseme(first, second, blend)
    if _release("viseme", enabled=puppet.speaks):
        puppet.viseme = Viseme()


def draw_mouth(performer: Performer) -> None:
    """Draw the slider that opens the mouth, jaw with lips."""
    heading("Mouth")
    performer.puppet.mouth_opening = _slider("open", performer.puppet.mouth_opening, 100)


def draw_expressions(performer: Performer) -> None:
    """Draw the choice of two expressions and their intensities."""
    heading("Expressions")
    puppet, now = performer.puppet, performer.puppet.expression
    values = []
    before = ("first", now.select1, now.intensity1), ("second", now.select2, now.intensity2)
    for word, which, strong in before:
        select = _choice(f"{word}##expression", EXPRESSIONS, which)
        values += [select, _slider(f"intensity##{word}", strong)]
    if values != [now.select1, now.intensity1, now.select2, now.intensity2]:
        puppet.expression = Expression(*values)
    if _release("expression", enabled=puppet.feels):
        puppet.expression = Expression()
    imgui.dummy((1, 4))
    wrapped(
        "A viseme replaces the mouth of the animation; expressions are added to the animation. "
        "Sliders override both.",
        theme.FAINT,
    )


def _release(what: str, *, enabled: bool) -> bool:
    """Draw a button, disabled unless `enabled`, so that nothing moves under the mouse; return a press."""
    imgui.begin_disabled(not enabled)
    pressed = imgui.button(f"Release##{what}")
    imgui.end_disabled()
    return bool(pressed and enabled)


def _slider(label: str, now: int, most: int = INTENSITY_MAX) -> int:
    """Draw a slider from 0 to the largest intensity; return its value."""
    imgui.set_next_item_width(-100)
    return int(imgui.slider_int(label, now, 0, most, "%d", imgui.SliderFlags_.always_clamp)[1])


def _choice(label: str, names: tuple[str, ...], now: int) -> int:
    numbered = [f"{number} {name}" if number else "none" for number, name in enumerate(names)]
    return choose_name(label, numbered, now, -100)
