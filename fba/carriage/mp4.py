"""MP4 files with an FBA stream as a visual track, and sound as another (ISO/IEC 14496-12 and 14496-14).

data = write_mp4(stream, sound=read_sound("voice.wav"))
assert read_mp4(data).stream == stream
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.carriage._boxes import Box, top_boxes
from fba.carriage._sample_tables import Defaults, Fragments, SampleTable, read_tables
from fba.carriage._samples import PlaneSamples, join_samples, split_samples
from fba.carriage._tracks import Mp4Track, choose_track, read_tracks
from fba.carriage._writer import SoundTrack, write_mp4, write_sound
from fba.errors import FormatError, warn
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path

__all__ = [
    "Mp4File", "Mp4Track", "PlaneSamples", "SoundTrack", "is_mp4", "list_tracks", "read_mp4",
    "split_samples", "write_mp4", "write_sound",
]  # fmt: skip

_FIRST_BOXES = (b"ftyp", b"styp", b"moov", b"mdat", b"free", b"skip", b"wide", b"pnot")


@dataclass(frozen=True, eq=False)
class Mp4File:
    """An FBA stream in an MP4 file.

    stream: its bytes, as they were before they came into the file where this program wrote it. track: that
    with the stream. tracks: all. planes: number of samples of the stream. fragmented: whether the file is a
    sequence of fragments.
    """

    stream: bytes
    track: Mp4Track
    tracks: tuple[Mp4Track, ...]
    planes: int
    fragmented: bool


def list_tracks(data: bytes, path: Path | None = None) -> tuple[Mp4Track, ...]:
    """Return what the tracks of an MP4 file hold. path: of the file, for errors. Raises FormatError."""
    return tuple(each.track for each in read_tracks(_find_boxes(data, path)[0]))


def is_mp4(head: bytes) -> bool:
    """Whether a file with this beginning is MP4, or QuickTime."""
    return head[4:8] in _FIRST_BOXES


def read_mp4(
    data: bytes,
    *,
    track: int | None = None,
    path: Path | None = None,
    salvage: bool = False,
    limits: Limits = DEFAULT_LIMITS,
) -> Mp4File:
    """Return the FBA stream in an MP4 file.

    track: number of its track, where several hold FBA. path: of the file, for errors. salvage: of a file
    that is cut off, return what is there, with an FbaWarning.

    Raises FormatError for a damaged file, or one without FBA, UnsupportedError, LimitError.
    """
    moov, moofs = _find_boxes(data, path)
    tracks = read_tracks(moov)
    chosen = choose_track(tracks, track, moov)
    tables = read_tables(chosen.box, chosen.entry, limits)
    fragments = Fragments(chosen.track.number, chosen.entry, _read_defaults(moov), tables, limits)
    for moof in moofs:
        fragments.add(moof)
    samples = fragments.table()
    planes = _take(data, samples, path, salvage=salvage)
    stream = join_samples(chosen.configuration, planes, chosen.original, limits)
    return Mp4File(stream, chosen.track, tuple(each.track for each in tracks), len(planes), bool(moofs))


def _find_boxes(data: bytes, path: Path | None) -> tuple[Box, list[Box]]:
    """Return the box `moov` of a file, and all boxes `moof`."""
    moov, moofs, seen = None, [], []
    for box in top_boxes(data, path):
        seen.append(box.name)
        if box.kind == b"moov" and moov is None:
            moov = box
        elif box.kind == b"moof":
            moofs.append(box)
    if moov is None:
        raise FormatError(
            "the MP4 file has no box 'moov', which says what is in it: it was cut off, or its recording was "
            f"not ended; it has {', '.join(map(repr, dict.fromkeys(seen[:100]))) or 'none'}",
            path=path,
        )
    return moov, moofs


def _read_defaults(moov: Box) -> dict[int, Defaults]:
    """Return the defaults of fragments of each track, by its number."""
    extends = moov.child(b"mvex")
    boxes = [] if extends is None else [box for box in extends.children() if box.kind == b"trex"]
    read = [box.read("IIIII", 4) for box in boxes]
    return {number: Defaults(*values) for number, *values in read}


def _take(data: bytes, samples: SampleTable, path: Path | None, *, salvage: bool) -> list[bytes]:
    """Return the bytes of all samples."""
    if not len(samples):
        raise FormatError("the FBA track of the MP4 file has no samples", path=path)
    ends = samples.offsets + samples.sizes
    wrong = (samples.sizes == 0) | (samples.offsets < 0) | (ends > len(data))
    count = len(samples)
    if wrong.any():
        first = int(np.argmax(wrong))
        finding = (
            f"sample {first + 1} of {count} of the FBA track has {samples.sizes[first]} bytes from byte "
            f"{samples.offsets[first]} on, and the file has {len(data)}: it was cut off, or is damaged"
        )
        if not salvage or not first:
            raise FormatError(finding, path=path)
        warn(f"{finding}; the {first} samples before it are read", stacklevel=3)
        count = first
    if int(samples.sizes[:count].sum()) > len(data):
        raise FormatError(
            f"the samples of the FBA track have {samples.sizes[:count].sum()} bytes, and the MP4 file has "
            f"{len(data)}: they overlap, so it is damaged",
            path=path,
        )
    starts, stops = samples.offsets[:count].tolist(), ends[:count].tolist()
    return [data[start:stop] for start, stop in zip(starts, stops, strict=True)]
