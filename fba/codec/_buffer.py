"""Bytes that arrive in chunks and leave at the front, as one NumPy array that compiled code can read."""

from __future__ import annotations

import numpy as np

from fba.arrays import UInt8

_SMALLEST = 4096


class Buffer:
    """`data[:length]` holds what is here; `offset` bytes went before it."""

    def __init__(self) -> None:
        self.length = 0
        self.offset = 0
        self._allocate(_SMALLEST)

    def append(self, chunk: bytes | bytearray | memoryview) -> None:
        new = np.frombuffer(chunk, dtype=np.uint8)
        need = self.length + len(new)
        if need > len(self.data):
            held = self.data[: self.length]
            self._allocate(max(need, 2 * len(self.data)))
            self.data[: self.length] = held
        self.data[self.length : need] = new
        self.length = need

    def drop(self, count: int) -> int:
        """Let go of bytes at the front where that is worth the move; how many went."""
        if count < _SMALLEST or 2 * count < self.length:
            return 0
        kept = self.data[count : self.length]
        self._allocate(max(2 * len(kept), _SMALLEST))
        self.data[: len(kept)] = kept
        self.length = len(kept)
        self.offset += count
        return count

    def find_start_code(self, start: int) -> tuple[int, int] | None:
        """First 00 00 01 xx at or after byte `start`: (its position, xx), or None where there is none."""
        at = self._bytes.find(b"\x00\x00\x01", start, self.length)
        if at < 0 or at + 3 >= self.length:
            return None
        return at, self._bytes[at + 3]

    def _allocate(self, size: int) -> None:
        self._bytes = bytearray(size)  # searched; `data` is a view of it that compiled code can read
        self.data: UInt8 = np.frombuffer(self._bytes, dtype=np.uint8)
