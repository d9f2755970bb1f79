"""RTP packets (RFC 3550, 5.1), and their frames on connections (RFC 4571)."""

from __future__ import annotations

import struct
from typing import NamedTuple

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
