"""RTP packets (RFC 3550, 5.1), their frames on connections (RFC 4571), and `Counts` of what came."""

from __future__ import annotations

import struct
from collections import Counter
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from fba.errors import FormatError

CLOCK_RATE = 90_000
"""Ticks of a timestamp in a second, for both payload formats."""
PAYLOAD_TYPE = 96
"""The first dynamic payload type."""
HEADER_BYTES = 12
_HEADER = struct.Struct(">BBHII")
_VERSION = 2
_CONTROL = range(192, 224)
"""Second bytes of RTCP packets (RFC 5761, 4)."""


class RtpPacket(NamedTuple):
    """An RTP packet. sequence: 16 bits. timestamp, ssrc: 32 bits."""

    payload_type: int
    sequence: int
    timestamp: int
    ssrc: int
    marker: bool
    payload: bytes


def write_packet(packet: RtpPacket) -> bytes:
    """Return a packet without padding, extension and contributing sources."""
    second = packet.marker << 7 | packet.payload_type
    return (
        _HEADER.pack(_VERSION << 6, second, packet.sequence, packet.timestamp, packet.ssrc) + packet.payload
    )


def read_packet(data: bytes) -> RtpPacket:
    """Return a packet; padding, extension and contributing sources are left out. Raises FormatError."""
    if len(data) < HEADER_BYTES:
        raise FormatError("shorter than an RTP header")
    first, second, sequence, timestamp, ssrc = _HEADER.unpack_from(data)
    if first >> 6 != _VERSION:
        raise FormatError("not of RTP version 2")
    if second in _CONTROL:
        raise FormatError("of RTCP, which is not used")
    begin, end = HEADER_BYTES + 4 * (first & 15), len(data)
    if first & 0x10:
        if begin + 4 > end:
            raise FormatError("with a header beyond their end")
        begin += 4 + 4 * int.from_bytes(data[begin + 2 : begin + 4], "big")
    if first & 0x20:
        if not data[-1]:
            raise FormatError("with a padding of 0 bytes")
        end -= data[-1]
    if begin > end:
        raise FormatError("with a header or a padding beyond their end")
    return RtpPacket(second & 127, sequence, timestamp, ssrc, second > 127, data[begin:end])


def write_frame(packet: bytes) -> bytes:
    """Return a packet for a connection: its length in 16 bits before it. Raises ValueError if too long."""
    return len(packet).to_bytes(2, "big", signed=False) + packet


class FrameReader:
    """Splits the bytes of a connection into packets."""

    def __init__(self) -> None:
        self._data = bytearray()

    def push(self, data: bytes) -> list[bytes]:
        """Add bytes; return the packets that they complete."""
        self._data += data
        packets = []
        begin = 0
        while begin + 2 <= len(self._data):
            end = begin + 2 + int.from_bytes(self._data[begin : begin + 2], "big")
            if end > len(self._data):
                break
            packets.append(bytes(self._data[begin + 2 : end]))
            begin = end
        del self._data[:begin]
        return packets


MOST_REASONS = 20
"""Reasons that are counted separately; others are counted together."""


@dataclass
class Counts:
    """Counts of packets and planes.

    packets, bytes: that came. refused: packets that do not belong to this stream, by reason. other_senders:
    packets of other senders than the first. lost, late, doubled, reordered: packets, by their numbers.
    senders: that followed each other. planes: passed on. held: planes that came behind a loss and were left
    out. damaged: planes that could not be decoded, left out. gaps: times that the pose was held because
    planes were missing. longest_gap: seconds. slipped: seconds that the stream is shorter by, since no time
    code could say how long the pose was held. seconds: of the stream.
    """

    packets: int = 0
    bytes: int = 0
    refused: Counter[str] = field(default_factory=Counter)
    other_senders: int = 0
    lost: int = 0
    late: int = 0
    doubled: int = 0
    reordered: int = 0
    senders: int = 0
    planes: int = 0
    held: int = 0
    damaged: int = 0
    gaps: int = 0
    longest_gap: float = 0.0
    slipped: float = 0.0
    seconds: float = 0.0

    def refuse(self, reason: str) -> None:
        """Count a packet that is left out."""
        named = reason in self.refused or len(self.refused) < MOST_REASONS
        self.refused[reason if named else "for other reasons"] += 1

    def lines(self) -> list[str]:
        """Return the counts as lines of text."""
        lines = [f"{self.packets} packets, {self.planes} planes"]
        named = (
            (self.lost, "lost"), (self.late, "too late"), (self.doubled, "doubled"),
            (self.reordered, "out of order, put in order"),
        )  # fmt: skip
        if any(count for count, _ in named):
            lines.append("packets: " + ", ".join(f"{count} {what}" for count, what in named if count))
        if self.gaps:
            times = "once" if self.gaps == 1 else f"{self.gaps} times"
            longest = f", for {self.longest_gap:.2f} s at most" if self.longest_gap else ""
            lines.append(f"the pose was held {times}, until the next I plane{longest}")
        if self.held or self.damaged:
            left = (self.held, "that depend on others that were lost"), (self.damaged, "that were damaged")
            lines.append("planes left out: " + ", ".join(f"{count} {what}" for count, what in left if count))
        if self.slipped:
            lines.append(f"the stream is {self.slipped:.2f} s shorter than what was sent")
        if self.senders > 1:
            lines.append(f"{self.senders} senders followed each other")
        if self.other_senders:
            lines.append(f"of other senders, left out: {self.other_senders} packets")
        if self.refused:
            reasons = ", ".join(f"{count} {why}" for why, count in self.refused.most_common())
            lines.append(f"left out: {reasons}")
        return lines

    def values(self) -> dict[str, Any]:
        """Return the counts as plain numbers and dictionaries, for JSON."""
        return vars(self) | {"refused": dict(self.refused)}
