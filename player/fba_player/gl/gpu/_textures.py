"""Tables of numbers as textures on the graphics card, 1024 rows side by side."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from fba.errors import UnsupportedError

WIDE = 1024
"""As in shaders/gpu_tables.glsl; every OpenGL 3.3 has textures so wide."""


class Table:
    """A texture of N rows of 1 to 4 numbers, float32 or int32, that shaders read by row.

    Raises UnsupportedError where there are more than a texture has room for.
    """

    def __init__(self, context: Any, rows: npt.NDArray[Any]) -> None:
        count, components = rows.shape
        self._kind = "i4" if rows.dtype.kind in "iu" else "f4"
        size = grid(context, count)
        self._room = np.zeros((size[0] * size[1], components), dtype=self._kind)
        self._room[:count] = rows
        self._filled = count
        self.texture = context.texture(size, components, self._room.tobytes(), dtype=self._kind, alignment=4)
        self.texture.filter = (context.NEAREST, context.NEAREST)

    def write(self, *rows: npt.NDArray[Any]) -> None:
        """Other numbers, in as many rows all together."""
        start = 0
        for part in rows:
            self._room[start : start + len(part)] = part
            start += len(part)
        self.texture.write(self._room, alignment=4)

    def release(self) -> None:
        """Give it back."""
        self.texture.release()


def grid(context: Any, count: int) -> tuple[int, int]:
    """Width and height of the texture that holds so many rows."""
    high = max(-(-count // WIDE), 1)
    if high > context.info["GL_MAX_TEXTURE_SIZE"]:
        raise UnsupportedError(f"a table of {count} rows in a texture on this graphics card")
    return (min(max(count, 1), WIDE), high)
