"""Pictures on parts of faces, as the graphics card gets them: in the size in which they are seen.

Software OpenGL spends more time on choosing between the sizes of a texture, pixel by pixel, than on all
else: here one size is chosen for a whole part.
"""

from __future__ import annotations

import math
from typing import Any

from fba.arrays import Float32
from fba_player.mesh.textures import texture_breadth
from fba_player.view.view import FaceShape

SHARPEST = 0.8
"""Pixels of the screen that a texel is wide, at least."""
SMALLEST = 16


class Pictures:
    """The textures of one shape on a moderngl context, made on first use.

    positions: float32 (V, 3), of the shape in any pose: they say how wide its picture lies.
    """

    def __init__(self, context: Any, shape: FaceShape, positions: Float32) -> None:
        self._gl = context
        self._picture = shape.picture
        self._sizes: dict[int, Any] = {}
        self._breadth = 0.0
        if shape.picture is not None and shape.texcoords is not None:
            self._breadth = texture_breadth(positions, shape.texcoords, shape.triangles)

    def suited(self, pixel: float) -> Any:
        """The texture for a screen whose pixels are so wide where the part is (m), or None without one."""
        if self._picture is None:
            return None
        halvings = halved(self._breadth / max(self._picture.size), pixel, max(self._picture.size))
        if halvings not in self._sizes:
            pixels = self._picture.seen(2**halvings)
            height, width = pixels.shape[:2]
            texture = self._gl.texture((width, height), 4, pixels.tobytes())
            texture.filter = (self._gl.LINEAR, self._gl.LINEAR)
            self._sizes[halvings] = texture
        return self._sizes[halvings]

    def close(self) -> None:
        """Free everything allocated on the graphics card."""
        for texture in self._sizes.values():
            texture.release()
        self._sizes.clear()


def halved(texel: float, pixel: float, size: int) -> int:
    """How often to halve a picture of `size` texels of this width (m), for texels of about a pixel."""
    if not texel > 0 or not pixel > 0:
        return 0
    ratio = SHARPEST * pixel / texel
    if not ratio > 1:
        return 0
    most = int(math.log2(max(size / SMALLEST, 1)))
    return min(math.ceil(math.log2(ratio)), most) if ratio < math.inf else most
