"""A mouse over a window's inside that is drawn into memory; places are in points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tools.window_picture import Studio


class StudioHand:
    """Moves and presses imgui's own mouse, and draws the panels until they know."""

    def __init__(self, studio: Studio) -> None:
        self.studio = studio

    def move(self, x: float, y: float) -> None:
        self.studio.gui.io.add_mouse_pos_event(x, y)
        self.studio.session.touched()
        self.studio.settle(2)

    def button(self, down: bool, number: int = 0) -> None:
        self.studio.gui.io.add_mouse_button_event(number, down)
        self.studio.settle(2)

    def click(self, x: float, y: float, number: int = 0) -> None:
        self.move(x, y)
        self.button(True, number)
        self.button(False, number)

    def double_click(self, x: float, y: float, number: int = 0) -> None:
        self.click(x, y, number)
        self.click(x, y, number)

    def drag(self, start: tuple[float, float], end: tuple[float, float], number: int = 0) -> None:
        self.move(*start)
        self.button(True, number)
        self.move(*end)
        self.button(False, number)

    def wheel(self, steps: float) -> None:
        self.studio.gui.io.add_mouse_wheel_event(0, steps)
        self.studio.settle(2)

    def write(self, text: str) -> None:
        for letter in text:
            self.studio.gui.io.add_input_character(ord(letter))
        self.studio.settle(2)


def panel_of(studio: Studio, name: str) -> Any:
    """The panel of that name."""
    return next(panel for panel in studio.gui.panels if panel.name == name)
