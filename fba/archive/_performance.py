"""`Performance`: a row of an archive; and how one is made of a file."""

from __future__ import annotations

import os
from bisect import bisect_right
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from fractions import Fraction
from hashlib import sha256
from itertools import pairwise

import numpy as np

from fba.animation import Animation
from fba.archive._sources import Source
from fba.codec import EncoderOptions, count_rounded, decode, digest, exact_quantisers, marked_table
from fba.errors import BitstreamError, FbaError, LimitError
from fba.formats import format_of
from fba.formats.step_choice import choose_steps
from fba.limits import DEFAULT_LIMITS
from fba.parameters import BapTable
from fba.planning import encode
from fba.serving import split_stream
from fba.source import naming_file, read_whole

OBJECT_CODE = b"\0\0\1\xba"
END_CODE = b"\0\0\1\xb1"
DEFAULT_PERIOD = 4.0
"""Seconds from one I plane to the next of what is encoded for an archive."""
MOST_BYTES = 1 << 28
"""Largest stream of a row, and largest sound, in bytes."""
UNITS = ("IRISD", "ES", "ENS", "MNS", "MW")
"""FAPU that are lengths, in metres."""


@dataclass(frozen=True)
class Coding:
    """How files become streams.

    period: seconds from one I plane to the next; None: 4 of files that are encoded, and streams keep their
    bytes. tolerance: metres, as of `fba.encode`; None: every value is kept. fap_quant, bap_quant: quantisers
    in place of exact values.
    """

    period: float | None = None
    tolerance: float | None = None
    fap_quant: int | None = None
    bap_quant: int | None = None

    @property
    def keeps_streams(self) -> bool:
        """Whether streams are stored byte for byte."""
        return (self.period, self.tolerance, self.fap_quant, self.bap_quant) == (None, None, None, None)


@dataclass(frozen=True, kw_only=True)
class Performance:
    """A performance of an archive.

    name: its path below the folder that it was read from, without the suffix. subject, labels: from a table
    or the names of folders. stream: FBA, complete. rate: frames per second. frames: frame periods from its
    first frame to its last; frame t is shown at t / rate seconds. planes: frames that are sent, fewer where
    players fill them in.

    bap_steps: table of BAP steps, for `fba.decode`. start_frames, start_bytes: I planes at which decoding can
    begin: numbers of frames, ascending, the first 0, and bytes of the stream. A decoder is given the object
    start code 00 00 01 ba and the stream from that byte on. units: metres of a face that FAPs are scaled by,
    IRISD, ES, ENS, MNS and MW; empty without a face. digest: `fba.codec.digest` of the decoded values.

    source: the file that it was made of, below its folder. key: SHA-256 of that file and of the settings.
    sound_name: a sound file beside it; sound: its bytes, where they are stored; None otherwise.
    """

    name: str
    stream: bytes = field(repr=False)
    rate: Fraction
    frames: int
    planes: int
    face: bool
    body: bool
    bap_steps: BapTable = "iso"
    start_frames: tuple[int, ...] = (0,)
    start_bytes: tuple[int, ...] = (4,)
    units: dict[str, float] = field(default_factory=dict)
    digest: str = ""
    subject: str | None = None
    labels: dict[str, str] = field(default_factory=dict)
    source: str = ""
    key: str = ""
    sound_name: str | None = None
    sound: bytes | None = field(default=None, repr=False)

    @property
    def seconds(self) -> float:
        """Duration, from the first frame to one period after the last."""
        return float(self.frames / self.rate)

    @property
    def size(self) -> int:
        """Bytes of the stream and of the sound."""
        return len(self.stream) + len(self.sound or b"")

    def decode(self) -> Animation:
        """Return the animation. Raises BitstreamError, LimitError."""
        with _naming(self.name):
            return decode(self.stream, bap_steps=self.bap_steps)

    def decode_frames(self, first: int, last: int) -> Animation:
        """Return the frames from `first` to `last`, both included, and others around them.

        Index 0 is the first frame of the performance. Decoding begins at the last I plane before `first` at
        which it can. Where frames are left out of the stream, the next one that is sent is among the result.
        """
        with _naming(self.name):
            part, begin = self._decode_around(first, last)
        index = part.index - part.index[0] + begin
        if part.rate != self.rate or index[-1] < min(last, self.frames - 1):
            raise BitstreamError(
                f"{self.name}: the stream does not hold frames {first} to {last}, as its row says: the row "
                "and the stream do not belong together; make the archive again"
            )
        return Animation(part.rate, index, part.face, part.body, self.name)

    def _decode_around(self, first: int, last: int) -> tuple[Animation, int]:
        """Return frames around those from `first` to `last`, and the number of the first of them."""
        if len(self.start_frames) == 1:
            return decode(self.stream, bap_steps=self.bap_steps), 0
        at = max(bisect_right(self.start_frames, first) - 1, 0)
        after = bisect_right(self.start_frames, last) + (self.planes != self.frames)
        begin = self.start_bytes[at]
        # The mark behind the object, with the checks of all I periods, is not for a part of it.
        end = self.start_bytes[after] if after < len(self.start_bytes) else self.stream.find(END_CODE, begin)
        part = self.stream[begin : end if end >= 0 else None]
        return decode(OBJECT_CODE + part + END_CODE, bap_steps=self.bap_steps), self.start_frames[at]


