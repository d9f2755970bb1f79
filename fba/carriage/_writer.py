"""`write_mp4`: whole files, for playing while they load, and fragmented ones, for streaming.

Both may have a `SoundTrack`.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Literal

import numpy as np

from fba.arrays import Bool, Float64, Int64
from fba.carriage._boxes import (
    AAC_OBJECT,
    AUDIO_STREAM,
    VISUAL_OBJECT,
    VISUAL_STREAM,
    Descriptor,
    write_box,
    write_esds,
    write_full_box,
)
from fba.carriage._samples import PlaneSamples, split_samples
from fba.carriage._tracks import ORIGINAL_UUID
from fba.errors import UnsupportedError
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BapTable


@dataclass(frozen=True, eq=False)
class SoundTrack:
    """Coded sound.

    coding: "aac" (ISO/IEC 14496-3) or "opus" (RFC 6716). configuration: AudioSpecificConfig, or the
    identification header of Opus in Ogg (RFC 7845, 5.1). rate: ticks a second, of the samples of AAC, 48000
    for Opus. channels: their number. packets: the frames. durations: int64 (N,), ticks of each. skipped:
    ticks at the beginning that decoders leave out.
    """

    coding: Literal["aac", "opus"]
    configuration: bytes
    rate: int
    channels: int
    packets: tuple[bytes, ...]
    durations: Int64
    skipped: int = 0


MOVIE_SCALE = 90_000
"""Ticks a second of the movie: a multiple of the usual frame rates."""
CHUNK_SECONDS = 1
"""Seconds of samples that lie together, before those of the other track."""
PICTURE_SIZE = (1280, 720)
"""Width and height that are stated of the FBA track: those of `fba render`."""
_ROUNDED_SCALE = 1_000_000
"""Ticks a second of a track whose rate has no exact one in 32 bits."""
_UNITY = struct.pack(">9I", 0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000)
"""The matrix that changes nothing."""
_SYNC, _NOT_SYNC = 0x02000000, 0x01010000
"""Flags of samples in fragments: it depends on no other; it depends on others."""


def write_mp4(
    stream: bytes,
    *,
    sound: SoundTrack | None = None,
    sound_offset: Fraction | float = 0,
    fragment: Fraction | float | None = None,
    bap_steps: BapTable | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> bytes:
    """Return an MP4 file with a stream, a plane a sample, and perhaps a sound.

    sound_offset: seconds by which the sound begins after the first frame; before it if negative: what comes
    earlier is then not played. fragment: seconds of each fragment; None for a file with one table. Fragments
    last until the I plane after that time, if it comes before the time has passed again. bap_steps: the table
    of BAP steps of a stream that does not name one, to be named in the file.

    Raises BitstreamError for a damaged stream, UnsupportedError for several objects that do not fit into one
    track, ValueError for a fragment of no length.
    """
    if fragment is not None and not fragment > 0:
        raise ValueError(f"a fragment must last longer than {fragment} s")
    samples = split_samples(stream, bap_steps=bap_steps, limits=limits)
    tracks = [_fba_track(samples)]
    if sound is not None:
        tracks.append(_sound_track(sound, Fraction(sound_offset)))
    return _whole_file(tracks) if fragment is None else _fragmented_file(tracks, Fraction(fragment))


def write_sound(sound: SoundTrack) -> bytes:
    """Return an MP4 file with a sound alone."""
    return _whole_file([_sound_track(sound, Fraction(0))])


@dataclass(frozen=True, eq=False)
class _Track:
    """A track to be written.

    number: track_ID. handler, header, entry: its kind and boxes. scale: ticks a second. samples: their bytes.
    durations: int64 (T,), ticks. sync: bool (T,), or None if decoding can begin at any. skipped: ticks at the
    begin that are not presented. delay: seconds before it is presented. data: user data.
    """

    number: int
    handler: bytes
    header: bytes
    entry: bytes
    scale: int
    samples: tuple[bytes, ...]
    durations: Int64
    sync: Bool | None = None
    skipped: int = 0
    delay: Fraction = Fraction(0)
    data: bytes = b""

    @property
    def sizes(self) -> Int64:
        return np.array([len(sample) for sample in self.samples], dtype=np.int64)

    @property
    def times(self) -> Int64:
        """int64 (T + 1,): when each sample is decoded, and the end of the last, in ticks."""
        return np.concatenate([[0], np.cumsum(self.durations)])

    @property
    def seconds(self) -> Fraction:
        """Length in the presentation."""
        return Fraction(max(int(self.durations.sum()) - self.skipped, 0), self.scale)

    def presented(self) -> Float64:
        """Return when each sample is presented, float64 (T,), in seconds."""
        return (self.times[:-1] - self.skipped) / self.scale + float(self.delay)


def _fba_track(samples: PlaneSamples) -> _Track:
    rate, index = samples.rate, np.append(samples.index, samples.index[-1] + 1)
    scale = rate.numerator
    if scale < 1 << 32:
        durations = np.diff(index) * rate.denominator
    else:
        scale = _ROUNDED_SCALE
        durations = np.diff(np.rint(index * (scale / float(rate))).astype(np.int64))
    if durations.max() >= 1 << 32:
        seconds = int(durations.max()) / scale
        raise UnsupportedError(f"a pause of {seconds:.0f} s is longer than MP4 can say", what="a long pause")
    sizes = np.array([len(plane) for plane in samples.planes])
    times = (np.cumsum(durations) - durations) // scale
    busiest = int(np.bincount(times - times[0], sizes).max()) if times[-1] < 10_000_000 else int(sizes.sum())
    mean = round(8 * int(sizes.sum()) * scale / int(durations.sum()))
    told = Descriptor(VISUAL_OBJECT, VISUAL_STREAM, samples.configuration)
    entry = write_box(
        b"mp4v",
        struct.pack(">6xH16xHHIIIH32sHh", 1, *PICTURE_SIZE, 0x480000, 0x480000, 0, 1, b"", 24, -1),
        write_esds(told, int(sizes.max()), 8 * busiest, mean),
    )
    header = write_full_box(b"vmhd", 0, 1, bytes(8))
    data = (
        write_box(b"udta", write_box(b"uuid", ORIGINAL_UUID, samples.original)) if samples.original else b""
    )
    sync = None if samples.sync.all() else samples.sync
    return _Track(1, b"vide", header, entry, scale, samples.planes, durations, sync, data=data)


def _sound_track(sound: SoundTrack, offset: Fraction) -> _Track:
    sizes = [len(packet) for packet in sound.packets]
    seconds = int(sound.durations.sum()) / sound.rate
    bits = round(8 * sum(sizes) / seconds) if seconds else 0
    if sound.coding == "aac":
        told = Descriptor(AAC_OBJECT, AUDIO_STREAM, sound.configuration)
        kind, described = b"mp4a", write_esds(told, max(sizes), bits, bits)
    else:
        channels, skip, rate, gain, family = struct.unpack_from("<BHIhB", sound.configuration, 9)
        head = struct.pack(">BBHIhB", 0, channels, skip, rate, gain, family)
        kind, described = b"Opus", write_box(b"dOps", head, sound.configuration[19:] if family else b"")
    shown_rate = sound.rate << 16 if sound.rate < 1 << 16 else 0
    entry = write_box(kind, struct.pack(">6xH8xHHII", 1, sound.channels, 16, 0, shown_rate), described)
    early = round(max(-offset, Fraction(0)) * sound.rate)
    header = write_full_box(b"smhd", 0, 0, bytes(4))
    return _Track(
        2, b"soun", header, entry, sound.rate, sound.packets, sound.durations, None,
        sound.skipped + early, max(offset, Fraction(0)),
    )  # fmt: skip


def _whole_file(tracks: list[_Track]) -> bytes:
    """Return a file with all tables before the data, whose chunks alternate."""
    chunks = sorted(chunk for track in tracks for chunk in _chunks(track))
    samples = {track.number: track.samples for track in tracks}
    payload = [b"".join(samples[number][first:stop]) for _, number, first, stop in chunks]
    lengths = np.array([len(piece) for piece in payload], dtype=np.int64)
    relative = np.cumsum(lengths) - lengths
    owners = np.array([number for _, number, _, _ in chunks])
    counts = np.array([stop - first for _, _, first, stop in chunks])
    begin = _file_type(b"isom", b"iso2", b"mp42")
    total = int(lengths.sum())
    wide = total + (1 << 24) >= 1 << 32
    header = 16 if total + 8 >= 1 << 32 else 8
    at = 0
    for _ in range(2):  # once for its length
        tables = {
            track.number: _tables(
                track, relative[owners == track.number] + at, counts[owners == track.number], wide=wide
            )
            for track in tracks
        }
        moov = _moov(tracks, tables)
        at = len(begin) + len(moov) + header
    return b"".join((begin, moov, write_box(b"mdat", *payload)))


def _chunks(track: _Track) -> Iterator[tuple[float, int, int, int]]:
    """Yield of each chunk when it is presented, the number of the track, the first sample and the end."""
    seconds = track.times[:-1] // (track.scale * CHUNK_SECONDS)
    borders = [0, *(np.flatnonzero(np.diff(seconds)) + 1).tolist(), len(track.samples)]
    moments = track.presented()
    for first, stop in pairwise(borders):
        yield float(moments[first]), track.number, first, stop


def _tables(track: _Track, offsets: Int64, counts: Int64, *, wide: bool) -> bytes:
    """Return the boxes of samples. offsets: bytes at which chunks begin. counts: samples of each chunk."""
    lengths, runs = _run_lengths(track.durations)
    boxes = [_table(b"stts", np.stack([lengths, runs], axis=1))]
    if track.sync is not None:
        boxes.append(_table(b"stss", np.flatnonzero(track.sync) + 1))
    repeats, each = _run_lengths(counts)
    first = np.cumsum(repeats) - repeats + 1
    boxes.append(_table(b"stsc", np.stack([first, each, np.ones_like(first)], axis=1)))
    sizes = track.sizes
    boxes.append(
        write_full_box(b"stsz", 0, 0, struct.pack(">II", 0, len(sizes)), sizes.astype(">u4").tobytes())
    )
    boxes.append(_table(b"co64", offsets, ">u8") if wide else _table(b"stco", offsets))
    return b"".join(boxes)


def _run_lengths(values: Int64) -> tuple[Int64, Int64]:
    """Return how often equal values follow each other, and the values."""
    if not len(values):
        return values, values
    firsts = np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1])
    return np.diff(np.append(firsts, len(values))), values[firsts]


def _table(kind: bytes, rows: Int64, dtype: str = ">u4") -> bytes:
    return write_full_box(kind, 0, 0, struct.pack(">I", len(rows)), rows.astype(dtype).tobytes())


def _fragmented_file(tracks: list[_Track], period: Fraction) -> bytes:
    """Return a file whose tables are empty, followed by fragments."""
    empty = b"".join(
        [
            *(_table(kind, np.zeros(0, dtype=np.int64)) for kind in (b"stts", b"stsc")),
            write_full_box(b"stsz", 0, 0, bytes(8)),
            _table(b"stco", np.zeros(0, dtype=np.int64)),
        ]
    )
    length = max(track.delay + track.seconds for track in tracks)
    extends = [write_full_box(b"mehd", 1, 0, struct.pack(">Q", round(length * MOVIE_SCALE)))]
    extends += [
        write_full_box(b"trex", 0, 0, struct.pack(">5I", track.number, 1, 0, 0, 0)) for track in tracks
    ]
    moov = _moov(tracks, dict.fromkeys((1, 2), empty), write_box(b"mvex", *extends))
    parts = [_file_type(b"iso5", b"iso6", b"mp42"), moov]
    moments = [track.presented() for track in tracks]
    stops = [0] * len(tracks)
    for number, end in enumerate(_fragment_ends(tracks[0], moments, float(period)), 1):
        starts = stops
        stops = [int(np.searchsorted(times, end - 1e-9)) for times in moments]
        spans = [
            (track, slice(start, stop))
            for track, start, stop in zip(tracks, starts, stops, strict=True)
            if stop > start
        ]
        if spans:
            parts += _fragment(number, spans)
    return b"".join(parts)


def _fragment_ends(planes: _Track, moments: list[Float64], period: float) -> Iterator[float]:
    """Yield the time at which each fragment ends. planes: the track whose I planes decide."""
    times = moments[0]
    joins = times if planes.sync is None else times[planes.sync]
    end = max(float(each[-1]) for each in moments)
    begin = 0.0
    while begin + period <= end:
        next_join = int(np.searchsorted(joins, begin + period - 1e-9))
        near = next_join < len(joins) and joins[next_join] < begin + 2 * period
        begin = float(joins[next_join]) if near else begin + period
        yield begin
    yield float("inf")


def _fragment(number: int, spans: list[tuple[_Track, slice]]) -> list[bytes]:
    """Return the boxes of a fragment. spans: tracks and their samples."""
    payload = [b"".join(track.samples[span]) for track, span in spans]
    offset = 0
    for _ in range(2):  # once for its length
        trafs, at = [], offset
        for (track, span), data in zip(spans, payload, strict=True):
            trafs.append(_traf(track, span, at))
            at += len(data)
        moof = write_box(b"moof", write_full_box(b"mfhd", 0, 0, struct.pack(">I", number)), *trafs)
        offset = len(moof) + 8
    return [moof, write_box(b"mdat", *payload)]


def _traf(track: _Track, span: slice, offset: int) -> bytes:
    """Return the box of a track in a fragment. offset: bytes from the begin of the fragment to its data."""
    sync = np.ones(len(track.samples), dtype=np.bool_) if track.sync is None else track.sync
    flags = np.where(sync[span], _SYNC, _NOT_SYNC)
    rows = np.stack([track.durations[span], track.sizes[span], flags], axis=1)
    head = struct.pack(">Ii", len(rows), offset)
    return write_box(
        b"traf",
        write_full_box(b"tfhd", 0, 0x020000, struct.pack(">I", track.number)),
        write_full_box(b"tfdt", 1, 0, struct.pack(">Q", int(track.times[span.start]))),
        write_full_box(b"trun", 0, 0x000701, head, rows.astype(">u4").tobytes()),
    )


def _file_type(*brands: bytes) -> bytes:
    return write_box(b"ftyp", brands[0], struct.pack(">I", 512), *brands)


def _moov(tracks: list[_Track], tables: dict[int, bytes], extends: bytes = b"") -> bytes:
    """Return the box `moov`. tables: the sample boxes of each track. extends: the box for fragments."""
    lengths = [Fraction(0) if extends else track.delay + track.seconds for track in tracks]
    movie = _versioned(
        b"mvhd", 0, round(max(lengths) * MOVIE_SCALE), ">I", MOVIE_SCALE,
        struct.pack(">IH10x", 0x10000, 0x100) + _UNITY + bytes(24) + struct.pack(">I", len(tracks) + 1),
    )  # fmt: skip
    traks = [
        _trak(track, tables[track.number], length, with_length=not extends)
        for track, length in zip(tracks, lengths, strict=True)
    ]
    return write_box(b"moov", movie, *traks, extends)


def _trak(track: _Track, tables: bytes, length: Fraction, *, with_length: bool) -> bytes:
    volume, size = (0x100, (0, 0)) if track.handler == b"soun" else (0, PICTURE_SIZE)
    head = _versioned(
        b"tkhd", 3, round(length * MOVIE_SCALE), ">I4x", track.number,
        struct.pack(">8xHHHH", 0, 0, volume, 0) + _UNITY
        + struct.pack(">II", *(side << 16 for side in size)),
    )  # fmt: skip
    ticks = int(track.durations.sum()) if with_length else 0
    times = _versioned(b"mdhd", 0, ticks, ">I", track.scale, struct.pack(">HH", 0x55C4, 0))  # "und"
    name = b"FBA\0" if track.handler == b"vide" else b"sound\0"
    handler = write_full_box(b"hdlr", 0, 0, struct.pack(">I4s12x", 0, track.handler), name)
    here = write_full_box(b"url ", 0, 1)
    data = write_box(b"dinf", write_full_box(b"dref", 0, 0, struct.pack(">I", 1), here))
    entries = write_full_box(b"stsd", 0, 0, struct.pack(">I", 1), track.entry)
    media = write_box(b"minf", track.header, data, write_box(b"stbl", entries, tables))
    return write_box(
        b"trak",
        head,
        _edits(track, with_length=with_length),
        write_box(b"mdia", times, handler, media),
        track.data,
    )


def _edits(track: _Track, *, with_length: bool) -> bytes:
    """Return the edit list of a track that does not simply begin at its first sample."""
    if not track.skipped and not track.delay:
        return b""
    wait, length = round(track.delay * MOVIE_SCALE), round(track.seconds * MOVIE_SCALE) if with_length else 0
    rows = [(wait, -1)] * bool(wait) + [(length, track.skipped)]
    packed = [struct.pack(">QqI", *row, 0x10000) for row in rows]
    return write_box(b"edts", write_full_box(b"elst", 1, 0, struct.pack(">I", len(rows)), *packed))


def _versioned(kind: bytes, flags: int, duration: int, form: str, value: int, rest: bytes) -> bytes:
    """Return a header with two times of 0, a number, and a duration in 32 bits, or in 64 if it needs them."""
    wide = duration >= 1 << 32
    times = struct.pack(">QQ" if wide else ">II", 0, 0)
    length = struct.pack(">Q" if wide else ">I", duration)
    return write_full_box(kind, int(wide), flags, times, struct.pack(form, value), length, rest)
