"""Colours, spacing and type of the panels: dark, neutral, quiet beside the picture."""

from __future__ import annotations

import colorsys
from pathlib import Path

import imgui_bundle
from imgui_bundle import imgui

FONT_SIZE = 15.0
SMALL = 13.0
LARGE = 20.0

Colour = tuple[float, float, float, float]

TEXT: Colour = (0.91, 0.92, 0.935, 1.0)
FAINT: Colour = (0.60, 0.625, 0.66, 1.0)
ACCENT: Colour = (0.36, 0.68, 0.90, 1.0)
WARM: Colour = (0.96, 0.72, 0.33, 1.0)
ALERT: Colour = (0.92, 0.36, 0.32, 1.0)
GROUND: Colour = (0.086, 0.092, 0.102, 0.93)
RAISED: Colour = (0.155, 0.165, 0.182, 1.0)
HOVERED: Colour = (0.215, 0.23, 0.255, 1.0)
HOLLOW: Colour = (0.0, 0.0, 0.0, 0.22)
LINE: Colour = (1.0, 1.0, 1.0, 0.075)
HUES = {"joy": 45, "sadness": 220, "anger": 4, "fear": 268, "disgust": 110, "surprise": 26, "sleepiness": 200}
"""Hues of expressions in degrees, those of the web page."""


def name_colour(name: str) -> Colour:
    """Return the colour of a viseme or an expression in lanes, the same as on the web page."""
    hue = HUES[name] if name in HUES else (47 * len(name) + 31 * ord(name[0])) % 360
    return (*colorsys.hls_to_rgb(hue / 360, 0.55, 0.6), 1.0)


def packed(colour: Colour, alpha: float = 1.0) -> int:
    """Return a colour as the 32-bit integer that draw lists of imgui take."""
    red, green, blue, opacity = colour
    return (
        int(red * 255 + 0.5)
        | int(green * 255 + 0.5) << 8
        | int(blue * 255 + 0.5) << 16
        | int(opacity * alpha * 255 + 0.5) << 24
    )


def apply_theme() -> None:
    """Set the style and font of the current imgui context."""
    style = imgui.get_style()
    imgui.style_colors_dark()
    style.window_rounding = style.popup_rounding = 8.0
    style.frame_rounding = style.grab_rounding = 5.0
    style.child_rounding = 6.0
    style.scrollbar_rounding = 6.0
    style.scrollbar_size = 10.0
    style.grab_min_size = 10.0
    style.window_padding = imgui.ImVec2(14, 12)
    style.frame_padding = imgui.ImVec2(9, 5)
    style.item_spacing = imgui.ImVec2(9, 7)
    style.item_inner_spacing = imgui.ImVec2(7, 5)
    style.cell_padding = imgui.ImVec2(6, 3)
    style.window_border_size = 1.0
    style.frame_border_size = 1.0
    style.popup_border_size = 1.0
    style.window_title_align = imgui.ImVec2(0.0, 0.5)
    style.window_menu_button_position = imgui.Dir.none
    style.hover_stationary_delay = 0.35
    style.disabled_alpha = 0.45
    kinds = imgui.Col_
    colours: dict[imgui.Col_, Colour] = {
        kinds.text: TEXT,
        kinds.text_disabled: FAINT,
        kinds.window_bg: GROUND,
        kinds.popup_bg: (0.105, 0.112, 0.124, 0.98),
        kinds.child_bg: (0, 0, 0, 0),
        kinds.border: LINE,
        kinds.frame_bg: RAISED,
        kinds.frame_bg_hovered: HOVERED,
        kinds.frame_bg_active: (0.25, 0.27, 0.30, 1.0),
        kinds.title_bg: (0.086, 0.092, 0.102, 0.97),
        kinds.title_bg_active: (0.118, 0.126, 0.14, 0.98),
        kinds.title_bg_collapsed: (0.086, 0.092, 0.102, 0.9),
        kinds.scrollbar_bg: (0, 0, 0, 0),
        kinds.scrollbar_grab: (1, 1, 1, 0.16),
        kinds.scrollbar_grab_hovered: (1, 1, 1, 0.26),
        kinds.scrollbar_grab_active: (1, 1, 1, 0.34),
        kinds.check_mark: ACCENT,
        kinds.slider_grab: (0.36, 0.68, 0.90, 0.5),
        kinds.slider_grab_active: (0.36, 0.68, 0.90, 0.75),
        kinds.button: RAISED,
        kinds.button_hovered: HOVERED,
        kinds.button_active: (0.27, 0.29, 0.325, 1.0),
        kinds.header: (1, 1, 1, 0.07),
        kinds.header_hovered: (1, 1, 1, 0.11),
        kinds.header_active: (1, 1, 1, 0.15),
        kinds.tab: (0, 0, 0, 0),
        kinds.tab_hovered: HOVERED,
        kinds.tab_selected: RAISED,
        kinds.tab_selected_overline: ACCENT,
        kinds.separator: LINE,
        kinds.separator_hovered: ACCENT,
        kinds.separator_active: ACCENT,
        kinds.resize_grip: (1, 1, 1, 0.06),
        kinds.resize_grip_hovered: ACCENT,
        kinds.resize_grip_active: ACCENT,
        kinds.plot_lines: ACCENT,
        kinds.plot_histogram: ACCENT,
        kinds.text_selected_bg: (0.36, 0.68, 0.90, 0.35),
        kinds.table_border_light: LINE,
        kinds.table_border_strong: LINE,
        kinds.table_header_bg: (1, 1, 1, 0.05),
        kinds.nav_cursor: ACCENT,
    }
    for kind, colour in colours.items():
        style.set_color_(kind, imgui.ImVec4(*colour))
    style.font_size_base = FONT_SIZE
    _load_font()


def _load_font() -> None:
    """Load Roboto (Apache 2.0), which imgui-bundle ships with its licence, else the font of imgui."""
    fonts = imgui.get_io().fonts
    path = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
    if path.is_file():
        fonts.add_font_from_file_ttf(str(path), FONT_SIZE)
    else:
        fonts.add_font_default()
