"""The check of streams in packets: whatever comes, what is passed on is a stream without an error."""

from __future__ import annotations

import warnings
from pathlib import Path

import fba
from fba.carriage.receiving import DatagramReader, PacketReader, RtpReader
from fba.carriage.rtp import FrameReader
from fba.carriage.sdp import read_sdp, write_sdp
from fba.errors import FbaError, FbaWarning, FormatError
from tools.fuzz._outcome import ContractError, Outcome

RTP, DATAGRAMS, CONNECTION, DESCRIPTION = range(4)
"""What a file of the corpus holds, as its first byte says."""
_END = b"\0\0\1\xb1"
_PERIOD = 0.02
"""Seconds from one packet to the next."""


def check_rtp(data: bytes, folder: Path) -> Outcome:
    """Receive packets, or read a description of a session.

    Packets are in parts, each behind the number of its sender, a byte, and its length, two. On a connection,
    the parts are the pieces in which the bytes come.
    """
    kind = data[0] % 4 if data else RTP
    if kind == DESCRIPTION:
        return _check_description(data[1:])
    reader: PacketReader = DatagramReader() if kind == DATAGRAMS else RtpReader()
    frames = FrameReader()
    stream: list[bytes] = []
    position, now = 1, 0.0
    while position < len(data) and not reader.ended:
        size = int.from_bytes(data[position + 1 : position + 3], "big")
        part = data[position + 3 : position + 3 + size]
        now += _PERIOD
        for packet in frames.push(part) if kind == CONNECTION else [part]:
            stream += reader.receive(packet, data[position] % 4, now)
        position += 3 + size
    stream += reader.settle(now + 1)
    _check_stream(stream, reader)
    return Outcome(not reader.counts.refused)


def _check_stream(parts: list[bytes], reader: PacketReader) -> None:
    """Decode what was passed on: each plane, and nothing else."""
    counts = reader.counts
    if counts.planes != len(parts):
        raise ContractError(f"{counts.planes} planes are counted, and {len(parts)} were passed on")
    if not parts:
        return
    with warnings.catch_warnings(action="ignore", category=FbaWarning):
        try:
            decoded = fba.Decoder()
            planes = len(decoded.push(b"".join(parts) + _END)) + len(decoded.finish())
        except FbaError as error:
            raise ContractError(f"what was passed on is damaged: {error}") from error
    if planes != len(parts):
        raise ContractError(f"{len(parts)} planes were passed on, and {planes} are decoded")
    counts.lines()
    counts.values()


def _check_description(data: bytes) -> Outcome:
    """Read a description of a session; what was read is written, and read as the same."""
    try:
        session = read_sdp(data)
    except FormatError:
        return Outcome(False)
    again = read_sdp(write_sdp(session).encode())
    if (again.kind, again.configuration) != (session.kind, session.configuration):
        raise ContractError("another configuration after writing and reading again")
    return Outcome(True)
