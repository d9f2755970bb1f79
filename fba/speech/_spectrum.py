"""What the mouth makes, by the spectrum of the sound alone: rough, but at once, and in any language.

Levels in bands around each hundredth of a second are weighed for each viseme: a linear discriminant, whose
weights `tools/fit_spectrum.py` fits to speech.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from fba.arrays import Float64, Int16
from fba.speech._pieces import RATE, STEP
from fba.speech._sounds import Phone
from fba.speech._timings import PHONES
from fba.text_files import packaged_rows

BANDS = 12
LOWEST, HIGHEST = 100.0, 7000.0
"""Hz of the bands, which are as wide as those of the ear (mel)."""
WINDOW = 512
"""Samples of a spectrum, around the middle of its hundredth of a second."""
OFFSETS = (-6, -3, 0, 3, 6)
"""Hundredths of a second from the one that is judged to those whose levels are weighed."""
SMOOTH = 2
"""Hundredths of a second before and after whose scores count, too."""
LOOK_AHEAD = OFFSETS[-1] + SMOOTH
"""Hundredths of a second that must be known before and behind the one that is judged."""
FLOOR = -40.0
"""dB below the mean of speech: all that is softer counts as silence."""
PRIOR, MEMORY = 60.0, 600.0
"""Hundredths of a second for which the usual speaker counts, and after which a voice is forgotten."""
FORGET = 0.03
"""dB by which the loudest level falls in a hundredth of a second without speech."""
QUIET = 40.0
"""dB below the loudest band at which nobody speaks any more."""
SILENT = 30.0
"""Level, dB above one unit of 16 bits squared in a band, under which there is no speech."""


Weights = tuple[Float64, Float64, Float64]


@cache
def read_weights() -> Weights:
    """Return weights (offsets x bands, 15), constants (15,), and levels of the usual speaker (bands,)."""
    rows = packaged_rows(__package__, "spectrum.csv")
    weights = np.array([[float(row[str(viseme)]) for viseme in range(15)] for row in rows])
    usual = np.array([float(row["usual"]) for row in rows[:-1] if row["offset"] == "0"])
    return weights[:-1], weights[-1], usual


@cache
def _bank() -> Float64:
    """Return the weights (bins, bands) of triangular bands."""
    mel = np.linspace(np.log1p(LOWEST / 700), np.log1p(HIGHEST / 700), BANDS + 2)
    edges = 700 * np.expm1(mel) * WINDOW / RATE
    low, middle, high = edges[:-2], edges[1:-1], edges[2:]
    bins = np.arange(WINDOW // 2 + 1)[:, None]
    rising, falling = (bins - low) / (middle - low), (high - bins) / (high - middle)
    return np.asarray(np.clip(np.minimum(rising, falling), 0, None))


def measure_bands(sound: Int16) -> Float64:
    """Return levels in bands (N, bands), dB, of all windows of a sound, a hundredth of a second apart."""
    if len(sound) < WINDOW:
        return np.zeros((0, BANDS))
    windows = np.lib.stride_tricks.sliding_window_view(sound.astype(np.float64), WINDOW)[::STEP]
    power = np.abs(np.fft.rfft(windows * np.hanning(WINDOW), axis=1)) ** 2 / WINDOW
    return np.asarray(10 * np.log10(power @ _bank() + 1.0))


def gather(levels: Float64) -> Float64:
    """Return what is weighed (N - 12, offsets x bands), of all rows but those at both ends.

    levels: (N, bands), above the speaker's mean.
    """
    middle = np.arange(-OFFSETS[0], max(len(levels) - OFFSETS[-1], -OFFSETS[0]))
    near = np.maximum(levels, FLOOR)[middle[:, None] + np.array(OFFSETS)]
    return np.asarray(near.reshape(len(middle), BANDS * len(OFFSETS)))


class Spectrum:
    """Visemes of a sound that comes piece by piece. table: as of `read_weights`, by default the one there."""

    def __init__(self, table: Weights | None = None) -> None:
        self._weights, self._constants, usual = table or read_weights()
        self._sum, self._weight = usual * PRIOR, PRIOR
        self._loudest = float(usual.max())
        self._sound: Int16 = np.zeros((WINDOW - STEP) // 2, dtype=np.int16)
        self._levels: Float64 = np.zeros((LOOK_AHEAD, BANDS))  # of the rows that are still needed
        self._judged = 0

    def push(self, sound: Int16) -> list[Phone]:
        """Return a phone, which shows the viseme, for each hundredth of a second that is certain now.

        sound: int16 (N,). stress: by the loudness, 0.6 to 1.1.
        """
        heard = np.concatenate([self._sound, sound])
        levels = measure_bands(heard)
        self._sound = heard[len(levels) * STEP :]
        rows = np.concatenate([self._levels, levels])
        count = len(rows) - 2 * LOOK_AHEAD
        if count <= 0:
            self._levels = rows
            return []
        self._levels = rows[count:]
        loud = rows[LOOK_AHEAD : LOOK_AHEAD + count].max(axis=1)
        self._loudest = max(self._loudest - FORGET * count, float(loud.max()))
        spoken = (loud > self._loudest - QUIET) & (loud > SILENT)
        self._learn(rows[LOOK_AHEAD : LOOK_AHEAD + count][spoken])
        scores = gather(rows - self._sum / self._weight) @ self._weights + self._constants
        smooth = np.lib.stride_tricks.sliding_window_view(scores, 2 * SMOOTH + 1, axis=0).sum(axis=-1)
        visemes = np.where(spoken, smooth.argmax(axis=1), 0)
        sizes = np.clip(1.1 + (loud - self._loudest) / QUIET, 0.6, 1.1)
        first, self._judged = self._judged, self._judged + count
        return [
            Phone(PHONES[viseme], at / 100, (at + 1) / 100, size)
            for at, viseme, size in zip(
                range(first, self._judged), visemes.tolist(), sizes.tolist(), strict=True
            )
        ]

    def _learn(self, levels: Float64) -> None:
        """Move the mean of the speaker."""
        self._sum, self._weight = self._sum + levels.sum(axis=0), self._weight + len(levels)
        if self._weight > MEMORY:
            self._sum, self._weight = self._sum * (MEMORY / self._weight), MEMORY
