"""Any part of an audio file, decoded when it is read, so that long files need little memory.

PyAV decodes it, from version 12 on, which also encodes films (`import_av`).
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, Self

import numpy as np

from fba.arrays import Int16
from fba.atomic import PathLike
from fba.errors import DisplayError, FormatError, warn

CHANNELS = 2
PLAYABLE_RATES = (8000, 192_000)
"""Samples per second, least and most; other rates are resampled to `USUAL_RATE`."""
USUAL_RATE = 48_000
READABLE_RATES = (1000, 1_000_000)
"""Samples per second, least and most, that are read: resampling costs memory by the change of rate."""
RUN_UP_SECONDS = 0.5
"""Seconds decoded before the first sample that is read: MP3 and AAC frames need the ones before them."""
MIN_GAP_SECONDS = 0.02
"""Seconds by which the times in a file must exceed its count of samples to be taken as a gap."""
MAX_PACKET_SAMPLES = 1 << 24
"""Samples; a packet that decodes to more is damaged."""


def open_sound(av: Any, path: Path) -> tuple[Any, Any]:
    """Return the opened `av` container and its first audio stream; FormatError if no audio can be decoded."""
    # Tags may be in any encoding. From version 19 on, PyAV takes them as they are and has no argument for it.
    tags = {"metadata_errors": "replace"} if av_version(av) < 19 else {}
    try:
        empty = not path.stat().st_size
        container = None if empty else av.open(str(path), **tags)
    except (av.error.FFmpegError, OSError) as error:
        reason = getattr(error, "strerror", None) or error
        raise FormatError(f"cannot be read as sound: {reason}", path=path) from error
    if container is None:
        raise FormatError("is empty (0 bytes), not a sound file", path=path)
    if not container.streams.audio:
        container.close()
        raise FormatError("holds no sound", path=path)
    stream = container.streams.audio[0]
    if stream.codec_context is None:
        container.close()
        raise FormatError("contains sound in an unknown coding; convert it to WAV, FLAC or MP3", path=path)
    return container, stream


class SoundFile:
    """The first audio track of a file, as stereo samples at one rate.

    path: WAV, MP3, FLAC, OGG, M4A: anything that FFmpeg reads. rates: samples per second that need no
    resampling; by default those that devices play. Others become 48 kHz, or the highest of `rates` where 48
    kHz is not among them. rate: that of the samples. duration: seconds as stated in
    the file; None where it does not say. mono: whether there is one channel, which goes to both sides. More
    than two channels are mixed down. start: seconds at which the file presents the first sample.

    Use it from one thread at a time. Raises FormatError where it cannot be read or holds no sound.
    """

    _container: Any = None
    _stream: Any = None

    def __init__(self, path: PathLike, rates: Collection[int] = ()) -> None:
        av = self._av = import_av("sound needs")
        self.path = Path(path)
        self._damaged = False
        self._rates = rates
        self._open()
        self.rate = self._rate(int(self._stream.rate or 0))
        length, seconds = self._stream.duration, self._stream.time_base
        if length is None or not seconds:
            length, seconds = self._container.duration, Fraction(1, av.time_base)
        self.duration = None if length is None else max(float(length * seconds), 0.0)
        self.mono = self._stream.channels == 1
        self.start = float((self._stream.start_time or 0) * (self._stream.time_base or 0))
        self._first = 0  # sample that the first part since the last seek begins with
        self._parts: Iterator[Int16] = iter(())
        self._next: int | None = None  # sample that the next part begins with
        self._rest: Int16 = np.zeros((0, CHANNELS), dtype=np.int16)
        if not len(self.read(0, 1)):
            self.close()
            raise FormatError("holds no sound that can be decoded", path=path)

    def read(self, start: int, count: int) -> Int16:
        """Return the samples int16 (count, 2) from number `start` on; fewer where the sound ends."""
        start, missing = max(start, 0), max(count, 0)
        at, kept = self._next, len(self._rest)
        if at is None or not 0 <= start - at + kept <= kept + RUN_UP_SECONDS * self.rate:
            at = self._seek(start)
        pieces: list[Int16] = []
        while missing > 0:
            self._rest = self._rest[max(start - at + len(self._rest), 0) :]
            if not len(self._rest):
                part = next(self._parts, None)
                if part is None:
                    break
                self._rest, at = part, at + len(part)
                continue
            taken = self._rest[:missing]
            self._rest = self._rest[len(taken) :]
            pieces.append(taken)
            start, missing = start + len(taken), missing - len(taken)
        self._next = at
        return np.concatenate([np.zeros((0, CHANNELS), dtype=np.int16), *pieces])

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; safe to call twice."""
        self._parts = iter(())
        if self._container is not None:
            self._container.close()

    def _open(self) -> None:
        if self._container is not None:
            self._container.close()
        self._container, self._stream = open_sound(self._av, self.path)

    def _rate(self, rate: int) -> int:
        low, high = READABLE_RATES
        if not low <= rate <= high:
            raise FormatError(f"claims {rate} samples a second; {low} to {high} can be read", path=self.path)
        fits = rate in self._rates if self._rates else PLAYABLE_RATES[0] <= rate <= PLAYABLE_RATES[1]
        return (
            rate if fits else USUAL_RATE if not self._rates or USUAL_RATE in self._rates else max(self._rates)
        )

    def _seek(self, start: int) -> int:
        """Let `_parts` begin at or before a sample; return the number of the sample after `_rest`."""
        self._rest = self._rest[:0]
        before = max(start / self.rate - RUN_UP_SECONDS, 0.0)
        stream = self._stream
        if self._next is not None or before > 0:  # not for a file that has just been opened
            try:
                offset = round(before / stream.time_base) + (stream.start_time or 0)
                self._container.seek(offset, stream=stream)
            except (self._av.error.FFmpegError, OverflowError):
                self._open()  # it cannot seek: from its beginning
        self._first = start
        self._parts = self._decode_parts()
        self._rest = next(self._parts, self._rest)
        return self._first + len(self._rest)

    def _decode_parts(self) -> Iterator[Int16]:
        """Yield the parts (N, 2) from where the container is; set `_first` to the first sample's number."""
        stream = self._stream
        convert = _Converter(self._av, self.rate, mono=stream.channels == 1)
        begun, at = stream.start_time or 0, None
        for frame in self._frames():
            stated = None
            if frame.pts is not None and frame.time_base:
                stated = round(float((frame.pts - begun) * frame.time_base) * self.rate)
            if at is None:
                at, wanted = stated or 0, self._first
                late = 0 < at - wanted < MAX_PACKET_SAMPLES
                self._first = wanted if late else at
                if late:  # samples of the beginning that no decoder gives out: the coder's run-up
                    yield np.zeros((at - wanted, CHANNELS), dtype=np.int16)
            elif stated is not None and MIN_GAP_SECONDS * self.rate < stated - at < MAX_PACKET_SAMPLES:
                yield np.zeros((stated - at, CHANNELS), dtype=np.int16)
                at = stated
            frame.pts = None
            try:
                parts = convert(frame)
            except (self._av.error.FFmpegError, ValueError) as error:
                self._warn(error)
                continue
            for part in parts:
                at += len(part)
                yield part
        if at is not None:
            try:
                yield from convert(None)
            except self._av.error.FFmpegError as error:
                self._warn(error)

    def _frames(self) -> Iterator[Any]:
        """Yield the decoded frames; damaged ones are left out, with a warning the first time."""
        error_type = self._av.error.FFmpegError
        packets = self._container.demux(self._stream)
        while True:
            try:
                packet = next(packets, None)
            except error_type as error:
                self._warn(error)
                return
            if packet is None:
                return
            try:
                frames = packet.decode()
            except (error_type, ValueError) as error:  # ValueError: an unknown codec
                if not isinstance(error, EOFError):
                    self._warn(error)
                continue
            for frame in frames:
                if 0 < frame.samples <= MAX_PACKET_SAMPLES:
                    yield frame

    def _warn(self, error: Exception) -> None:
        if not self._damaged:
            self._damaged = True
            warn(f"{self.path}: part of the sound is damaged and left out: {error}", stacklevel=2)


