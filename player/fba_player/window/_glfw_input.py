"""Input from glfw: keys by their names in the table of keys, and keyboard and mouse for imgui."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from fba_player.session._controls import Controls
from fba_player.session._keys import by_name
from fba_player.session._session import Session
from fba_player.window._display import decode

CURSORS = {
    "text_input": "IBEAM_CURSOR",
    "hand": "HAND_CURSOR",
    "resize_ew": "HRESIZE_CURSOR",
    "resize_ns": "VRESIZE_CURSOR",
}
"""Cursors of glfw by the names of imgui; all others are an arrow."""
BUTTONS = ("left", "right", "middle")
KEY_NAMES = {
    "SPACE": "space", "LEFT": "left", "RIGHT": "right", "UP": "up", "DOWN": "down", "HOME": "home",
    "END": "end", "ESCAPE": "esc", "ENTER": "enter", "TAB": "tab", "BACKSPACE": "backspace",
    "DELETE": "delete", "PAGE_UP": "pageup", "PAGE_DOWN": "pagedown",
    "KP_ADD": "+", "KP_SUBTRACT": "-", "EQUAL": "+", "MINUS": "-",
    **{f"F{number}": f"f{number}" for number in range(1, 13)},
    **{f"KP_{number}": str(number) for number in range(10)},
}  # fmt: skip
"""Names in the table of keys by those of glfw, for keys without a letter, or equal on all keyboards."""
US_LAYOUT = {
    "LEFT_BRACKET": "[", "RIGHT_BRACKET": "]", "BACKSLASH": "\\",
    **{str(number): str(number) for number in range(10)},
    **{letter: letter.lower() for letter in "ABCDEFGHIJKLMNOPQRSTUVWXYZ"},
}  # fmt: skip
"""Keys of the US layout, used where the character of the user's own layout has no meaning here."""


