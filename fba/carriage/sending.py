"""`RtpWriter` and `DatagramWriter`: planes to packets."""

from __future__ import annotations

from typing import Protocol

from fba.carriage.payloads import (
    END_CODE,
    MOST_UNIT_BYTES,
    PayloadKind,
    Unit,
    full_configuration,
    write_size_table,
    write_start_codes,
)
from fba.carriage.rtp import CLOCK_RATE, PAYLOAD_TYPE, RtpPacket, write_packet
from fba.errors import FormatError
from fba.serving import Plane

MOST_PAYLOAD = 1400
"""Bytes of a payload, for which every network has room; a longer plane is spread over packets."""
MOST_PLANES = 100
"""Planes in a packet."""
END_COPIES = 3
"""Packets that say that the stream has ended, where any may be lost."""


_TABLE_BYTES = 5
"""Bytes before a single plane by RFC 3640: the length of its AU header, 16 bits, and the header, 17."""


class PacketWriter(Protocol):
    """Makes packets of planes."""

    def push(self, plane: Plane, time: float) -> list[bytes]:
        """Return the packets that a plane completes. time: at which it is shown, in seconds; it grows."""

    def finish(self) -> list[bytes]:
        """Return the last packets, and those that end the stream."""


def units_of(plane: Plane) -> list[Unit]:
    """Return the units of a plane. Raises FormatError for one that no payload has room for."""
    if any(len(unit) > MOST_UNIT_BYTES - 100 for unit in plane.units):
        raise FormatError(f"a plane is longer than {MOST_UNIT_BYTES - 100} bytes, and cannot be sent")
    joinable = bool(plane.opening)
    configuration = full_configuration(plane.configuration) if joinable else b""
    first, *others = plane.units
    return [Unit(first, configuration, joinable), *(Unit(other, b"", False) for other in others)]


class RtpWriter:
    """Makes RTP packets of planes.

    kind: "3640" or "6416", the RFC of the payload. planes_per_packet: all but the last of them wait for it. A
    plane at which decoding may begin also begins a packet. ssrc, sequence, timestamp: of the first packet;
    they should be random. end_copies: packets that say that the stream has ended.
    """

    def __init__(
        self,
        *,
        kind: PayloadKind = "3640",
        planes_per_packet: int = 1,
        payload_type: int = PAYLOAD_TYPE,
        ssrc: int,
        sequence: int,
        timestamp: int,
        end_copies: int = END_COPIES,
    ) -> None:
        if not 1 <= planes_per_packet <= MOST_PLANES:
            raise ValueError(f"planes_per_packet must be 1 to {MOST_PLANES}, not {planes_per_packet}")
        self._write = write_size_table if kind == "3640" else write_start_codes
        self._most = planes_per_packet
        self._first = RtpPacket(payload_type, sequence, timestamp, ssrc, True, b"")
        self._end_copies = end_copies
        self._sent = 0
        self._waiting: list[Unit] = []
        self._time = 0.0  # of the first of them

    def push(self, plane: Plane, time: float) -> list[bytes]:
        """See `PacketWriter`."""
        packets: list[bytes] = []
        for number, unit in enumerate(units_of(plane)):
            full = len(self._write([*self._waiting, unit])) > MOST_PAYLOAD
            if self._waiting and (unit.configuration or full):
                packets += self._flush()
            if not self._waiting:
                self._time = time + number / plane.rate
            self._waiting.append(unit)
            if len(self._waiting) >= self._most:
                packets += self._flush()
        return packets

    def finish(self) -> list[bytes]:
        """See `PacketWriter`."""
        packets = self._flush() if self._waiting else []
        return packets + [self._packet(self._write([Unit(b"")])) for _ in range(self._end_copies)]

    def _flush(self) -> list[bytes]:
        payload = self._write(self._waiting)
        self._waiting = []
        if len(payload) <= MOST_PAYLOAD:
            return [self._packet(payload)]
        table = _TABLE_BYTES if self._write is write_size_table else 0
        header = payload[:table]  # of a single plane: the same in all parts
        content, size = payload[len(header) :], MOST_PAYLOAD - len(header)
        parts = [content[begin : begin + size] for begin in range(0, len(content), size)]
        return [
            self._packet(header + part, last=number == len(parts)) for number, part in enumerate(parts, 1)
        ]

    def _packet(self, payload: bytes, *, last: bool = True) -> bytes:
        first = self._first
        packet = first._replace(
            sequence=(first.sequence + self._sent) % (1 << 16),
            timestamp=(first.timestamp + round(self._time * CLOCK_RATE)) % (1 << 32),
            marker=last,
            payload=payload,
        )
        self._sent += 1
        return write_packet(packet)


class DatagramWriter:
    """Makes datagrams of planes, without RTP: bytes of a stream with a start code before each plane."""

    def __init__(self, planes_per_packet: int = 1) -> None:
        self._most = planes_per_packet
        self._waiting = b""
        self._planes = 0

    def push(self, plane: Plane, time: float) -> list[bytes]:
        """See `PacketWriter`."""
        content = write_start_codes(units_of(plane))
        packets: list[bytes] = []
        if self._waiting and (plane.opening or len(self._waiting) + len(content) > MOST_PAYLOAD):
            packets += self._flush()
        self._waiting += content
        self._planes += 1
        return packets + self._flush() if self._planes >= self._most else packets

    def finish(self) -> list[bytes]:
        """See `PacketWriter`."""
        return [*(self._flush() if self._waiting else []), *[END_CODE] * END_COPIES]

    def _flush(self) -> list[bytes]:
        content, self._waiting, self._planes = self._waiting, b"", 0
        return [content]
