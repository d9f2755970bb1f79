"""Visemes and expressions in the puppeteer panel."""

from __future__ import annotations

from imgui_bundle import imgui

from fba.parameters import EXPRESSIONS, INTENSITY_MAX, VISEMES
from fba_player._ui import theme
from fba_player._ui.panels.panel import choose_name, heading
from fba_player.session.performer import Performer
from fba_player.session.puppet import Expression, Viseme


def draw_visemes(performer: Performer) -> None:
    """Draw the choice of two visemes and their mix."""
    heading("Visemes")
    puppet, now = performer.puppet, performer.puppet.viseme
    first = _choice("first##viseme", VISEMES, now.select1)
    second = _choice("second##viseme", VISEMES, now.select2)
    imgui.set_next_item_width(-100)
    _, blend = imgui.slider_int("share of first", now.blend, 0, INTENSITY_MAX, "%d",
                                imgui.SliderFlags_.always_clamp)  # fmt: skip
    if (first, second, blend) != (now.select1, now.select2, now.blend):
        puppet.viseme = Viseme(first, second, blend)
    if _release("viseme", enabled=puppet.speaks):
        puppet.viseme = Viseme()


def draw_expressions(performer: Performer) -> None:
    """Draw the choice of two expressions and their intensities."""
    heading("Expressions")
    puppet, now = performer.puppet, performer.puppet.expression
    values = []
    for word, which, strong in (
        ("first", now.select1, now.intensity1),
        ("second", now.select2, now.intensity2),
    ):
        select = _choice(f"{word}##expression", EXPRESSIONS, which)
        imgui.set_next_item_width(-100)
        _, intensity = imgui.slider_int(f"intensity##{word}", strong, 0, INTENSITY_MAX, "%d",
                                        imgui.SliderFlags_.always_clamp)  # fmt: skip
        values += [select, intensity]
    if values != [now.select1, now.intensity1, now.select2, now.intensity2]:
        puppet.expression = Expression(*values)
    if _release("expression", enabled=puppet.feels):
        puppet.expression = Expression()
    imgui.dummy((1, 4))
    imgui.push_text_wrap_pos(0.0)
    imgui.text_colored(
        theme.FAINT,
        "A viseme replaces the mouth of the animation; expressions are added to the animation. "
        "Sliders override both.",
    )
    imgui.pop_text_wrap_pos()


def _release(what: str, *, enabled: bool) -> bool:
    """Draw a button, disabled unless `enabled`, so that nothing moves under the mouse; return a press."""
    imgui.begin_disabled(not enabled)
    pressed = imgui.button(f"Release##{what}")
    imgui.end_disabled()
    return bool(pressed and enabled)


def _choice(label: str, names: tuple[str, ...], now: int) -> int:
    numbered = [f"{number} {name}" if number else "none" for number, name in enumerate(names)]
    return choose_name(label, numbered, now, -100)
