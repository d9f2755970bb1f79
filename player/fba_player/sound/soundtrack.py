"""The sound track of a film: any part of an audio file."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from fba.arrays import Float32
from fba.atomic import PathLike
from fba.errors import FormatError
from fba_player.sound._pyav import import_av
from fba_player.sound.audio_file import open_sound

AAC_RATES = (96000, 88200, 64000, 48000, 44100, 32000, 24000, 22050, 16000, 12000, 11025, 8000)
AAC_FRAME = 1024
"""Samples of an AAC frame."""


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
