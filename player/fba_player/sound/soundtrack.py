"""The sound track of a film: a part of an audio file, or what is heard while a window is recorded."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from fba.arrays import Float32, Int16
from fba.atomic import PathLike
from fba.audio import CHANNELS, SoundFile, import_av, open_sound
from fba.errors import FormatError
from fba_player.playback._transport import Transport
from fba_player.sound._mixer import SoundMixer

AAC_RATES = (96000, 88200, 64000, 48000, 44100, 32000, 24000, 22050, 16000, 12000, 11025, 8000)
AAC_FRAME = 1024
"""Samples of an AAC frame."""
PIECE_SECONDS = 1.0
"""Most seconds mixed at once."""


class FilmedSound(Protocol):
    """A source of samples for the sound track of a film."""

    rate: int
    channels: int
    layout: str

    def frames(self, samples: int) -> Iterator[Any]:
        """Return the next samples that are ready, as `av.AudioFrame`s ("fltp") without times."""

    def close(self) -> None:
        """Release its resources; safe to call twice."""


def find_sound_beside(path: PathLike) -> Path | None:
    """Return the WAV file of the same name in the folder of a stream; None if absent."""
    stream = Path(path)
    for suffix in (".wav", ".WAV", ".Wav"):
        sound = stream.with_suffix(suffix)
        if sound != stream and sound.is_file():
            return sound
    return None


class Soundtrack:
    """Samples of an audio file from a time on, then silence; a `FilmedSound`.

    path: anything that FFmpeg reads. start: seconds in the file; if negative, silence comes first. rate:
    samples per second, that of the file if AAC has it, else 48000. channels: 1 or 2.

    Raises FormatError where the file cannot be read or holds no sound.
    """

    def __init__(self, path: PathLike, start: Fraction) -> None:
        self._av = import_av()
        self._path = Path(path)
        self._container, stream = open_sound(self._av, self._path)
        self.rate = stream.rate if stream.rate in AAC_RATES else 48000
        self.channels = 1 if stream.channels == 1 else 2
        self.layout = "mono" if self.channels == 1 else "stereo"
        self._silence = max(round(-start * self.rate), 0)
        self._skip = max(round(start * self.rate), 0)
        self._stream = stream
        self._parts = self._decode_samples()
        self._rest: Float32 = np.zeros((self.channels, 0), dtype=np.float32)

    def close(self) -> None:
        """Close the file; safe to call twice."""
        self._parts.close()
        self._container.close()

    def frames(self, samples: int) -> Iterator[Any]:
        """Yield the next samples as `av.AudioFrame`s ("fltp") of at most `AAC_FRAME`, without times."""
        for start in range(0, samples, AAC_FRAME):
            yield make_frame(self._av, self.take(min(AAC_FRAME, samples - start)), self.layout, self.rate)

    def take(self, samples: int) -> Float32:
        """Return the next samples, float32 (channels, samples), -1..1; zeros after the end of the file."""
        while self._rest.shape[1] < samples:
            part = next(self._parts, None)
            if part is None:
                missing = samples - self._rest.shape[1]
                part = np.zeros((self.channels, missing), dtype=np.float32)
            self._rest = np.concatenate([self._rest, part], axis=1)
        taken, self._rest = self._rest[:, :samples], self._rest[:, samples:]
        return np.ascontiguousarray(taken)

    def _decode_samples(self) -> Any:
        while self._silence > 0:
            count = min(self._silence, AAC_FRAME)
            self._silence -= count
            yield np.zeros((self.channels, count), dtype=np.float32)
        resampler = self._av.AudioResampler(format="fltp", layout=self.layout, rate=self.rate)
        for frame in self._decode_frames(resampler):
            if self._skip >= frame.samples:
                self._skip -= frame.samples
                continue
            yield frame.to_ndarray()[:, self._skip :]
            self._skip = 0

    def _decode_frames(self, resampler: Any) -> Iterator[Any]:
        try:
            for frame in self._container.decode(self._stream):
                frame.pts = None  # the order counts: times in damaged files are wrong
                yield from resampler.resample(frame)
            yield from resampler.resample(None)
        except (self._av.error.FFmpegError, ValueError) as error:  # or its format changes on the way
            raise FormatError(f"the sound is damaged: {error}", path=self._path) from error


def make_frame(av: Any, samples: Float32, layout: str, rate: int) -> Any:
    """Return an `av.AudioFrame` ("fltp") of samples, float32 (channels, samples), without a time."""
    frame = av.AudioFrame.from_ndarray(samples, format="fltp", layout=layout)
    frame.sample_rate = rate
    return frame


def check_sound(path: PathLike) -> None:
    """Raise FormatError where a file cannot be read as sound."""
    Soundtrack(path, Fraction(0)).close()


class FilmSound:
    """Samples for a film of the window, with pauses and jumps as they are heard; a `FilmedSound`.

    path: an audio file. transport: what is played. offset: returns the seconds by which the sound begins
    after the first frame. muted: returns whether it is silent now.

    The window's thread calls `advance` and `end`, the encoder's `frames`. It needs no sound device. Raises
    FormatError where the file cannot be read.
    """

    def __init__(
        self,
        path: PathLike,
        transport: Transport,
        *,
        offset: Callable[[], float] = lambda: 0.0,
        muted: Callable[[], bool] = lambda: False,
    ) -> None:
        self.path = Path(path)
        self._av = import_av()
        self._file = SoundFile(path, rates=AAC_RATES)
        self.rate = self._file.rate
        self.channels, self.layout = CHANNELS, "stereo"
        self._transport, self._offset, self._muted = transport, offset, muted
        self._mixer = SoundMixer(self._take, self.rate, lambda: transport.motion, transport.start)
        self._mixed: deque[Int16] = deque()
        self._lock = threading.Lock()
        self._done = 0
        self._ended = False

    def advance(self, seconds: float) -> None:
        """Mix the sound up to a length of the film in seconds, which the transport has reached now."""
        now = self._transport.clock
        self._mixer.origin = self._transport.start + self._offset()
        self._mixer.muted = self._muted()
        missing = round(seconds * self.rate) - self._done
        while missing > 0:
            count = min(missing, round(PIECE_SECONDS * self.rate))
            samples = self._mixer.fill(now - missing / self.rate, count)
            with self._lock:
                self._mixed.append(samples)
            self._done += count
            missing -= count

    def end(self) -> None:
        """End the sound: the rest of the film is silent."""
        self._ended = True

    def frames(self, samples: int) -> Iterator[Any]:
        """Yield the next samples as far as they are mixed, as `av.AudioFrame`s ("fltp") without times."""
        while samples > 0:
            most = min(samples, AAC_FRAME)
            with self._lock:
                part = self._mixed.popleft() if self._mixed else None
                if part is not None and len(part) > most:
                    self._mixed.appendleft(part[most:])
            if part is None:
                if not self._ended:
                    return
                part = np.zeros((most, CHANNELS), dtype=np.int16)
            part = part[:most]
            samples -= len(part)
            block = np.ascontiguousarray(part.T, dtype=np.float32) / np.float32(32768)
            yield make_frame(self._av, block, self.layout, self.rate)

    def close(self) -> None:
        """Close the file; safe to call twice."""
        self._file.close()

    def _take(self, start: int, count: int) -> Int16:
        """Return the samples int16 (count, 2) of the file; zeros outside."""
        taken = np.zeros((count, CHANNELS), dtype=np.int16)
        first = min(max(-start, 0), count)
        samples = self._file.read(start + first, count - first)
        taken[first : first + len(samples)] = samples
        return taken
