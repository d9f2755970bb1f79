"""Textures of parts of faces in OpenGL, at the size in which they are seen.

Software OpenGL spends more time on choosing a mipmap level for every pixel than on everything else: here one
size is chosen for a whole part.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fba.arrays import Float32, UInt8
from fba_player._mesh.textures import texture_breadth
from fba_player.gl._resources import make_texture
from fba_player.view._view import FaceShape

MIN_TEXEL = 0.8
"""Least width of a texel, in pixels of the screen."""
MIN_LEVEL_SIZE = 16
"""Least width in texels of a reduced picture."""


class Pictures:
    """The textures of one shape on a moderngl context, created on first use.

    positions: float32 (V, 3), of the shape in any pose, which give the size of a texel.
    """

    def __init__(self, context: Any, shape: FaceShape, positions: Float32) -> None:
        self._gl = context
        self._picture = shape.picture
        self._solid = shape.alpha == "opaque"
        self._sizes: dict[int, Any] = {}
        self._breadth = 0.0
        if shape.picture is not None and shape.texcoords is not None:
            self._breadth = texture_breadth(positions, shape.texcoords, shape.triangles)

    def choose(self, pixel: float) -> Any:
        """Return the texture for pixels of this width (m) on the part; None if it has no picture."""
        if self._picture is None:
            return None
        halvings = count_halvings(self._breadth / max(self._picture.size), pixel, max(self._picture.size))
        if halvings not in self._sizes:
            pixels = self._picture.reduced(2**halvings)
            if not (self._solid or self._picture.opaque):
                pixels = _weigh_by_alpha(pixels)
            self._sizes[halvings] = make_texture(self._gl, pixels)
        return self._sizes[halvings]

    def close(self) -> None:
        for texture in self._sizes.values():
            texture.release()
        self._sizes.clear()


def _weigh_by_alpha(pixels: UInt8) -> UInt8:
    """Return pixels (H, W, 4) with colours times alpha, so that those of holes do not colour their edges."""
    result = pixels.copy()
    for rows in result:  # one at a time, which needs little memory
        rows[:, :3] = (rows[:, :3].astype(np.uint16) * rows[:, 3:] + 127) // 255
    return result


def count_halvings(texel: float, pixel: float, size: int) -> int:
    """Return how often to halve a picture of `size` texels, so that texels are about a pixel wide.

    texel, pixel: their widths in metres.
    """
    if not texel > 0 or not pixel > 0:
        return 0
    ratio = MIN_TEXEL * pixel / texel
    if not ratio > 1:
        return 0
    most = int(math.log2(max(size / MIN_LEVEL_SIZE, 1)))
    return min(math.ceil(math.log2(ratio)), most) if ratio < math.inf else most
