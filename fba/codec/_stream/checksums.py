"""CRC-32 checks of the I periods of a stream. They reveal flipped bits that leave the syntax correct.

An I period is an I plane with the planes up to the next I plane. Its bytes begin with the plane start code
before its I plane, or else with the byte in which that plane begins; those of the first period begin with the
object start code. They end before the next period. A byte in which the next period begins belongs to both.
The bytes of the last period end before the start code that ends the object.
"""

from __future__ import annotations

from array import array
from bisect import bisect_left
from zlib import crc32

from fba.arrays import UInt8

CHECK_BYTES = 4
_MAX_PERIODS = 1 << 18
"""Most periods that are checked: three days with an I plane every second."""


def check_of(crc: int) -> bytes:
    """Return a CRC-32 as it is written: most significant byte first, ff for 00 to avoid start codes."""
    return crc.to_bytes(CHECK_BYTES, "big").replace(b"\0", b"\xff")


class PeriodChecks:
    """Computes the checks of an object's I periods while its bytes come.

    byte: at which the object begins. checks: of the periods that have ended, four bytes each. starts: first
    byte of each. planes: for each, the number of its first plane, and that of the plane after its last.
    left_out: whether a period was abandoned. Positions are in the stream; `data` are its bytes from `offset`
    on.
    """

    def __init__(self, byte: int = 0) -> None:
        self.checks = bytearray()
        self.starts = array("q")
        self.planes = array("q")
        self._crc = 0
        self._start = self._next = byte  # first byte of the period, and the first that is not in `_crc`
        self._plane = 0  # its first
        self._open = False  # whether a period has begun
        self._fresh = True  # whether the first period begins where the object does
        self.left_out = False

    def __len__(self) -> int:
        return len(self.checks) // CHECK_BYTES

    @property
    def full(self) -> bool:
        """Whether there may be more periods than are checked."""
        return len(self) >= _MAX_PERIODS

    def add(self, data: UInt8, offset: int, stop: int) -> None:
        """Take the bytes up to `stop`, which belong to this period."""
        if stop > self._next and (self._open or self._fresh):
            self._crc = crc32(data[self._next - offset : stop - offset].tobytes(), self._crc)
            self._next = stop

    def begin_period(self, data: UInt8, offset: int, bit: int, plane: int) -> None:
        """End the period, and begin the next at this bit, with the plane of this number."""
        self.end(data, offset, (bit + 7) >> 3, plane)
        if not self._fresh:
            self._crc, self._start = 0, bit >> 3
            self._next = self._start
        self._plane, self._open, self._fresh = plane, True, False

    def end(self, data: UInt8, offset: int, stop: int, plane: int) -> None:
        """End the last period before the byte `stop` and the plane of this number."""
        if self._open and not self.full:
            self.add(data, offset, stop)
            self.checks += check_of(self._crc)
            self.starts.append(self._start)
            self.planes.extend((self._plane, plane))
        self._open = False

    def abandon(self) -> None:
        """Leave out the period that has begun, because it is damaged."""
        self._open = self._fresh = False
        self.left_out = True


def find_wrong(checks: bytes, listed: bytes) -> list[int]:
    """Return the numbers of the periods whose checks are not in the list, in its order."""
    places: dict[bytes, list[int]] = {}
    for place in range(len(listed) // CHECK_BYTES):
        places.setdefault(listed[CHECK_BYTES * place : CHECK_BYTES * (place + 1)], []).append(place)
    wrong, following = [], 0
    for number in range(len(checks) // CHECK_BYTES):
        same = places.get(checks[CHECK_BYTES * number : CHECK_BYTES * (number + 1)], [])
        place = bisect_left(same, following)
        if place < len(same):
            following = same[place] + 1
        else:
            wrong.append(number)
    return wrong