class _Converter:
    """Converts decoded frames to samples (N, 2) at one rate; the format of frames may change on the way."""

    def __init__(self, av: Any, rate: int, *, mono: bool) -> None:
        self._av = av
        self._rate = rate
        self._sides = 1 if mono else CHANNELS  # mixing would make mono softer
        self._resampler = self._new_resampler()

    def __call__(self, frame: Any) -> list[Int16]:
        """Return the samples of a frame; for None, those that the resampler still holds back."""
        try:
            pieces = self._resampler.resample(frame)
        except ValueError:  # another format than before
            rest = self._resampler.resample(None)
            self._resampler = self._new_resampler()
            pieces = rest + self._resampler.resample(frame)
        parts = []
        for piece in pieces:
            samples = np.asarray(piece.to_ndarray(), dtype=np.int16).reshape(-1, self._sides)
            parts.append(np.broadcast_to(samples, (len(samples), CHANNELS)))
        return parts

    def _new_resampler(self) -> Any:
        layout = "mono" if self._sides == 1 else "stereo"
        return self._av.AudioResampler(format="s16", layout=layout, rate=self._rate)


def import_av(purpose: str = "films need") -> Any:
    """Return the module `av`; DisplayError without it. purpose: the beginning of its message."""
    try:
        import av
    except ImportError as error:
        raise DisplayError(
            f"{purpose} the Python package av (PyAV), which cannot be imported: {error}. "
            'Install it with: pip install "mpeg4-fba[films]"'
        ) from error
    return av


def av_version(av: Any) -> int:
    """Return the major version of PyAV."""
    return int(av.__version__.split(".")[0])
