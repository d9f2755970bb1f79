"""A picture of what was found: each outline, and beside it the silhouettes that are nearest to it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.arrays import Bool, UInt8
from fba.outlines._index import Hit, Index
from fba.outlines._index_file import pack_mask, unpack_mask
from fba.outlines._mask import fit_mask

PAPER, INK, ASKED = (250, 250, 248), (40, 40, 44), (30, 90, 170)
"""Colours: background, silhouettes and text, the outline that was looked for."""
MOST_LETTERS = 24
"""Of a line of text."""
TILE, LINES, FONT = 150, 34, 11
"""Pixels: the side of a silhouette, the height of the text below it, and of its letters."""


def draw_sheet(index: Index, masks: Sequence[Bool], found: Sequence[Sequence[Hit]]) -> UInt8:
    """Return a picture, uint8 (H, W, 3): a row for each outline, with what was found for it to its right."""
    from PIL import Image, ImageDraw, ImageFont

    columns = 1 + max(len(hits) for hits in found)
    sheet = Image.new("RGB", (columns * TILE, len(masks) * (TILE + LINES)), PAPER)
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(FONT)
    for row, (mask, hits) in enumerate(zip(masks, found, strict=True)):
        top = row * (TILE + LINES)
        asked = unpack_mask(pack_mask(fit_mask(mask)))
        shown = [(asked, ("the picture", ""), ASKED)]
        shown += [(index.silhouette(hit.number), _label(hit), INK) for hit in hits]
        for column, (silhouette, label, colour) in enumerate(shown):
            tile = Image.fromarray(silhouette.astype(np.uint8) * np.uint8(255)).resize(
                (TILE - 10, TILE - 10), Image.Resampling.BILINEAR
            )
            sheet.paste(colour, (column * TILE + 5, top + 5), tile)
            for line, text in enumerate(label):
                place = (column * TILE + 5, top + TILE + 14 * line - 2)
                draw.text(place, text[:MOST_LETTERS], INK, font=font)
    return np.asarray(sheet)


def _label(hit: Hit) -> tuple[str, str]:
    return f"{hit.stream} {hit.frame}", f"{hit.view.side}  {hit.distance:.3f}"
