"""`RtpReader` and `DatagramReader`: packets that arrive, put in order, to an FBA stream without errors."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Hashable, Iterator
from fractions import Fraction
from typing import NamedTuple

from fba.carriage._joining import StreamJoiner
from fba.carriage.payloads import SIZE_TABLE, PayloadKind, PayloadReader, SizeTable, split_start_codes
from fba.carriage.rtp import CLOCK_RATE, PAYLOAD_TYPE, Counts, RtpPacket, read_packet
from fba.errors import FormatError
from fba.parameters import BapTable

SILENCE = 1.0
"""Seconds without a packet after which another sender may take the place of the first."""
DELAY = 0.1
"""Seconds that packets wait for an earlier one, by default."""
_OF_ORDER = ("lost", "late", "doubled", "reordered")
"""Counts that a `PacketOrder` has."""
_NUMBERS, _TICKS = 1 << 16, 1 << 32


class PacketReader(ABC):
    """Makes a stream of packets. counts: what came."""

    counts: Counts
    _joiner: StreamJoiner

    @property
    def table(self) -> BapTable | None:
        """The table of BAP steps that the headers of the stream name, once it has begun."""
        return self._joiner.table

    @property
    def ended(self) -> bool:
        """Whether the end of the stream came."""
        return self._joiner.ended

    @property
    def holding(self) -> bool:
        """Whether the pose is held, since planes are missing."""
        return self._joiner.holding

    @property
    def due(self) -> float | None:
        """Time at which `settle` has something to return, if no packet comes before; None without."""
        return None

    @abstractmethod
    def receive(self, data: bytes, sender: Hashable, now: float) -> list[bytes]:
        """Return the parts of the stream, a plane each, that a packet completes; it came now."""

    @abstractmethod
    def settle(self, now: float) -> list[bytes]:
        """Return the parts of the stream that wait no longer for packets before them."""


class _Sender(NamedTuple):
    """A sender, and the number that its next packet has."""

    address: Hashable
    ssrc: int
    following: int


class RtpReader(PacketReader):
    """Makes a stream of RTP packets.

    payload_type: all others are left out. kind, table: see `PayloadReader`. configuration: headers, from a
    description of the session; needed where the sender does not repeat them. delay: seconds that a packet
    waits for one before it.

    The first sender whose packets hold planes is followed: its address and its SSRC. Another takes its place
    after two packets in a row, if it has the same address, or if the first has been silent for `SILENCE`.
    """

    def __init__(
        self,
        *,
        payload_type: int = PAYLOAD_TYPE,
        kind: PayloadKind | None = None,
        table: SizeTable = SIZE_TABLE,
        configuration: bytes = b"",
        delay: float = DELAY,
    ) -> None:
        self.counts = Counts()
        self._payload_type = payload_type
        self._kind = kind
        self._size_table = table
        self._delay = delay
        self._joiner = StreamJoiner(configuration)
        self._sender: _Sender | None = None
        self._candidate: _Sender | None = None
        self._first: RtpPacket | None = None  # of the candidate
        self._heard = 0.0
        self._done = Counts()  # of the senders before
        self._order = PacketOrder(delay)
        self._payloads = PayloadReader(kind, table)
        self._ticks: int | None = None  # of the last packet, beyond 32 bits
        self._base = Fraction(0)  # seconds at tick 0

    @property
    def due(self) -> float | None:
        """See `PacketReader`."""
        return self._order.due

    def receive(self, data: bytes, sender: Hashable, now: float) -> list[bytes]:
        """See `PacketReader`. sender: its address."""
        self.counts.packets += 1
        self.counts.bytes += len(data)
        try:
            packet = read_packet(data)
            if packet.payload_type != self._payload_type:
                raise FormatError(f"of payload type {packet.payload_type}, not {self._payload_type}")
            if self._sender is None:
                PayloadReader(self._kind, self._size_table).push(packet.payload, marker=True)
        except FormatError as error:
            self.counts.refuse(str(error))
            return []
        if not self._follows(packet, sender, now):
            self.counts.other_senders += 1
            return []
        self._heard = now
        self._order.push(packet, now)
        return self.settle(now)

    def settle(self, now: float) -> list[bytes]:
        """See `PacketReader`."""
        parts = [part for packet, lost in self._order.take(now) for part in self._read(packet, lost)]
        for name in _OF_ORDER:
            setattr(self.counts, name, getattr(self._done, name) + getattr(self._order, name))
        self._joiner.fill_in(self.counts)
        return parts

    def _follows(self, packet: RtpPacket, address: Hashable, now: float) -> bool:
        """Whether a packet is of the sender that is followed, which changes if need be."""
        this = _Sender(address, packet.ssrc, (packet.sequence + 1) % _NUMBERS)
        if self._sender is not None and this[:2] == self._sender[:2]:
            ahead = (packet.sequence - self._sender.following) % _NUMBERS
            if ahead < _NUMBERS // 8 or ahead > _NUMBERS - _NUMBERS // 8:
                if ahead < _NUMBERS // 2:
                    self._sender = this
                return True
        elif self._sender is not None and address != self._sender.address and now - self._heard < SILENCE:
            return False
        expected = self._candidate is not None and self._candidate == (address, packet.ssrc, packet.sequence)
        if self._sender is not None and not expected:
            self._candidate, self._first = this, packet
            return False
        if self._sender is not None and self._first is not None:
            self._begin_anew(now)
            self._order.push(self._first, now)
            self.counts.other_senders -= 1
        self._sender, self._candidate = this, None
        self.counts.senders += 1
        return True

    def _begin_anew(self, now: float) -> None:
        """Let another sender follow; the seconds between them are those of our clock."""
        for name in _OF_ORDER:
            setattr(self._done, name, getattr(self.counts, name))
        self._base = self._time() + Fraction(max(now - self._heard, 0.0))
        self._ticks = None
        self._order = PacketOrder(self._delay)
        self._payloads = PayloadReader(self._kind, self._size_table)
        self._joiner.begin_anew()

    def _time(self) -> Fraction:
        """Return the seconds of the last packet."""
        return self._base + Fraction(self._ticks or 0, CLOCK_RATE)

    def _read(self, packet: RtpPacket, lost: int) -> Iterator[bytes]:
        if self._ticks is None:
            self._ticks = packet.timestamp
            self._base -= Fraction(packet.timestamp, CLOCK_RATE)
        else:
            self._ticks += (packet.timestamp - self._ticks + _TICKS // 2) % _TICKS - _TICKS // 2
        if lost:
            self._payloads.lose()
            self._joiner.lose()
        try:
            units = self._payloads.push(packet.payload, marker=packet.marker)
        except FormatError as error:
            self.counts.refuse(str(error))
            self._joiner.lose()
            return
        for number, unit in enumerate(units):
            part = self._joiner.add(unit, None if number else self._time())
            if part:
                yield part


class DatagramReader(PacketReader):
    """Makes a stream of datagrams without RTP: each holds whole planes, with their start codes.

    They have neither numbers nor times: a lost one is not noticed. The first sender is followed; another
    takes its place if the first has been silent for `SILENCE`.
    """

    def __init__(self) -> None:
        self.counts = Counts()
        self._joiner = StreamJoiner()
        self._sender: Hashable = None
        self._heard = 0.0

    def receive(self, data: bytes, sender: Hashable, now: float) -> list[bytes]:
        """See `PacketReader`."""
        counts, joiner = self.counts, self._joiner
        counts.packets += 1
        counts.bytes += len(data)
        try:
            if not data.startswith(b"\0\0\1"):
                raise FormatError("without a start code")
            units = split_start_codes(data)
        except FormatError as error:
            counts.refuse(str(error))
            return []
        if sender != self._sender:
            if counts.senders and now - self._heard < SILENCE:
                counts.other_senders += 1
                return []
            if counts.senders:
                joiner.begin_anew()
            counts.senders += 1
            self._sender = sender
        self._heard = now
        parts = [part for unit in units if (part := joiner.add(unit, None))]
        joiner.fill_in(counts)
        return parts

    def settle(self, now: float) -> list[bytes]:
        """See `PacketReader`."""
        return []


MOST_WAITING = 512
"""Packets that wait for an earlier one."""
REMEMBERED = 512
"""Packets that are recognised as doubled when they come again."""


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
