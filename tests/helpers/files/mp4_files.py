"""MP4 files as other programs write them, with all forms of the boxes of ISO/IEC 14496-12."""

import struct
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

CONFIGURATION = bytes.fromhex("000001b061 000001b523 000001ba")
UNITY = struct.pack(">9I", 0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000)


def box(kind: bytes, *parts: bytes, form: str = "short") -> bytes:
    """A box. form: of its size, "short", "long" (64 bits) or "rest" (to the end of the file)."""
    content = b"".join(parts)
    if form == "long":
        return struct.pack(">I4sQ", 1, kind, len(content) + 16) + content
    return struct.pack(">I4s", 0 if form == "rest" else len(content) + 8, kind) + content


def full(kind: bytes, version: int, flags: int, *parts: bytes) -> bytes:
    return box(kind, struct.pack(">I", version << 24 | flags), *parts)


def numbers(*values: int, form: str = "I") -> bytes:
    return struct.pack(f">{len(values)}{form}", *values)


def descriptor(tag: int, content: bytes, digits: int) -> bytes:
    """A descriptor whose length takes so many bytes."""
    length = [
        (len(content) >> 7 * place & 0x7F) | (0x80 if place else 0) for place in reversed(range(digits))
    ]
    return bytes([tag, *length]) + content


def esds(
    configuration: bytes = CONFIGURATION,
    *,
    object_type: int = 0x20,
    stream_type: int = 4,
    digits: int = 1,
    flags: int = 0,
) -> bytes:
    """The box. flags: of the stream: 0x80 depends on another, 0x40 has an address, 0x20 has a clock."""
    extra = bytes(2) * bool(flags & 0x80) + b"\3url" * bool(flags & 0x40) + bytes(2) * bool(flags & 0x20)
    specific = descriptor(5, configuration, digits) if configuration else b""
    decoder = struct.pack(">BB3sII", object_type, stream_type << 2 | 1, bytes(3), 0, 0) + specific
    stream = (
        struct.pack(">HB", 1, flags) + extra + descriptor(4, decoder, digits) + descriptor(6, b"\2", digits)
    )
    return full(b"esds", 0, 0, descriptor(3, stream, digits))


@dataclass
class Track:
    """A track.

    samples: their bytes. sync: numbers of those where decoding can begin, from 1; None without a list.
    entry: kind of the sample entry. described: boxes in it. sizes: "32" bits, or a compact table of 16, 8, 4.
    chunks: samples in each chunk, the last again and again. edits: duration and media time of each.
    """

    samples: Sequence[bytes]
    durations: Sequence[int] = ()
    sync: Sequence[int] | None = (1,)
    number: int = 1
    scale: int = 25
    entry: bytes = b"mp4v"
    described: bytes = field(default_factory=esds)
    handler: bytes = b"vide"
    sizes: str = "32"
    chunks: Sequence[int] = (4,)
    wide: bool = False
    edits: Sequence[tuple[int, int]] = ()
    version: int = 0

    @property
    def counts(self) -> list[int]:
        found, left = [], len(self.samples)
        while left:
            each = self.chunks[min(len(found), len(self.chunks) - 1)]
            found.append(min(each, left))
            left -= found[-1]
        return found

    @property
    def times(self) -> list[int]:
        return list(self.durations) or [1] * len(self.samples)

    def trak(self, offsets: Sequence[int] | None) -> bytes:
        """The box. offsets: of the chunks; None for a track that is in fragments alone."""
        sizes = [len(sample) for sample in self.samples] if offsets is not None else []
        width = int(self.sizes)
        if width == 32:
            table = full(b"stsz", 0, 0, numbers(0, len(sizes)), numbers(*sizes))
        elif width == 4:
            pairs = [*sizes, 0][: len(sizes) + len(sizes) % 2]
            packed = bytes(a << 4 | b for a, b in zip(pairs[::2], pairs[1::2], strict=True))
            table = full(b"stz2", 0, 0, numbers(4, len(sizes)), packed)
        else:
            packed = numbers(*sizes, form={16: "H", 8: "B"}[width])
            table = full(b"stz2", 0, 0, numbers(width, len(sizes)), packed)
        counts = self.counts if offsets is not None else []
        runs = [numbers(number, count, 1) for number, count in enumerate(counts, 1)]
        times = [numbers(1, time) for time in (self.times if offsets is not None else [])]
        places = numbers(*(offsets or ()), form="Q" if self.wide else "I")
        stbl = box(
            b"stbl",
            full(b"stsd", 0, 0, numbers(1), self.sample_entry()),
            full(b"stts", 0, 0, numbers(len(times)), *times),
            full(b"stss", 0, 0, numbers(len(self.sync)), numbers(*self.sync))
            if self.sync is not None and offsets is not None
            else b"",
            full(b"stsc", 0, 0, numbers(len(runs)), *runs),
            table,
            full(b"co64" if self.wide else b"stco", 0, 0, numbers(len(offsets or ())), places),
        )
        long = "Q" if self.version else "I"
        head = struct.pack(f">{long}{long}I4x{long}", 0, 0, self.number, 0) + bytes(16) + UNITY + bytes(8)
        media = struct.pack(f">{long}{long}I{long}HH", 0, 0, self.scale, sum(self.times), 0x55C4, 0)
        edits = [
            struct.pack(">Qq" if self.version else ">Ii", *edit) + numbers(0x10000) for edit in self.edits
        ]
        return box(
            b"trak",
            full(b"tkhd", self.version, 3, head),
            box(b"edts", full(b"elst", self.version, 0, numbers(len(edits)), *edits)) if edits else b"",
            box(
                b"mdia",
                full(b"mdhd", self.version, 0, media),
                full(b"hdlr", 0, 0, struct.pack(">I4s12x", 0, self.handler), b"x\0"),
                box(b"minf", full(b"vmhd", 0, 1, bytes(8)), stbl),
            ),
        )

    def sample_entry(self) -> bytes:
        if self.handler == b"soun":
            return box(self.entry, struct.pack(">6xH8xHHII", 1, 1, 16, 0, 48000 << 16), self.described)
        if self.entry == b"mp4s":
            return box(self.entry, struct.pack(">6xH", 1), self.described)
        return box(self.entry, struct.pack(">6xH70x", 1), self.described)