@contextmanager
def _naming(name: str) -> Iterator[None]:
    """Name the performance in errors about its stream."""
    try:
        yield
    except (BitstreamError, LimitError) as error:
        if name not in error.finding:
            error.args = (f"{name}: {error.finding}",)
        raise


@dataclass(frozen=True)
class Made:
    """A performance made of a file. rounded: number of values that the stream does not hold exactly."""

    performance: Performance
    rounded: int = 0


def key_of(source: Source, data: bytes, coding: Coding, units: dict[str, float]) -> str:
    """Return the key of a file's content, its labels and the settings."""
    settings = repr((1, source.name, source.subject, sorted(source.labels.items()), coding, units))
    return sha256(settings.encode() + b"\0" + data).hexdigest()


def make_performance(source: Source, coding: Coding, units: dict[str, float], key: str) -> Made:
    """Return the performance in a file.

    units: of the face. key: as of `key_of`. Raises an FbaError for a file that cannot be read or encoded.
    """
    path = source.path
    reader = format_of(path)
    rounded = 0
    if reader.name == "fba":
        stream = read_whole(path)
        with naming_file(path):
            table = marked_table(stream) or choose_steps(stream).table
            animation = decode(stream, bap_steps=table)
            if not coding.keeps_streams:
                stream, rounded = _encode(animation, coding, table)
                animation = decode(stream, bap_steps=table)
    else:
        given = reader.read(path)
        captured = reader.is_capture or reader.read_person is not None
        table = "visage" if captured and given.body is not None else "iso"
        with naming_file(path):
            if not len(given):
                raise BitstreamError("the file holds no frames; a stream needs one")
            stream, rounded = _encode(given, coding, table)
            animation = decode(stream, bap_steps=table)
    if len(stream) > MOST_BYTES:
        raise LimitError(
            f"{os.fspath(path)}: its stream has {len(stream)} bytes, more than the {MOST_BYTES} of a row; "
            "cut it into shorter performances",
            limit="bytes", found=len(stream), allowed=MOST_BYTES,
        )  # fmt: skip
    frames, places = find_starts(stream, animation, table)
    performance = Performance(
        name=source.name, stream=stream, rate=animation.rate,
        frames=int(animation.index[-1] - animation.index[0]) + 1, planes=len(animation),
        face=animation.face is not None, body=animation.body is not None, bap_steps=table,
        start_frames=frames, start_bytes=places, units=units if animation.face is not None else {},
        digest=digest(animation), subject=source.subject, labels=dict(source.labels),
        source=source.shown, key=key, sound_name=source.sound_name,
    )  # fmt: skip
    return Made(performance, rounded)


