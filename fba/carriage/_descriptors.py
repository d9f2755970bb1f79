"""Descriptors of elementary streams, in boxes `esds` (ISO/IEC 14496-1, 7.2.6; 14496-14, 5.6)."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from fba.carriage._boxes import Box, write_full_box

VISUAL_STREAM, AUDIO_STREAM = 4, 5
"""Values of streamType."""
VISUAL_OBJECT, AAC_OBJECT = 0x20, 0x40
"""Values of objectTypeIndication: ISO/IEC 14496-2 and 14496-3."""
_STREAM, _DECODER, _SPECIFIC, _SYNC = 3, 4, 5, 6
"""Tags of descriptors."""


@dataclass(frozen=True)
class Descriptor:
    """What a decoder of an elementary stream is told: the object type, the stream type, the configuration."""

    object_type: int
    stream_type: int
    configuration: bytes


def write_esds(described: Descriptor, largest: int, most: int, mean: int) -> bytes:
    """Return the box. largest: bytes of the largest sample. most, mean: bits a second."""
    decoder = struct.pack(
        ">BB3sII",
        described.object_type,
        described.stream_type << 2 | 1,
        min(largest, 0xFFFFFF).to_bytes(3, "big"),
        min(most, 0xFFFFFFFF),
        min(mean, 0xFFFFFFFF),
    ) + _write(_SPECIFIC, described.configuration)
    stream = struct.pack(">HB", 0, 0) + _write(_DECODER, decoder) + _write(_SYNC, b"\2")
    return write_full_box(b"esds", 0, 0, _write(_STREAM, stream))


def _write(tag: int, content: bytes) -> bytes:
    """Return a descriptor. Its length takes four bytes, as most programs write it."""
    size = len(content)
    length = bytes((size >> shift & 0x7F) | (0x80 if shift else 0) for shift in (21, 14, 7, 0))
    return bytes([tag]) + length + content


def read_esds(box: Box) -> Descriptor:
    """Return what a box `esds` says. Raises FormatError."""
    begin, end = _find(box, _STREAM, 4, box.end - box.begin)
    flags = box.read("B", begin + 2)[0]
    at = begin + 3
    at += 2 if flags & 0x80 else 0
    at += 1 + box.read("B", at)[0] if flags & 0x40 else 0
    at += 2 if flags & 0x20 else 0
    begin, end = _find(box, _DECODER, at, end)
    object_type, stream_type = box.read("BB", begin)
    configuration = b""
    if begin + 13 < end:
        first, last = _find(box, _SPECIFIC, begin + 13, end)
        configuration = box.content[first:last]
    return Descriptor(object_type, stream_type >> 2, configuration)


def _find(box: Box, wanted: int, at: int, end: int) -> tuple[int, int]:
    """Return begin and end of the content of the descriptor with a tag; all are offsets in the box."""
    while at < end:
        tag = box.read("B", at)[0]
        at, size = at + 1, 0
        for _ in range(4):
            byte = box.read("B", at)[0]
            at, size = at + 1, size << 7 | byte & 0x7F
            if byte < 0x80:
                break
        if at + size > end:
            raise box.broken(
                f"descriptor {tag} announces {size} bytes, and {max(end - at, 0)} are left; it is damaged"
            )
        if tag == wanted:
            return at, at + size
        at += size
    raise box.broken(f"it has no descriptor {wanted}, which is needed; it is damaged")