def movie(traks: Sequence[bytes], *more: bytes) -> bytes:
    head = (
        struct.pack(">IIII", 0, 0, 1000, 0)
        + struct.pack(">IH10x", 0x10000, 0x100)
        + UNITY
        + bytes(24)
        + numbers(9)
    )
    return box(b"moov", full(b"mvhd", 0, 0, head), *traks, *more)


def whole_file(*tracks: Track, data: str = "short", moov_last: bool = False, padding: bytes = b"") -> bytes:
    """A file with tables. data: form of the size of its data. padding: boxes before the data."""
    begin = box(b"ftyp", b"isom", numbers(0), b"isom") + padding
    payload = b"".join(b"".join(track.samples) for track in tracks)
    mdat = box(b"mdat", payload, form=data)

    def moov(at: int) -> bytes:
        traks = []
        for track in tracks:
            offsets, position = [], 0
            for count in track.counts:
                offsets.append(at)
                at += sum(map(len, track.samples[position : position + count]))
                position += count
            traks.append(track.trak(offsets))
        return movie(traks)

    header = len(mdat) - len(payload)
    if moov_last:
        return begin + mdat + moov(len(begin) + header)
    return begin + moov(len(begin) + len(moov(0)) + header) + mdat


def fragmented_file(
    track: Track, cuts: Sequence[int], *, base: str = "moof", flags: str = "each", other: bool = False
) -> bytes:
    """A file of fragments. cuts: samples at which they begin, after the first.

    base: from where offsets count: "moof", "file" (an absolute offset), or "old": from the fragment for the
    first track, and from the end of the data of the track before for others. flags: "each" sample has its
    own, or "first": the first of a fragment has, and defaults hold for the others. other: a track of sound
    comes before, in each fragment.
    """
    trex = [full(b"trex", 0, 0, numbers(number, 1, 1, 0, 0x01010000)) for number in (track.number, 77)]
    sound = Track([b"sound"], number=77, handler=b"soun", entry=b"mp4a", described=b"", sync=None)
    traks = [track.trak(None)] + ([sound.trak(None)] if other else [])
    parts = [box(b"ftyp", b"iso5", numbers(0), b"iso5"), movie(traks, box(b"mvex", *trex))]
    borders = [0, *cuts, len(track.samples)]
    for number, (first, stop) in enumerate(pairwise(borders), 1):
        samples, begun = track.samples[first:stop], sum(map(len, parts)) if base == "file" else 0
        noise = b"sound" * other
        size = 0
        for _ in range(2):  # once for its length
            head, offset = {
                "moof": (full(b"tfhd", 0, 0x20000, numbers(track.number)), size + 8 + len(noise)),
                "file": (
                    full(
                        b"tfhd",
                        0,
                        0x1,
                        numbers(track.number) + struct.pack(">Q", begun + size + 8 + len(noise)),
                    ),
                    0,
                ),
                "old": (full(b"tfhd", 0, 0, numbers(track.number)), 0 if other else size + 8),
            }[base]
            rows, listed, first_flags = b"", 0x301, b""
            for place, (sample, time) in enumerate(
                zip(samples, track.times[first:stop], strict=True), first + 1
            ):
                sync = track.sync is None or place in track.sync
                rows += numbers(time, len(sample))
                rows += numbers(0x02000000 if sync else 0x01010000) if flags == "each" else b""
            if flags == "each":
                listed |= 0x400
            else:
                listed |= 0x4
                first_flags = numbers(
                    0x02000000 if track.sync is None or first + 1 in track.sync else 0x01010000
                )
            run = full(b"trun", 0, listed, struct.pack(">Ii", len(samples), offset), first_flags, rows)
            trafs = [box(b"traf", head, full(b"tfdt", 0, 0, numbers(sum(track.times[:first]))), run)]
            if other:
                its = struct.pack(">Iiii", 1, size + 8, 1, len(noise))
                trafs.insert(0, box(b"traf", full(b"tfhd", 0, 0, numbers(77)), full(b"trun", 0, 0x301, its)))
            moof = box(b"moof", full(b"mfhd", 0, 0, numbers(number)), *trafs)
            size = len(moof)
        parts += [moof, box(b"mdat", noise, *samples)]
    return b"".join(parts)
