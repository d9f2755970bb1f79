"""F7: the puppeteer panel, which moves the face and the body by hand, and records takes."""

from __future__ import annotations

import shlex

from imgui_bundle import imgui

from fba.errors import FbaError
from fba_player._ui import theme
from fba_player._ui.panels._curve_data import parameter
from fba_player._ui.panels._puppet_emotion import EmotionTab, draw_expressions, draw_mouth, draw_visemes
from fba_player._ui.panels._puppet_rows import Group, Row, groups
from fba_player._ui.panels.panel import Panel, shorten, tooltip
from fba_player.scene.scene import Scene
from fba_player.session._session import Session
from fba_player.session.performer import Performer

TITLE_WIDTH = 148.0
VALUE_WIDTH = 68.0
RELEASE_WIDTH = 18.0
"""Widths in points of the title of a row, its value, and its release button."""
MIN_SLIDER = 84.0
"""Least width of a slider in points: titles are cut first."""
ONE_ROW_WIDTH = 268.0
"""Least width in points of the row at the top, if there is no take."""
MIN_TITLE = 70.0
"""Least width of a title in points."""


class PuppetPanel(Panel):
    """Sliders for FAPs and the body, visemes, expressions, moods, and takes."""

    name, title, label = "puppet", "Puppeteer", "Puppet"
    width, height, least = 380.0, 530.0, 280.0

    def __init__(self) -> None:
        self._performer: Performer | None = None
        self._take_name = ""
        self._zeroed = ""
        self.together = True
        """Whether left and right move together."""
        self.emotion = EmotionTab()
        self.sliders: dict[tuple[str, int], tuple[float, float, float]] = {}
        """Sliders in view by (group, row): left, right and vertical middle in points; for tests."""
        self.buttons: dict[str, tuple[float, float]] = {}
        """Centres of buttons and tabs by name, in points; for tests."""

    def available(self, session: Session) -> bool:
        """Return whether a single animation is shown."""
        return isinstance(session.scene, Scene)

    def performer(self, session: Session) -> Performer:
        """Return the performer of the session, made when it is first needed."""
        if self._performer is None or self._performer.session is not session:
            self._performer = Performer(session)
        return self._performer

    def draw(self, session: Session) -> None:
        """Draw the content."""
        performer = self.performer(session)
        performer.attach()
        self._takes(session, performer)
        if performer.recording is not None or performer.takes.last is not None or self._narrow():
            imgui.separator()
        else:
            imgui.same_line(0, 14)
        _, self.together = imgui.checkbox("both sides", self.together)
        tooltip("left and right move together")
        imgui.same_line(0, 14)
        imgui.begin_disabled(performer.puppet.idle)
        if self._button("Release all"):
            performer.puppet.release_all()
        tooltip("all parameters follow the animation again")
        imgui.end_disabled()
        self.sliders = {}
        if imgui.begin_tab_bar("parts"):
            for title, kind in (("Face", "fap"), ("Speech", "speech"), ("Mood", "mood"), ("Body", "bap")):
                if kind == "bap" and not session.scene.has_body:
                    continue
                opened = imgui.begin_tab_item(title)[0]
                self._remember(title)
                if opened:
                    imgui.push_style_var(imgui.StyleVar_.frame_padding, (8, 3))
                    imgui.push_style_var(imgui.StyleVar_.item_spacing, (8, 4))
                    imgui.begin_child("rows", (0, 0))
                    if kind == "speech":
                        draw_mouth(performer)
                        draw_visemes(performer)
                        draw_expressions(performer)
                    elif kind == "mood":
                        self.emotion.draw(performer.puppet.mood)
                    else:
                        self._groups(performer, kind)
                    imgui.end_child()
                    imgui.pop_style_var(2)
                    imgui.end_tab_item()
            imgui.end_tab_bar()

    def closed(self, session: Session) -> None:
        """End the take that is being recorded; moved values stay."""
        if self._performer is not None:
            self._performer.stop()

    def _takes(self, session: Session, performer: Performer) -> None:
        """Draw the buttons to record, show, undo and save takes."""
        if performer.recording is not None:
            imgui.push_style_color(imgui.Col_.button, (0.62, 0.20, 0.18, 1.0))
            pressed = self._button(f"Stop   {performer.recording:.1f} s###record")
            imgui.pop_style_color()
            if pressed:
                performer.stop()
                self._take_name = self._take_name or performer.takes.free_name()
            return
        if self._button("Record###record"):
            performer.record()
        tooltip("record what is shown, with your changes, as a take")
        last = performer.takes.last
        if last is None:
            return
        imgui.same_line()
        if self._button("Stop###show" if performer.showing else "Show###show"):
            performer.stop() if performer.showing else performer.show()
        tooltip("play the last take once")
        imgui.same_line()
        if self._button("Undo"):
            performer.undo()
            session.say("The last take was deleted")
        tooltip("delete the last take")
        imgui.same_line(0, 12)
        imgui.text_colored(theme.FAINT, f"{last.name}: {float(last.duration):.1f} s")
        imgui.set_next_item_width(imgui.get_content_region_avail().x - 64)
        entered, self._take_name = imgui.input_text_with_hint(
            "##name", "name of the file", self._take_name, imgui.InputTextFlags_.enter_returns_true
        )
        imgui.same_line()
        if self._button("Save") or entered:
            _save(session, performer, self._take_name)

    @staticmethod
    def _narrow() -> bool:
        """Return whether the button to record, the tick and the button to release need two rows."""
        return bool(imgui.get_content_region_avail().x < ONE_ROW_WIDTH)

    def _button(self, text: str) -> bool:
        pressed = imgui.button(text)
        self._remember(text.rpartition("###")[2])
        return bool(pressed)

    def _remember(self, name: str) -> None:
        low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
        self.buttons[name] = ((low.x + high.x) / 2, (low.y + high.y) / 2)

    def _groups(self, performer: Performer, kind: str) -> None:
        first = True
        for group in groups():
            if group.kind != kind:
                continue
            moved = performer.puppet.fap_moved if kind == "fap" else performer.puppet.bap_moved
            touched = any(moved[number - 1] for number in group.numbers)
            imgui.set_next_item_open(first, imgui.Cond_.first_use_ever)
            first = False
            flags = imgui.TreeNodeFlags_.allow_overlap
            opened = imgui.collapsing_header(f"{group.name}{'  *' if touched else ''}###{group.name}", flags)
            if not opened:
                continue
            for index, row in enumerate(group.rows):
                if self.together and row.side == "r" and row.mirror is not None:
                    continue
                self._row(performer, group, index, row)
            _group_buttons(performer, group, touched=touched)

    def _row(self, performer: Performer, group: Group, index: int, row: Row) -> None:
        """Draw a title, a slider, and a release button if it was moved."""
        x, y = imgui.get_cursor_screen_pos()
        high = imgui.get_frame_height()
        top = imgui.get_window_pos().y
        if y + high < top or y > top + imgui.get_window_height():
            imgui.dummy((1, high))
            return
        puppet = performer.puppet
        moved = puppet.fap_moved if row.kind == "fap" else puppet.bap_moved
        shown = puppet.shown[row.kind == "bap"]
        touched = bool(moved[row.numbers[0] - 1])
        value = sum(float(shown[number - 1]) for number in row.numbers) * row.scale
        title = row.title
        if self.together and row.mirror is not None:
            title = title.removesuffix(" L").removesuffix(" R")
        width = imgui.get_content_region_avail().x
        name_wide = min(TITLE_WIDTH, max(width - RELEASE_WIDTH - VALUE_WIDTH - MIN_SLIDER, MIN_TITLE))
        imgui.align_text_to_frame_padding()
        imgui.text_colored(theme.TEXT if touched else theme.FAINT, shorten(title, name_wide - 6))
        if imgui.is_item_hovered():
            tooltip(_parameter_names(row))
        imgui.same_line(name_wide)
        right = x + width - RELEASE_WIDTH
        wide = max(width - name_wide - RELEASE_WIDTH - VALUE_WIDTH, 16.0)
        imgui.set_next_item_width(wide)
        if touched:
            imgui.push_style_color(imgui.Col_.slider_grab, theme.ACCENT)
        name = f"##{group.name}{index}"
        clamped = imgui.SliderFlags_.always_clamp
        changed, value = imgui.slider_float(name, value, row.low, row.high, "", clamped)
        if touched:
            imgui.pop_style_color()
        self.sliders[group.name, index] = (x + name_wide, x + name_wide + wide, y + high / 2)
        if imgui.is_item_hovered() and imgui.is_mouse_double_clicked(0):
            self._zeroed = name
            changed, value = True, 0.0
        elif self._zeroed == name:
            changed = changed and not imgui.is_item_active()
            if not imgui.is_mouse_down(0):
                self._zeroed = ""
        if changed:
            self._move(performer, group, row, value)
        text = f"{value:.0f} {row.unit}"
        shade = theme.packed(theme.TEXT if touched else theme.FAINT)
        place = (right - 4 - imgui.calc_text_size(text).x, y + 3)
        imgui.get_window_draw_list().add_text(place, shade, text)
        if touched:
            imgui.same_line()
            imgui.set_cursor_screen_pos((right, y))
            imgui.push_style_color(imgui.Col_.button, (0, 0, 0, 0))
            imgui.push_style_var(imgui.StyleVar_.frame_padding, (4, 3))
            if imgui.button(f"\u00d7{name}"):
                self._release(performer, group, row)
            imgui.pop_style_var()
            imgui.pop_style_color()
            tooltip("release: follow the animation again")

    def _both(self, group: Group, row: Row) -> list[tuple[Row, float]]:
        """Return the rows that a slider moves, each with its sign."""
        if not self.together or row.mirror is None:
            return [(row, 1.0)]
        return [(row, 1.0), (group.rows[row.mirror], -1.0 if row.flipped else 1.0)]

    def _move(self, performer: Performer, group: Group, row: Row, value: float) -> None:
        for moved, sign in self._both(group, row):
            _set(performer, moved.kind, moved.numbers, sign * value / moved.scale / len(moved.numbers))

    def _release(self, performer: Performer, group: Group, row: Row) -> None:
        for moved, _ in self._both(group, row):
            _release(performer, moved.kind, moved.numbers)


