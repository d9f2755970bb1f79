"""A framebuffer with antialiasing.

Either with several samples per pixel (best, but slow in software OpenGL), or with one sample and a pass that
smooths edges in the finished picture.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fba.arrays import UInt8
from fba.errors import DisplayError
from fba_player.gl._antialias_region import Steps
from fba_player.gl._context import import_moderngl
from fba_player.gl._resources import load_program, make_buffer, write_buffer
from fba_player.gl._silhouette import TILE


class Target:
    """A framebuffer of a fixed size on a moderngl context.

    samples: samples per pixel; 0 for one sample and smoothed edges, see `smoothed`. `begin`, draw, then
    `finish` gives the framebuffer that holds the picture. Raises DisplayError if the driver cannot allocate
    it.
    """

    def __init__(self, context: Any, size: tuple[int, int], samples: int) -> None:
        self._gl = context
        self.size, self.samples = size, samples
        self._parts: list[Any] = []
        largest = min(context.info["GL_MAX_RENDERBUFFER_SIZE"], *context.info["GL_MAX_VIEWPORT_DIMS"])
        if max(size) > largest:
            raise DisplayError(
                f"this OpenGL driver draws at most {largest}x{largest} pixels, not {size[0]}x{size[1]}: "
                "choose a smaller size"
            )
        samples = min(samples, context.max_samples)
        try:
            self._allocate(samples)
        except (import_moderngl().Error, MemoryError) as error:
            self.close()
            raise DisplayError(
                f"OpenGL has no room for a picture of {size[0]}x{size[1]} pixels with {samples} samples "
                f"each ({error}): choose a smaller size"
            ) from error

    def _allocate(self, samples: int) -> None:
        gl, size = self._gl, self.size
        self._result = self._own(gl.framebuffer([self._own(gl.renderbuffer(size, 4))]))
        depth = self._own(gl.depth_renderbuffer(size, samples=samples))
        self._pass: Any = None
        self._tiles: Any = None
        self._along: Any = None
        if samples:
            colour = self._own(gl.renderbuffer(size, 4, samples=samples))
        else:
            colour = self._own(gl.texture(size, 4))
            colour.filter = (gl.LINEAR, gl.LINEAR)
            colour.repeat_x = colour.repeat_y = False
            self._program = self._own(load_program(gl, "smooth"))
            corners = self._own(make_buffer(gl, [-1, -1, 3, -1, -1, 3]))
            self._pass = self._own(gl.vertex_array(self._program, [(corners, "2f", "in_corner")]))
        self._colour = colour
        self._drawn = self._own(gl.framebuffer([colour], depth))

    def _own(self, part: Any) -> Any:
        """Return the OpenGL object, which `close` will release."""
        self._parts.append(part)
        return part

    @property
    def smoothed(self) -> bool:
        """Whether `finish` smooths edges, for lack of samples."""
        return self._pass is not None

    def begin(self) -> None:
        self._drawn.use()

    def finish(self, into: Any = None, within: Steps | None = None) -> Any:
        """Return the framebuffer with the finished picture: its own, or `into`.

        within: the regions to be smoothed; everywhere by default. `into` may be a window's framebuffer, whose
        size is taken to be that of this target, as moderngl does not notice that a window was resized.
        """
        if self._pass is None:
            self._gl.copy_framebuffer(self._result, self._drawn)
            if into is None:
                return self._result
            self._gl.copy_framebuffer(into, self._result)  # of another format, where samples cannot be copied
            return into
        result = self._result if into is None else into
        everything = (0, 0, *self.size)
        rectangles = [everything] if within is None else within.rectangles
        if everything not in rectangles:
            self._gl.copy_framebuffer(result, self._drawn)
        result.use()
        self._gl.viewport = everything
        self._gl.enable_only(self._gl.NOTHING)
        self._colour.use(0)
        for rectangle in rectangles:
            self._gl.scissor = rectangle
            self._pass.render()
        self._gl.scissor = None
        if within is not None and len(within.tiles) and everything not in rectangles:
            if self._tiles is None or self._tiles.size < within.tiles.nbytes:
                self._tiles = self._own(self._gl.buffer(reserve=2 * within.tiles.nbytes, dynamic=True))
                content = [(self._tiles, "2f", "in_corner")]
                self._along = self._own(self._gl.vertex_array(self._program, content))
            write_buffer(self._tiles, within.tiles)
            self._gl.point_size = TILE
            self._along.render(self._gl.POINTS, vertices=len(within.tiles))
        return result

    def close(self) -> None:
        for part in reversed(self._parts):
            part.release()
        self._parts.clear()


class Readback:
    """Copies framebuffers into a buffer of the card, to be fetched later.

    Reading a framebuffer at once waits until the card has drawn it, and leaves the card idle meanwhile.
    """

    def __init__(self, context: Any) -> None:
        self._gl = context
        self._buffer: Any = None

    def start(self, framebuffer: Any, size: tuple[int, int]) -> Callable[[], UInt8]:
        """Begin to read a framebuffer of a size in pixels; nothing waits for it.

        What is returned gives the pixels, uint8 (H, W, 4), top row first, and waits until they are there.
        Call it before the next `start`, which uses the same memory.
        """
        width, height = size
        count = width * height * 4
        if self._buffer is None or self._buffer.size != count:
            self.close()
            self._buffer = self._gl.buffer(reserve=count)
        framebuffer.read_into(self._buffer, (0, 0, width, height), components=4, alignment=1)
        buffer = self._buffer
        return lambda: np.frombuffer(buffer.read(), np.uint8).reshape(height, width, 4)[::-1]

    def close(self) -> None:
        """Free the buffer; safe to call twice."""
        if self._buffer is not None:
            self._buffer.release()
            self._buffer = None
