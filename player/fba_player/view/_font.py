"""Text in pictures: Pillow's built-in font, the same on every machine."""

from __future__ import annotations

from functools import cache
from typing import Any

MIN_FONT_SIZE = 6
"""Pixels."""


def label_font(size: float) -> Any:
    """Return the font at a size in pixels, at least `MIN_FONT_SIZE`."""
    return _font(max(round(size), MIN_FONT_SIZE))


def shortened(draw: Any, text: str, font: Any, width: float) -> str:
    """Return the text, cut so that it is at most `width` pixels wide."""
    while len(text) > 1 and draw.textlength(text, font=font) > width:
        text = text[:-1]
    return text


@cache
def _font(pixels: int) -> Any:
    from PIL import ImageFont

    return ImageFont.load_default(pixels)
