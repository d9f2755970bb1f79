"""Loudness and pitch of speech, measured while its sound passes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from fba.arrays import Float32, Float64, Int16
from fba.speech._pieces import RATE, STEP, measure_loudness

WINDOW = 640
"""Samples of the window in which the pitch is measured: two periods of 50 Hz."""
LOWEST, HIGHEST = 70, 400
"""Hz of voices."""
FULL = 32_760
"""Least magnitude of a sample at full scale."""
VOICED = 0.45
"""Least autocorrelation of a window with a pitch."""


class Prosody:
    """Loudness (dB) and pitch (semitones above 70 Hz, NaN without) of each hundredth of a second."""

    def __init__(self) -> None:
        self._samples = self._full = 0
        self._loudness: list[Float32] = []
        self._pitch: list[Float32] = []
        self._rest: Int16 = np.zeros(0, dtype=np.int16)

    def watch(self, blocks: Iterable[Int16]) -> Iterator[Int16]:
        """Yield the blocks, int16 (N,) at 16 kHz, and measure them."""
        for block in blocks:
            sound = np.concatenate([self._rest, block])
            whole = len(sound) // STEP * STEP
            self._rest = sound[whole:]
            self._loudness.append(measure_loudness(sound[:whole]).astype(np.float32))
            self._pitch.append(_measure_pitch(sound[:whole]))
            self._samples += len(block)
            self._full += int((np.abs(block.astype(np.int32)) >= FULL).sum())
            yield block

    @property
    def clipped(self) -> float:
        """Share of samples at full scale."""
        return self._full / max(self._samples, 1)

    def mean(self, start: float, end: float) -> tuple[float, float]:
        """Return loudness and pitch from one second to another, (nan, nan) where nothing was measured."""
        self._join()
        part = slice(max(int(start * 100), 0), max(int(end * 100), int(start * 100) + 1))
        loudness, pitch = self._loudness[0][part], self._pitch[0][part]
        pitch = pitch[~np.isnan(pitch)]
        return (
            float(loudness.mean()) if len(loudness) else np.nan,
            float(np.median(pitch)) if len(pitch) else np.nan,
        )

    def _join(self) -> None:
        if len(self._loudness) != 1:
            self._loudness = [np.concatenate([np.zeros(0, np.float32), *self._loudness])]
            self._pitch = [np.concatenate([np.zeros(0, np.float32), *self._pitch])]


def _measure_pitch(sound: Int16) -> Float32:
    """Return the pitch of each step by the autocorrelation of the window around it."""
    count = len(sound) // STEP
    padded = np.pad(sound.astype(np.float64), (WINDOW // 2, WINDOW // 2))
    windows = np.lib.stride_tricks.sliding_window_view(padded, WINDOW)[STEP // 2 :: STEP][:count]
    windows = windows - windows.mean(axis=1, keepdims=True)
    power = np.abs(np.fft.rfft(windows, 2 * WINDOW, axis=1)) ** 2
    correlation: Float64 = np.fft.irfft(power, axis=1)[:, : RATE // LOWEST + 1]
    lags = correlation[:, RATE // HIGHEST :]
    best = lags.argmax(axis=1)
    strength = lags[np.arange(len(lags)), best] / np.maximum(correlation[:, 0], 1e-9)
    semitones = 12 * np.log2(RATE / (best + RATE // HIGHEST) / LOWEST)
    return np.where((strength > VOICED) & (correlation[:, 0] > 1e4 * WINDOW), semitones, np.nan).astype(
        np.float32
    )