def _encode(animation: Animation, coding: Coding, table: BapTable) -> tuple[bytes, int]:
    """Return the stream of an animation, and how many values it rounds where they were to be kept."""
    quantisers = {"face": coding.fap_quant, "body": coding.bap_quant}
    parts = [part for part, quantiser in quantisers.items() if quantiser is None]
    options = EncoderOptions(
        fap_quant=1 if coding.fap_quant is None else coding.fap_quant,
        bap_quant=1 if coding.bap_quant is None else coding.bap_quant,
        intra_period=coding.period or DEFAULT_PERIOD,
        start_codes=True,
        bap_steps=table,
    )
    if coding.tolerance is not None:
        return encode(animation, options, tolerance=coding.tolerance), 0
    options = exact_quantisers(animation, options, parts)
    rounded = sum(count for part, count in count_rounded(animation, options).items() if part in parts)
    return encode(animation, options), rounded


def find_starts(
    stream: bytes, animation: Animation, table: BapTable
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Return the I planes at which decoding can begin: numbers of frames, and bytes of the stream.

    From there on, a decoder gets the same values, and a player shows the same: the I plane sends everything
    that was sent before it, and no viseme or expression was redefined.
    """
    planes, _ = split_stream(stream, table, DEFAULT_LIMITS)
    complete = _complete(animation)
    starts: list[tuple[int, int]] = []
    position, rate = 0, float(animation.rate)
    whole = all(plane.rate == rate for plane in planes) and not any(plane.fresh for plane in planes[1:])
    for plane in (
        planes if whole else planes[:1]
    ):  # else several objects, which are decoded from the beginning
        position = stream.index(plane.data, position) + len(plane.data)
        if not plane.opening:
            continue
        content = len(plane.opening) - plane.opening.index(OBJECT_CODE) - len(OBJECT_CODE)
        frame = round((plane.time - planes[0].time) * rate)
        row = int(np.searchsorted(animation.index, animation.index[0] + frame))
        sent = row < len(animation) and animation.index[row] == animation.index[0] + frame
        if sent and complete[row]:
            starts.append((frame, position - content))
    if not starts or starts[0][0] != 0 or any(a[0] >= b[0] for a, b in pairwise(starts)):
        raise BitstreamError("the stream does not begin with an I plane that can be decoded", plane=0)
    return tuple(frame for frame, _ in starts), tuple(place for _, place in starts)


def _complete(animation: Animation) -> np.ndarray:
    """Return bool (T,): frames that send all that was sent before, and behind no definition."""
    complete = np.ones(len(animation), dtype=bool)
    for track in (animation.face, animation.body):
        if track is not None:
            before = np.logical_or.accumulate(track.mask, axis=0)
            complete &= (track.mask | ~before).all(axis=1)
    face = animation.face
    if face is not None:
        defines = (face.mask[:, 0] & (face.viseme[:, 3] == 1)) | (
            face.mask[:, 1] & (face.expression[:, 5] == 1)
        )
        complete[1:] &= ~np.logical_or.accumulate(defines)[:-1]
        if face.interpolated is not None:
            asked = np.logical_or.accumulate(face.interpolated, axis=0)
            complete &= (face.interpolated | face.mask | ~asked).all(axis=1)
    return complete


def check_performance(performance: Performance) -> list[str]:
    """Return what is wrong with a performance: its stream, its digest, the places where decoding begins."""
    try:
        whole = performance.decode()
    except FbaError as error:
        return [f"the stream cannot be decoded: {error.finding}"]
    faults = []
    if digest(whole) != performance.digest:
        faults.append("its values are not those of its digest")
    span = int(whole.index[-1] - whole.index[0]) + 1
    parts = (whole.face is not None, whole.body is not None)
    if (whole.rate, span, len(whole), *parts) != (
        performance.rate, performance.frames, performance.planes, performance.face, performance.body
    ):  # fmt: skip
        faults.append("rate, frames or parts are not those of its stream")
        return faults
    for frame in performance.start_frames[1:]:
        try:
            part = performance.decode_frames(frame, frame)
        except FbaError as error:
            faults.append(f"decoding cannot begin at frame {frame}: {error.finding}")
            continue
        row = int(np.searchsorted(whole.index - whole.index[0], part.index[0]))
        same = whole[row : row + len(part)]
        if (same.face, same.body) != (part.face, part.body):
            faults.append(f"decoding from frame {frame} gives other values")
    return faults
