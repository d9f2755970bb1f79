"""Makes an input that fails smaller, as long as it fails in the same way."""

from __future__ import annotations

import time
from collections.abc import Callable


def minimise(data: bytes, fails: Callable[[bytes], bool], seconds: float) -> bytes:
    """Return a smaller input for which `fails` holds, found within this number of seconds.

    Removes pieces, from half of the input down to single bytes, until no piece can be removed.
    """
    end = time.monotonic() + seconds
    size = max(1, len(data) // 2)
    while True:
        shorter = _without_pieces(data, fails, size, end)
        if time.monotonic() > end or (size == 1 and shorter == data):
            return shorter
        data, size = shorter, max(1, min(size, len(shorter)) // 2)


def _without_pieces(data: bytes, fails: Callable[[bytes], bool], size: int, end: float) -> bytes:
    """Remove every piece of this size that can be removed."""
    position = 0
    while position < len(data) and time.monotonic() < end:
        shorter = data[:position] + data[position + size :]
        if fails(shorter):
            data = shorter
        else:
            position += size
    return data