class GlfwInput:
    """Hands the events of a glfw window to the panels and the controls.

    gui: a `fba_player._ui.gui.Gui`, or None where there are no panels. on_input: called after each event that
    may change the picture.
    """

    def __init__(
        self,
        glfw: Any,
        window: Any,
        session: Session,
        controls: Controls,
        gui: Any,
        on_input: Callable[[], None],
    ) -> None:
        self._glfw, self._window = glfw, window
        self._session, self._controls, self._gui = session, controls, gui
        self._on_input = on_input
        self._key_names = {getattr(glfw, f"KEY_{name}"): word for name, word in KEY_NAMES.items()}
        self._us_layout = {getattr(glfw, f"KEY_{name}"): word for name, word in US_LAYOUT.items()}
        self._cursor = "arrow"
        self._cursors: dict[str, Any] = {}
        self._imgui_keys: dict[int, Any] = _imgui_keys(glfw) if gui is not None else {}
        glfw.set_key_callback(window, self.on_key)
        glfw.set_char_callback(window, self.on_character)
        glfw.set_mouse_button_callback(window, self.on_button)
        glfw.set_cursor_pos_callback(window, self.on_move)
        glfw.set_cursor_enter_callback(window, self.on_enter)
        glfw.set_scroll_callback(window, self.on_scroll)
        glfw.set_window_focus_callback(window, self.on_focus)
        glfw.set_drop_callback(window, self.on_drop)
        glfw.set_framebuffer_size_callback(window, lambda *_: on_input())
        glfw.set_window_refresh_callback(window, lambda *_: on_input())
        if glfw.get_window_attrib(window, glfw.HOVERED):  # it may not move before it clicks
            self.on_move(window, *glfw.get_cursor_pos(window))

    def on_key(self, window: Any, key: int, code: int, action: int, modifiers: int) -> None:
        """Handle a key that goes down, repeats, or goes up."""
        glfw = self._glfw
        if self._gui is not None:
            self._send_key_to_imgui(key, action, modifiers)
            # Text that is typed is no key of ours; but Esc closes a list, whose search field has the keys.
            closes = key == glfw.KEY_ESCAPE and self._session.popup
            if action != glfw.RELEASE and self._gui.io.want_text_input and not closes:
                self._on_input()
                return
        if action == glfw.RELEASE:
            return
        name = self.name(key, code, modifiers)
        if name is not None:
            self._controls.key(name, held=action == glfw.REPEAT)
        self._on_input()

    def on_drop(self, window: Any, paths: list[str]) -> None:
        """Handle files that were dropped onto the window; see `Session.drop`."""
        self._session.drop(tuple(Path(decode(path)) for path in paths))
        self._on_input()

    def on_character(self, window: Any, character: int) -> None:
        if self._gui is not None:
            self._gui.io.add_input_character(character)
            self._on_input()

    def on_button(self, window: Any, button: int, action: int, modifiers: int) -> None:
        """Handle a mouse button that goes down or up."""
        down = action == self._glfw.PRESS
        self._session.touched()
        if self._gui is not None:
            if button < 5:
                self._gui.io.add_mouse_button_event(button, down)
        elif down and button < len(BUTTONS):
            self._controls.press(BUTTONS[button], *self.pixels(*self._glfw.get_cursor_pos(window)))
        else:
            self._controls.release()
        self._on_input()

    def on_move(self, window: Any, x: float, y: float) -> None:
        """Handle a move of the mouse. x, y: in the units of the window."""
        self._session.touched()
        right, down = self.pixels(x, y)
        if self._gui is not None:
            scale = self._session.scale
            self._gui.io.add_mouse_pos_event(right / scale, down / scale)
        else:
            self._controls.move(right, down)
        self._on_input()

    def on_enter(self, window: Any, entered: int) -> None:
        if self._gui is not None and not entered:
            self._gui.io.add_mouse_pos_event(-3.4e38, -3.4e38)
        self._on_input()

    def on_scroll(self, window: Any, right: float, up: float) -> None:
        self._session.touched()
        if self._gui is not None:
            self._gui.io.add_mouse_wheel_event(right, up)
        else:
            self._controls.scroll(up)
        self._on_input()

    def on_focus(self, window: Any, focused: int) -> None:
        if self._gui is not None:
            self._gui.io.add_focus_event(bool(focused))

    def set_cursor(self, *, hidden: bool) -> None:
        """Set the mouse cursor that imgui asks for, or hide it."""
        glfw = self._glfw
        shape = "hidden" if hidden else self._gui.cursor if self._gui is not None else "arrow"
        if shape == self._cursor:
            return
        self._cursor = shape
        mode = glfw.CURSOR_HIDDEN if hidden else glfw.CURSOR_NORMAL
        glfw.set_input_mode(self._window, glfw.CURSOR, mode)
        if hidden:
            return
        kind = CURSORS.get(shape)
        if kind is not None and shape not in self._cursors:
            self._cursors[shape] = glfw.create_standard_cursor(getattr(glfw, kind))
        glfw.set_cursor(self._window, self._cursors.get(shape))

    def name(self, key: int, code: int, modifiers: int) -> str | None:
        """Return a key's name in the table of keys, "space", "shift+left", "ctrl+s"; None without one."""
        glfw = self._glfw
        word = self._key_names.get(key)
        if word is None:
            text = glfw.get_key_name(key, code)  # what the user's own keyboard layout has there
            word = decode(text).lower() if text else None
            if word is None or (key in self._us_layout and not self._has_meaning(word)):
                word = self._us_layout.get(key, word)
        if word is None:
            return None
        control = modifiers & (glfw.MOD_CONTROL | glfw.MOD_SUPER)
        shift = modifiers & glfw.MOD_SHIFT and (control or len(word) > 1) and word != "+"  # it makes the plus
        return ("ctrl+" if control else "") + ("shift+" if shift else "") + word

    def pixels(self, x: float, y: float) -> tuple[float, float]:
        """Convert from the units of the window to pixels of the picture."""
        wide, high = self._glfw.get_window_size(self._window)
        size = self._glfw.get_framebuffer_size(self._window)
        return x * size[0] / max(wide, 1), y * size[1] / max(high, 1)

    def _has_meaning(self, word: str) -> bool:
        return word in by_name() or any(key.lower() == word for key, _ in self._session.switch_keys())

    def _send_key_to_imgui(self, key: int, action: int, modifiers: int) -> None:
        from imgui_bundle import imgui

        glfw, io = self._glfw, self._gui.io
        if action == glfw.REPEAT:
            return
        for ours, name in (("CONTROL", "ctrl"), ("SHIFT", "shift"), ("ALT", "alt"), ("SUPER", "super")):
            pressed = bool(modifiers & getattr(glfw, f"MOD_{ours}"))
            io.add_key_event(getattr(imgui.Key, f"mod_{name}"), pressed)
        if key in self._imgui_keys:
            io.add_key_event(self._imgui_keys[key], action == glfw.PRESS)


def _imgui_keys(glfw: Any) -> dict[int, Any]:
    """Return the keys that imgui needs to edit text, by those of glfw."""
    from imgui_bundle import imgui

    words = {
        "LEFT": "left_arrow", "RIGHT": "right_arrow", "UP": "up_arrow", "DOWN": "down_arrow", "HOME": "home",
        "END": "end", "DELETE": "delete", "BACKSPACE": "backspace", "ENTER": "enter", "ESCAPE": "escape",
        "TAB": "tab", "KP_ENTER": "keypad_enter", "PAGE_UP": "page_up", "PAGE_DOWN": "page_down",
        **{letter: letter.lower() for letter in "ACVXYZ"},
    }  # fmt: skip
    return {getattr(glfw, f"KEY_{name}"): getattr(imgui.Key, word) for name, word in words.items()}
