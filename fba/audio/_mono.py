"""Sound as a single channel at a rate, in blocks, for those that listen to it."""

from __future__ import annotations

import importlib.util
import wave
from collections.abc import Iterator
from math import gcd

import numpy as np

from fba.arrays import Float32, Int16
from fba.atomic import PathLike
from fba.audio._sound_file import SoundFile
from fba.errors import DisplayError, FbaError

BLOCK_SECONDS = 1.0


def read_mono(path: PathLike, rate: int) -> Iterator[Int16]:
    """Yield the samples of a file as int16 (N,), about a second at a time, all channels mixed.

    rate: samples per second to resample to. Any file that FFmpeg reads; without PyAV, WAV files with 16 bits.

    Raises FormatError for a file that is no sound, DisplayError without PyAV for files that need it.
    """
    if importlib.util.find_spec("av") is None:
        yield from _read_wave(path, rate)
        return
    with SoundFile(path, (rate,)) as sound:
        block, start = round(BLOCK_SECONDS * rate), 0
        while len(samples := sound.read(start, block)):
            start += len(samples)
            yield samples[:, 0].copy() if sound.mono else mix(samples)


def find_duration(path: PathLike) -> float | None:
    """Return the seconds that a file states; None where it does not, or cannot be read. Raises nothing."""
    try:
        if importlib.util.find_spec("av") is None:
            with wave.open(str(path), "rb") as file:
                return file.getnframes() / file.getframerate()
        with SoundFile(path) as sound:
            return sound.duration
    except (FbaError, OSError, EOFError, wave.Error, ZeroDivisionError):
        return None


def mix(samples: Int16) -> Int16:
    """Return the mean (N,) of the channels of samples (N, channels)."""
    return np.asarray(samples.astype(np.int32).mean(axis=1).round(), dtype=np.int16)


def _read_wave(path: PathLike, rate: int) -> Iterator[Int16]:
    """Yield the samples of a WAV file, by the standard library alone."""
    needed = 'sound other than WAV with 16 bits needs PyAV: pip install "mpeg4-fba[films]"'
    try:
        with wave.open(str(path), "rb") as file:
            width, channels, own = file.getsampwidth(), file.getnchannels(), file.getframerate()
            if width != 2 or not 1000 <= own <= 200_000:
                raise DisplayError(f"{path}: {width * 8} bits at {own} Hz; {needed}")
            resampler = Resampler(own, rate)
            while data := file.readframes(own):
                samples = np.frombuffer(data[: len(data) // (2 * channels) * 2 * channels], dtype="<i2")
                yield resampler(mix(samples.reshape(-1, channels)))
            yield resampler(np.zeros(0, dtype=np.int16), last=True)
    except (wave.Error, EOFError) as error:
        raise DisplayError(f"{path}: {error or 'is cut off'}; {needed}") from error


class Resampler:
    """Converts samples from one rate to another, block by block, as if they were converted at once.

    source, target: samples per second. It holds back a hundredth of a second, or a period of both
    rates where that is longer, since its filter needs what follows.
    """

    def __init__(self, source: int, target: int) -> None:
        common = gcd(source, target)
        self._up, self._down = target // common, source // common
        self._margin = -(-source // 100 // self._down) * self._down  # whole periods
        self._held: Float32 = np.zeros(0, dtype=np.float32)
        self._done = 0  # samples of those held that were converted

    def __call__(self, samples: Int16, *, last: bool = False) -> Int16:
        """Return the samples int16 that are certain now. last: nothing follows."""
        if self._up == self._down:
            return samples
        from scipy.signal import resample_poly

        held = np.concatenate([self._held, samples.astype(np.float32)])
        certain = (len(held) - self._margin) // self._down * self._down
        end = len(held) if last else max(certain, self._done)
        if end == self._done:
            self._held = held
            return np.zeros(0, dtype=np.int16)
        made = resample_poly(held, self._up, self._down)
        made = made[self._done // self._down * self._up : -(-end * self._up // self._down)]
        start = max(end - self._margin, 0)
        self._held, self._done = held[start:], end - start
        return np.asarray(np.clip(np.rint(made), -32768, 32767), dtype=np.int16)
