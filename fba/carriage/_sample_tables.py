"""Places, times and kinds of the samples of a track, from its tables and fragments (ISO/IEC 14496-12, 8)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fba.arrays import Bool, Int64
from fba.carriage._boxes import Box
from fba.errors import UnsupportedError
from fba.limits import Limits

_NON_SYNC = 0x00010000
"""sample_is_non_sync_sample, a bit of the flags of samples in fragments."""
_BASE, _BASE_IS_MOOF = 0x1, 0x20000
_GIVEN = (0x2, 0x8, 0x10, 0x20)
"""Flags of the box `tfhd`; these say which of the `Defaults` it gives."""
_RUN_OFFSET, _RUN_FIRST = 0x1, 0x4
_LISTED = {"duration": 0x100, "size": 0x200, "flags": 0x400, "shift": 0x800}
"""Flags of the box `trun`; these say which columns it lists."""
SEVERAL_ENTRIES = "the FBA track changes its configuration on the way (several sample entries); cut it there"


_SAMPLE_BYTES = 200
"""Memory of a sample while its stream is put together."""
_COLUMNS = ("offsets", "sizes", "durations", "sync")


@dataclass(frozen=True, eq=False)
class SampleTable:
    """Samples of a track, in the order of decoding; (T,) each.

    offsets: bytes of the file. sizes: bytes. durations: ticks of the track. sync: where decoding can begin.
    """

    offsets: Int64
    sizes: Int64
    durations: Int64
    sync: Bool

    def __len__(self) -> int:
        return len(self.sizes)

    @staticmethod
    def join(parts: list[SampleTable]) -> SampleTable:
        """Return the samples of all parts, one after the other."""
        return SampleTable(*(np.concatenate([getattr(part, name) for part in parts]) for name in _COLUMNS))


def read_tables(box: Box, entry: int, limits: Limits) -> SampleTable:
    """Return the samples of a box `stbl`. entry: number of the sample entry that they must have, from 1.

    Raises FormatError for tables that contradict each other, UnsupportedError for several sample entries,
    LimitError for more samples than the limit of frames.
    """
    sizes = _read_sizes(box, limits)
    count = len(sizes)
    check_count(count, limits, len(box.data))
    durations = _read_durations(box.need(b"stts"), count)
    offsets = _read_offsets(box, sizes, entry)
    sync = np.ones(count, dtype=np.bool_)
    listed = box.child(b"stss")
    if listed is not None:
        (numbers,) = listed.table(8, listed.read("I", 4)[0], "u4")
        if len(numbers) and (numbers.min() < 1 or numbers.max() > count):
            raise listed.broken(f"it names sample {numbers.max()}, and the track has {count}; it is damaged")
        sync[:] = False
        sync[numbers - 1] = True
    return SampleTable(offsets, sizes, durations, sync)


def check_count(count: int, limits: Limits, source: int) -> None:
    """Raise LimitError for too many samples. source: bytes of the file."""
    limits.check_frames(count, "the track")
    limits.check_bytes(count * _SAMPLE_BYTES, "the list of samples", source=source)


def _read_sizes(box: Box, limits: Limits) -> Int64:
    """Return the sizes of all samples."""
    table = box.child(b"stsz")
    if table is not None:
        size, count = table.read("II", 4)
        if size:
            check_count(count, limits, len(table.data))
            return np.full(count, size, dtype=np.int64)
        (sizes,) = table.table(12, count, "u4")
    else:
        table = box.child(b"stz2")
        if table is None:
            raise box.broken("it has no box 'stsz', the sizes of samples; it is damaged")
        width, count = table.read("I", 4)[0] & 0xFF, table.read("I", 8)[0]
        if width == 4:
            (pairs,) = table.table(12, (count + 1) // 2, "u1")
            sizes = np.stack([pairs >> 4, pairs & 15], axis=1).ravel()[:count]
        elif width in (8, 16):
            (sizes,) = table.table(12, count, f"u{width // 8}")
        else:
            raise table.broken(f"its sizes have {width} bits, and 4, 8 and 16 are allowed; it is damaged")
    return sizes


def _read_durations(box: Box, count: int) -> Int64:
    """Return the duration of each of `count` samples, from a box `stts`."""
    counts, durations = box.table(8, box.read("I", 4)[0], "u4", "u4")
    if int(counts.sum()) != count:
        raise box.broken(
            f"it has durations of {counts.sum()} samples, and the track has {count}; it is damaged"
        )
    return np.repeat(durations, counts)


def _read_offsets(box: Box, sizes: Int64, entry: int) -> Int64:
    """Return the byte of the file at which each sample begins. entry: as of `read_tables`."""
    chunks = box.child(b"stco") or box.need(b"co64")
    (starts,) = chunks.table(8, chunks.read("I", 4)[0], "u4" if chunks.kind == b"stco" else "u8")
    runs = box.need(b"stsc")
    first, each, entries = runs.table(8, runs.read("I", 4)[0], "u4", "u4", "u4")
    if not len(sizes):
        return sizes
    if not len(first) or first[0] != 1 or (np.diff(first) <= 0).any() or first[-1] > len(starts):
        raise runs.broken(f"its runs of chunks do not cover the {len(starts)} chunks in order; it is damaged")
    in_chunk = np.repeat(each, np.diff([*first.tolist(), len(starts) + 1]))
    if int(in_chunk.sum()) != len(sizes):
        raise runs.broken(
            f"its chunks hold {in_chunk.sum()} samples, and the track has {len(sizes)}; it is damaged"
        )
    if (entries != entry).any():
        raise UnsupportedError(SEVERAL_ENTRIES, what="several sample entries in a track")
    before = np.cumsum(sizes) - sizes
    firsts = np.cumsum(in_chunk) - in_chunk
    filled = in_chunk > 0
    origin = starts[filled] - before[firsts[filled]]
    offsets: Int64 = before + np.repeat(origin, in_chunk[filled])
    return offsets


class Defaults(NamedTuple):
    """What holds for samples of a fragment that say nothing else: number of their entry, and three values."""

    entry: int
    duration: int
    size: int
    flags: int


class Fragments:
    """Collects the samples of one track from boxes `moof`.

    track: its number. entry: number of the sample entry that its samples must have. defaults: of the box
    `trex`, of all tracks by number. tables: samples outside of fragments, which come first. Raises
    FormatError, UnsupportedError, and LimitError for more samples than the limit of frames.
    """

    def __init__(
        self, track: int, entry: int, defaults: dict[int, Defaults], tables: SampleTable, limits: Limits
    ) -> None:
        self._track, self._entry, self._defaults, self._limits = track, entry, defaults, limits
        self._parts = [tables]
        self._count = len(tables)

    def add(self, moof: Box) -> None:
        """Add the samples of a fragment."""
        end = moof.start
        for traf in moof.children():
            if traf.kind == b"traf":
                end = self._add_track(traf, moof.start, end)

    def table(self) -> SampleTable:
        """Return all samples."""
        return SampleTable.join(self._parts)

    def _add_track(self, traf: Box, moof: int, at: int) -> int:
        """Add a track of a fragment; return where its data ends. at: where the data before it ends."""
        head = traf.need(b"tfhd")
        flags, track, where = head.flags, head.read("I", 4)[0], 8
        if flags & _BASE:
            at, where = head.read("Q", where)[0], where + 8
        elif flags & _BASE_IS_MOOF:
            at = moof
        given = []
        for flag, default in zip(_GIVEN, self._defaults.get(track, Defaults(1, 0, 0, 0)), strict=True):
            given.append(head.read("I", where)[0] if flags & flag else default)
            where += 4 if flags & flag else 0
        base = at
        for run in traf.children():
            if run.kind == b"trun":
                at = self._add_run(run, Defaults(*given), base, at, wanted=track == self._track)
        return at

    def _add_run(self, run: Box, defaults: Defaults, base: int, at: int, *, wanted: bool) -> int:
        """Add the samples of a box `trun`, if they are wanted; return where their data ends.

        base: the byte from which an offset counts. at: where the data begins without an offset.
        """
        flags, count, where = run.flags, run.read("I", 4)[0], 8
        if flags & _RUN_OFFSET:
            at, where = base + run.read("i", where)[0], where + 4
        first = run.read("I", where)[0] if flags & _RUN_FIRST else None
        where += 4 if flags & _RUN_FIRST else 0
        listed = [name for name, flag in _LISTED.items() if flags & flag]
        columns = dict(zip(listed, run.table(where, count, *["u4"] * len(listed)), strict=True))
        end = at + (int(columns["size"].sum()) if "size" in columns else count * defaults.size)
        if not wanted:
            return end
        self._count += count
        check_count(self._count, self._limits, len(run.data))
        if defaults.entry != self._entry:
            raise UnsupportedError(SEVERAL_ENTRIES, what="several sample entries in a track")
        for name, value in (
            ("size", defaults.size),
            ("duration", defaults.duration),
            ("flags", defaults.flags),
        ):
            columns.setdefault(name, np.full(count, value, dtype=np.int64))
        kinds, sizes = columns["flags"].copy(), columns["size"]
        if first is not None:
            kinds[:1] = first
        offsets = min(max(at, -1), len(run.data)) + np.cumsum(sizes) - sizes
        self._parts.append(SampleTable(offsets, sizes, columns["duration"], kinds & _NON_SYNC == 0))
        return end
