"""Boxes of the ISO base media file format (ISO/IEC 14496-12, 4.2): written, and found in untrusted bytes."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fba.arrays import Int64
from fba.errors import FormatError
from fba.source import Path

MOST_BOXES = 1_000_000
"""Boxes of a file that are looked at: at one fragment a second, those of days."""


def write_box(kind: bytes, *parts: bytes) -> bytes:
    """Return a box with this content."""
    size = 8 + sum(map(len, parts))
    if size < 1 << 32:
        return b"".join((struct.pack(">I4s", size, kind), *parts))
    return b"".join((struct.pack(">I4sQ", 1, kind, size + 8), *parts))


def write_full_box(kind: bytes, version: int, flags: int, *parts: bytes) -> bytes:
    """Return a box that begins with a version and flags."""
    return write_box(kind, struct.pack(">I", version << 24 | flags), *parts)


@dataclass(frozen=True)
class Box:
    """A box in a file.

    kind: its four characters. data: of the whole file. start, begin, end: bytes of the file at which the box,
    its content and what follows begin. path: of the file, for errors, or None.
    """

    kind: bytes
    data: bytes
    start: int
    begin: int
    end: int
    path: Path | None = None

    @property
    def name(self) -> str:
        """The four characters as text."""
        return self.kind.decode("latin-1")

    @property
    def content(self) -> bytes:
        """The bytes of the content."""
        return self.data[self.begin : self.end]

    def broken(self, finding: str) -> FormatError:
        """Return the error for this box: where it is, and what was found."""
        return FormatError(f"MP4 box {self.name!r} at byte {self.start}: {finding}", path=self.path)

    def read(self, form: str, offset: int) -> tuple[int, ...]:
        """Return numbers of the content, as of `struct`. offset: in the content. Raises FormatError."""
        size, at = struct.calcsize(f">{form}"), self.begin + offset
        if at + size > self.end:
            raise self.broken(
                f"it has {self.end - self.begin} bytes, and {offset + size} are needed; it is damaged"
            )
        return struct.unpack_from(f">{form}", self.data, at)

    @property
    def version(self) -> int:
        """The version of a full box."""
        return self.read("B", 0)[0]

    @property
    def flags(self) -> int:
        """The flags of a full box."""
        return self.read("I", 0)[0] & 0xFFFFFF

    def table(self, offset: int, count: int, *columns: str) -> tuple[Int64, ...]:
        """Return the columns of a table, each int64 (count,). columns: their types, as "u4" of NumPy.

        Raises FormatError for a table beyond the end of the box, before memory is taken for it.
        """
        row = np.dtype([(str(number), f">{kind}") for number, kind in enumerate(columns)])
        room = max(self.end - self.begin - offset, 0)
        if count * row.itemsize > room:
            raise self.broken(
                f"it announces {count} entries of {row.itemsize} bytes, and has {room} bytes; it is damaged"
            )
        rows = np.frombuffer(self.data, row, count, self.begin + offset) if count else np.zeros(0, row)
        far = np.uint64(1 << 62)  # beyond any file
        names = row.names or ()
        return tuple(np.minimum(rows[name].astype(np.uint64), far).astype(np.int64) for name in names)

    def children(self, offset: int = 0) -> Iterator[Box]:
        """Yield the boxes in the content from an offset on. Raises FormatError where they do not fit."""
        return _boxes(self.data, self.begin + offset, self.end, self.path)

    def child(self, *kinds: bytes) -> Box | None:
        """Return the first box on this way down, or None."""
        box: Box | None = self
        for kind in kinds:
            box = None if box is None else next((each for each in box.children() if each.kind == kind), None)
        return box

    def need(self, *kinds: bytes) -> Box:
        """Return the first box on this way down; FormatError without it."""
        box = self
        for kind in kinds:
            found = box.child(kind)
            if found is None:
                raise box.broken(f"it has no box {kind.decode('latin-1')!r}, which is needed; it is damaged")
            box = found
        return box


def top_boxes(data: bytes, path: Path | None) -> Iterator[Box]:
    """Yield the boxes of a file; the last may be cut off. Raises FormatError for what is no box."""
    return _boxes(data, 0, len(data), path, top=True)


def _boxes(data: bytes, at: int, end: int, path: Path | None, *, top: bool = False) -> Iterator[Box]:
    for _ in range(MOST_BOXES):
        if at + 8 > end:
            if at < end and any(data[at:end]) and not top:  # QuickTime ends some lists with zeros
                raise FormatError(f"MP4: the {end - at} bytes at byte {at} are no box; damaged", path=path)
            return
        size, kind = struct.unpack_from(">I4s", data, at)
        begin = at + 8
        if size == 1:
            if at + 16 > end:
                raise Box(kind, data, at, begin, end, path).broken("its size is cut off")
            size = struct.unpack_from(">Q", data, begin)[0]
            begin += 8
        stop = end if size == 0 else at + size
        box = Box(kind, data, at, begin, min(stop, end), path)
        if stop < begin:
            raise box.broken(f"it announces {size} bytes, fewer than its own header; it is damaged")
        if stop > end and not (top and kind == b"mdat"):
            what = "the file is cut off, or the box is damaged" if top else "it is damaged"
            raise box.broken(f"it announces {size} bytes, and {end - at} are left; {what}")
        yield box
        at = stop
        if at >= end:
            return
    raise FormatError(f"MP4: more than {MOST_BOXES} boxes; the file is damaged", path=path)


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
