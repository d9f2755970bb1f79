"""Read and write header bits, most significant bit first."""

from __future__ import annotations

import numpy as np

from fba.arrays import UInt8


class OutOfDataError(Exception):
    """An element that extends beyond the end of the data; never raised to users of the codec."""


class BitReader:
    """Reads `data` from position `bit` up to `end`, both in bits."""

    def __init__(self, data: UInt8, bit: int, end: int) -> None:
        self.data = data
        self.bit = bit
        self.end = end

    def read(self, count: int) -> int:
        """Return the next `count` bits as an unsigned number. Raises `OutOfDataError`."""
        start, stop = self.bit, self.bit + count
        if stop > self.end:
            raise OutOfDataError
        self.bit = stop
        first, last = start >> 3, (stop + 7) >> 3
        number = int.from_bytes(self.data[first:last].tobytes(), "big")
        return (number >> (8 * last - stop)) & ((1 << count) - 1)


class BitWriter:
    """Writes into `data`, a buffer that grows; `bit` is the position after the last bit written."""

    def __init__(self) -> None:
        self.data = np.zeros(4096, dtype=np.uint8)
        self.bit = 0

    def reserve(self, bits: int) -> None:
        """Make room for that many more bits, zeroed."""
        need = (self.bit + bits + 7) // 8 + 8
        if need > len(self.data):
            grown = np.zeros(max(need, 2 * len(self.data)), dtype=np.uint8)
            grown[: len(self.data)] = self.data
            self.data = grown

    def write(self, value: int, count: int) -> None:
        """Append the low `count` bits of `value`."""
        if not 0 <= value < 1 << count:
            raise ValueError(f"{value} does not fit {count} bits")
        self.reserve(count)
        first, last = self.bit >> 3, (self.bit + count + 7) >> 3
        shifted = value << (8 * last - self.bit - count)
        self.data[first:last] |= np.frombuffer(shifted.to_bytes(last - first, "big"), dtype=np.uint8)
        self.bit += count

    def copy(self) -> BitWriter:
        """Return an independent writer that continues here."""
        other = BitWriter()
        other.data, other.bit = self.data.copy(), self.bit
        return other

    def align(self) -> None:
        """Write stuffing up to the byte boundary: a 0, then 1s; a whole byte if already aligned."""
        count = 8 - (self.bit & 7)
        self.write((1 << (count - 1)) - 1, count)

    def take_bytes(self, stop: int) -> bytes:
        """Return the complete bytes before bit `stop`, and drop them."""
        count = stop >> 3
        used = (self.bit + 7) >> 3
        taken = self.data[:count].tobytes()
        rest = self.data[count:used].copy()
        self.data[:used] = 0
        self.data[: len(rest)] = rest
        self.bit -= 8 * count
        return taken
