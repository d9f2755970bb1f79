"""The layout of sheets of pictures: equal cells, row by row, and the colours around them."""

from __future__ import annotations

import math
from dataclasses import dataclass

TEXT = (232, 235, 240)
FAINT = (158, 165, 175)
PAPER = (34, 37, 43)
"""Colours of labels, of notes and between the pictures, sRGB."""
CELL_GAP = 4
"""Pixels between cells."""
MIN_TILE = 16
"""Least width and height of a picture in pixels."""
MAX_PIXELS = 200_000_000
"""Largest area of a sheet in pixels."""
SHEET_ASPECT = 16 / 10
"""Width / height that a sheet should have."""


@dataclass(frozen=True)
class SheetLayout:
    """The layout of a sheet in pixels: its size (width, height) and the upper left corner of each cell."""

    size: tuple[int, int]
    corners: tuple[tuple[int, int], ...]


def lay_out(
    count: int, cell: tuple[int, int], columns: int | None = None, *, space: int = CELL_GAP, top: int = 0
) -> SheetLayout:
    """Return the layout of a sheet of equal cells, row by row.

    count: number of cells. cell: width and height of each, with its labels, in pixels. columns: by default as
    many as make the sheet a little wider than high. space: pixels around each cell. top: pixels above the
    first row.

    Raises ValueError if the sheet would have more than `MAX_PIXELS`.
    """
    step = (cell[0] + space, cell[1] + space)
    columns = columns or choose_columns(count, step)
    size = (columns * step[0] + space, top + -(-count // columns) * step[1] + space)
    if size[0] * size[1] > MAX_PIXELS:
        raise ValueError(
            f"{count} pictures make a sheet of {size[0]}x{size[1]} pixels, too large to be one: "
            "choose fewer, or a smaller size"
        )
    corners = tuple(
        (space + number % columns * step[0], top + space + number // columns * step[1])
        for number in range(count)
    )
    return SheetLayout(size, corners)


def choose_columns(count: int, step: tuple[int, int]) -> int:
    """Return the number of columns for a sheet a little wider than high with few empty cells.

    step: width and height of a cell with the space to the next, in pixels.
    """
    ideal = math.sqrt(count * SHEET_ASPECT * step[1] / step[0])
    candidates = range(max(math.floor(ideal * 0.8), 1), min(math.ceil(ideal * 1.3), count) + 1)
    return min(candidates or (count,), key=lambda columns: (-count % columns / count, abs(columns - ideal)))


def check_tile(size: tuple[int, int]) -> None:
    """Raise ValueError if the pictures of a sheet would be too small. size: width and height in pixels."""
    if min(size) < MIN_TILE:
        raise ValueError(f"each picture of a sheet needs at least 16x16 pixels, not {size[0]}x{size[1]}")
