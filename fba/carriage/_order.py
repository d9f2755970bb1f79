"""`PacketOrder`: the packets of a sender in the order of their sequence numbers."""

from __future__ import annotations

from collections import deque

from fba.carriage.rtp import RtpPacket

MOST_WAITING = 512
"""Packets that wait for an earlier one."""
REMEMBERED = 512
"""Packets that are recognised as doubled when they come again."""
_NUMBERS = 1 << 16


class PacketOrder:
    """Puts packets in order: a packet passes at once if all before it did; if one is missing, after `delay`.

    delay: seconds. All times are of one monotonic clock. Counts of packets: lost; late, too late to be used;
    doubled, that came twice; reordered, after a later one.
    """

    def __init__(self, delay: float) -> None:
        self.lost = self.late = self.doubled = self.reordered = 0
        self._delay = delay
        self._next: int | None = None  # number of the next packet, which goes on beyond 16 bits
        self._newest = 0
        self._waiting: dict[int, tuple[RtpPacket, float]] = {}  # by number, in the order in which they came
        self._passed: deque[int] = deque(maxlen=REMEMBERED)

    @property
    def due(self) -> float | None:
        """Time at which `take` has something to return, if nothing comes before; None without."""
        return next(iter(self._waiting.values()))[1] + self._delay if self._waiting else None

    def push(self, packet: RtpPacket, now: float) -> None:
        """Add a packet that came now."""
        if self._next is None:
            self._next = self._newest = packet.sequence + _NUMBERS
        number = self._next + (packet.sequence - self._next + _NUMBERS // 2) % _NUMBERS - _NUMBERS // 2
        if number in self._waiting or number in self._passed:
            self.doubled += 1
        elif number < self._next:
            self.late += 1
        else:
            self.reordered += number < self._newest
            self._newest = max(self._newest, number)
            self._waiting[number] = packet, now

    def take(self, now: float) -> list[tuple[RtpPacket, int]]:
        """Return the packets that are in order by now, each with the number of those lost before it."""
        ready = []
        while self._waiting and self._next is not None:
            due = self.due
            assert due is not None
            lost = 0
            if self._next not in self._waiting:
                if now < due and len(self._waiting) <= MOST_WAITING:
                    break
                number = min(self._waiting)
                lost, self._next = number - self._next, number
            self.lost += lost
            ready.append((self._waiting.pop(self._next)[0], lost))
            self._passed.append(self._next)
            self._next += 1
        return ready
