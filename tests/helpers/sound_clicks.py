"""Sound files, such with one click, and where the click is in a film.

Sounds like speech, for which no program must be installed.
"""

import wave
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from fba.arrays import Int16
from fba.speech import RATE


def write_wave(
    path: Path, samples: ArrayLike | bytes, rate: int = 16000, channels: int = 1, width: int = 2
) -> Path:
    """Write samples (N,) or (N, channels) of 16 bits, or bytes as they are; returns the path."""
    with wave.open(str(path), "wb") as file:
        file.setparams((channels, width, rate, 0, "NONE", ""))
        file.writeframes(samples if isinstance(samples, bytes) else np.asarray(samples, "<i2").tobytes())
    return path


def write_click(path: Path, at: float, *, seconds: float = 1.0, rate: int = 48000, channels: int = 1) -> Path:
    """Silence with a click of 2 ms."""
    samples = np.zeros((round(seconds * rate), channels), dtype="<i2")
    first = round(at * rate)
    samples[first : first + rate // 500] = 30000
    return write_wave(path, samples, rate, channels)


def sound(path: Path) -> tuple[float, np.ndarray, int]:
    """Time of the first sample, samples (N,) of one channel, rate."""
    import av

    with av.open(str(path)) as film:
        frames = list(film.decode(audio=0))
    samples = np.concatenate([frame.to_ndarray()[0] for frame in frames])
    return float(frames[0].time), samples, frames[0].sample_rate


def click_time(path: Path) -> float:
    """When the sound is first half as loud as at its loudest."""
    start, samples, rate = sound(path)
    loud = np.abs(samples)
    return start + float(np.argmax(loud > loud.max() / 2)) / rate


def babble(seconds: float = 3.0) -> Int16:
    """Return tones that come and go, in soft noise."""
    rng = np.random.default_rng(2)
    times = np.arange(round(seconds * RATE)) / RATE
    tones = np.sum([np.sin(2 * np.pi * hertz * times) for hertz in (140, 560, 1680)], axis=0)
    loud = np.clip(np.sin(2 * np.pi * 3 * times), 0, 1)
    return np.asarray(3000 * loud * tones + rng.normal(0, 40, len(times)), dtype=np.int16)
