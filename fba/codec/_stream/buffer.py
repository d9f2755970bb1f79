"""Buffer of bytes that are added at the end and dropped at the front, as a NumPy array for compiled code."""

from __future__ import annotations

import numpy as np

from fba.arrays import UInt8

_MIN_BYTES = 4096
"""Smallest size of the buffer, and least number of bytes to drop: moving fewer is not worthwhile."""


class Buffer:
    """Bytes of a stream: `data[:length]`, after `offset` bytes that were dropped."""

    def __init__(self) -> None:
        self.length = 0
        self.offset = 0
        self._allocate(_MIN_BYTES)

    @property
    def data(self) -> UInt8:
        """The bytes, as an array that compiled code can read without a copy."""
        return np.frombuffer(self._bytes, dtype=np.uint8)

    def append(self, chunk: bytes | bytearray | memoryview) -> None:
        """Append bytes at the end."""
        new = np.frombuffer(chunk, dtype=np.uint8)
        need = self.length + len(new)
        if need > len(self._bytes):
            old = self.data[: self.length]
            self._allocate(max(need, 2 * len(self._bytes)))
            self.data[: self.length] = old
        self.data[self.length : need] = new
        self.length = need

    def can_drop(self, count: int) -> bool:
        """Return whether `drop` drops this number of bytes: not if moving the rest costs too much."""
        return count >= _MIN_BYTES and 2 * count >= self.length

    def drop(self, count: int) -> int:
        """Drop `count` bytes at the front, or none (see `can_drop`); return the number dropped."""
        if not self.can_drop(count):
            return 0
        rest = self.data[count : self.length]
        self._allocate(max(2 * len(rest), _MIN_BYTES))
        self.data[: len(rest)] = rest
        self.length = len(rest)
        self.offset += count
        return count

    def find_start_code(self, start: int) -> tuple[int, int] | None:
        """Return position and last byte of the first 00 00 01 xx from byte `start` on, or None."""
        position = self._bytes.find(b"\x00\x00\x01", start, self.length)
        if position < 0 or position + 3 >= self.length:
            return None
        return position, self._bytes[position + 3]

    def _allocate(self, size: int) -> None:
        self._bytes = bytearray(size)
