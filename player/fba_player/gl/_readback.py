"""Reads pictures back from the graphics card while it goes on drawing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fba.arrays import UInt8


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