def _group_buttons(performer: Performer, group: Group, *, touched: bool) -> None:
    if imgui.small_button(f"All to zero##{group.name}"):
        _set(performer, group.kind, group.numbers, 0.0)
    if touched:
        imgui.same_line()
        if imgui.small_button(f"Release##{group.name}"):
            _release(performer, group.kind, group.numbers)
    imgui.dummy((1, 2))


def _parameter_names(row: Row) -> str:
    """Return the parameters that a row moves, as text."""
    names = (f"{number} {parameter(row.kind, number).name}" for number in row.numbers)
    return f"{row.kind.upper()} {', '.join(names)}"


def _set(performer: Performer, kind: str, numbers: tuple[int, ...], value: float) -> None:
    move = performer.puppet.move_fap if kind == "fap" else performer.puppet.move_bap
    for number in numbers:
        move(number, value)


def _release(performer: Performer, kind: str, numbers: tuple[int, ...]) -> None:
    if kind == "fap":
        performer.puppet.release(faps=numbers)
    else:
        performer.puppet.release(baps=numbers)


def _save(session: Session, performer: Performer, name: str) -> None:
    try:
        path, steps = performer.save(name)
    except (FbaError, OSError) as error:
        session.say(str(error), "error", 8.0)
        return
    last = performer.takes.last
    how = ""
    if steps != "iso" and last is not None and last.body is not None:
        how = f". Play it with: fba play {shlex.quote(str(path))} --bap-steps {steps}"
    session.say(f"Saved as {path}{how}", seconds=8.0 if how else 4.0)
