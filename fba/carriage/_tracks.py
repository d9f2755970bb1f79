"""The tracks of an MP4 file: what each holds, and the one with the stream."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import asdict, dataclass
from fractions import Fraction

from fba.carriage._boxes import AAC_OBJECT, VISUAL_OBJECT, Box, read_esds
from fba.carriage._samples import OBJECT_CODE, PLANE_CODE, is_configuration
from fba.errors import FormatError, Remedy

MOST_TRACKS = 1000
ORIGINAL_UUID = bytes.fromhex("0d5ef9b8a1c94c5a9e0c66626121a001")
"""Type of the user data that says how the stream of a track was coded before, see `_samples`."""
_STREAMS = (b"mp4v", b"mp4s")
"""Sample entries of MPEG-4 streams that are no sound."""
_ENTRY_BYTES = {b"vide": 78, b"soun": 28}
"""Bytes of a sample entry before its boxes, by the handler of the track."""
_SOUNDS = {b"mp4a": "MPEG-4 audio", b"Opus": "Opus", b"fLaC": "FLAC", b"ac-3": "AC-3", b".mp3": "MP3"}


@dataclass(frozen=True)
class Mp4Track:
    """A track of an MP4 file.

    number: its track_ID. kind: its handler, "vide" for pictures and FBA, "soun" for sound. coding: of its
    samples, in words or as its four characters. is_fba: whether it holds an FBA stream. seconds: its length
    as the file states it, 0 where it does not. rate, channels: of sound; else 0. start: when its first sample
    is due, in seconds of the presentation; negative if its edit list begins later.
    """

    number: int
    kind: str
    coding: str
    is_fba: bool
    seconds: Fraction
    rate: int = 0
    channels: int = 0
    start: Fraction = Fraction(0)

    def __str__(self) -> str:
        about = {"soun": "sound ", "vide": "video "}.get(self.kind, f"{self.kind} ")
        sound = f", {self.rate} Hz, {self.channels} channel{'s' * (self.channels > 1)}" if self.rate else ""
        return f"{self.number}: {'' if self.is_fba else about}{self.coding}{sound}"

    def to_dict(self) -> dict[str, object]:
        """Return plain numbers and strings, for JSON."""
        exact = {"seconds": float(self.seconds), "start": float(self.start)}
        return {**asdict(self), **exact}


@dataclass(frozen=True)
class OpenTrack:
    """A track and its boxes.

    timescale: ticks a second. entry: number of its first sample entry that is FBA, from 1. configuration:
    of that. original: user data, how the stream was coded before, or b"".
    """

    track: Mp4Track
    box: Box
    timescale: int
    entry: int
    configuration: bytes
    original: bytes


def read_tracks(moov: Box) -> list[OpenTrack]:
    """Return the tracks of a box `moov`. Raises FormatError."""
    movie = moov.need(b"mvhd")
    movie_scale = movie.read("I", 20 if movie.version else 12)[0]
    traks = [box for box in moov.children() if box.kind == b"trak"]
    if len(traks) > MOST_TRACKS:
        raise moov.broken(f"it has {len(traks)} tracks; more than {MOST_TRACKS} are taken for damage")
    return [_read_track(trak, movie_scale) for trak in traks]


def choose_track(tracks: list[OpenTrack], number: int | None, moov: Box) -> OpenTrack:
    """Return the FBA track, or the one with a number. Raises FormatError without one, or for several."""
    streams = [each for each in tracks if each.track.is_fba]
    chosen = [each for each in streams if number is None or each.track.number == number]
    if len(chosen) == 1:
        return chosen[0]
    names = "; ".join(str(each.track) for each in (streams or tracks)[:20]) or "none"
    if not streams:
        raise FormatError(f"the MP4 file has no FBA track; its tracks: {names}", path=moov.path)
    numbers = ", ".join(str(each.track.number) for each in streams)
    if number is not None and not chosen:
        raise FormatError(
            f"the MP4 file has no FBA track {number}; those with FBA: {numbers}", path=moov.path
        )
    raise FormatError(f"the MP4 file has several FBA tracks: {numbers}", path=moov.path).with_remedies(
        Remedy("track", "choose one with {}", str(chosen[0].track.number))
    )


def _read_track(trak: Box, movie_scale: int) -> OpenTrack:
    head, media = trak.need(b"tkhd"), trak.need(b"mdia")
    number = head.read("I", 20 if head.version else 12)[0]
    times, kind = media.need(b"mdhd"), media.need(b"hdlr").read("4s", 8)[0]
    timescale, ticks = times.read("IQ", 20) if times.version else times.read("II", 12)
    handler = bytes(kind)
    if not timescale:
        raise times.broken("its time scale is 0 ticks a second; it is damaged")
    table = media.need(b"minf", b"stbl")
    entry, is_fba, configuration, coding, sound = _read_entries(table, handler)
    track = Mp4Track(
        number, handler.decode("latin-1"), coding, is_fba, Fraction(ticks, timescale), *sound,
        start=_read_edits(trak, movie_scale, timescale),
    )  # fmt: skip
    return OpenTrack(track, table, timescale, entry, configuration, _read_original(trak) if is_fba else b"")


def _read_entries(table: Box, handler: bytes) -> tuple[int, bool, bytes, str, tuple[int, int]]:
    """Return what the FBA entry says, or the first one.

    Its number, whether it is FBA, its configuration, its coding, and the rate and the channels of a sound.
    """
    described = table.need(b"stsd")
    entries = list(described.children(8))
    for number, entry in enumerate(entries, 1):
        if entry.kind in _STREAMS:
            esds = _esds(entry, 8 if entry.kind == b"mp4s" else _ENTRY_BYTES[b"vide"])
            told = None if esds is None else read_esds(esds)
            if told is not None and told.object_type == VISUAL_OBJECT:
                configuration = told.configuration
                if is_configuration(configuration or _first_bytes(table)):
                    return number, True, configuration, "FBA", (0, 0)
    if not entries:
        return 0, False, b"", "unknown", (0, 0)
    first = entries[0]
    coding, sound = first.name.strip(), (0, 0)
    if handler == b"soun":
        coding = _SOUNDS.get(first.kind, coding)
        with suppress(FormatError):  # QuickTime has other entries; whoever plays the sound reads them
            channels, _, _, rate = first.read("HHIH", 16)
            sound = rate, channels
            esds = _esds(first, _ENTRY_BYTES[b"soun"]) if first.kind == b"mp4a" else None
            if esds is not None and read_esds(esds).object_type == AAC_OBJECT:
                coding = "AAC"
    return 1, False, b"", coding, sound


def _esds(entry: Box, offset: int) -> Box | None:
    return next((each for each in entry.children(offset) if each.kind == b"esds"), None)


def _first_bytes(table: Box) -> bytes:
    """Return the first bytes of the samples if they begin with a start code of FBA; else b""."""
    chunks = table.child(b"stco")
    if chunks is None or chunks.read("I", 4)[0] == 0:
        return b""
    at = chunks.read("I", 8)[0]
    head = table.data[at : at + 4]
    return OBJECT_CODE if head in (OBJECT_CODE, PLANE_CODE) else b""


def _read_edits(trak: Box, movie_scale: int, timescale: int) -> Fraction:
    """Return when the first sample is due, in seconds of the presentation, by the edit list."""
    edits = trak.child(b"edts", b"elst")
    if edits is None:
        return Fraction(0)
    count, wide = edits.read("I", 4)[0], edits.version == 1
    form, size = ("Qq", 20) if wide else ("Ii", 12)
    if count * size > edits.end - edits.begin - 8:
        raise edits.broken(f"it announces {count} edits, and has room for fewer; it is damaged")
    wait = 0
    for number in range(count):
        duration, media_time = edits.read(form, 8 + number * size)
        if media_time != -1:
            return Fraction(wait, movie_scale or 1) - Fraction(max(media_time, 0), timescale)
        wait += duration
    return Fraction(wait, movie_scale or 1)


def _read_original(trak: Box) -> bytes:
    for box in (trak.child(b"udta") or trak).children():
        if box.kind == b"uuid" and box.content[:16] == ORIGINAL_UUID:
            return box.content[16:]
    return b""
