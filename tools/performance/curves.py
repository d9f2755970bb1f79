"""Curves over time: keys with eased passages, smoothing, and slow wandering that repeats with the loop."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import gaussian_filter1d

Float = npt.NDArray[np.float64]

FOLDER = Path(__file__).parent
SECONDS = 9.6
"""Length of the performance; its end joins its beginning."""
RATE = 300
"""Moments a second at which everything is worked out: a multiple of 60 (body) and of 25 (face)."""
GOLDEN = 0.6180339887498949


def moments() -> Float:
    """(2880,) seconds."""
    return np.arange(round(SECONDS * RATE)) / RATE


def rows(name: str) -> list[dict[str, str]]:
    """A table beside this module."""
    with (FOLDER / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def pairs(text: str) -> tuple[list[float], list[str]]:
    """Times and what stands at them: "0:rest 1.2:wave" -> [0.0, 1.2], ["rest", "wave"]."""
    parts = [word.split(":") for word in text.split()]
    return [float(time) for time, _ in parts], [value for _, value in parts]


def keyed(text: str, softness: float = 0.05) -> Float:
    """(2880,) through keys like "0:0 1.2:8 2:8", eased at every turn and hold, the last value held.

    softness: seconds over which corners of the speed are rounded off.
    """
    times, values = pairs(text)
    numbers = [float(value) for value in values]
    times = [times[0] - 1, *times, max(times[-1], SECONDS) + 1]
    numbers = [numbers[0], *numbers, numbers[-1]]
    curve: Float = PchipInterpolator(times, numbers)(moments())
    return smooth(curve, softness)


def smooth(values: Float, seconds: float) -> Float:
    """A bell-shaped average along time (first axis), around the loop."""
    if seconds <= 0:
        return values
    result: Float = gaussian_filter1d(values, seconds * RATE, axis=0, mode="wrap", truncate=4.0)
    return result


def late(values: Float, seconds: float) -> Float:
    """The same, later: what hangs on a moving part follows it."""
    return np.roll(values, round(seconds * RATE), axis=0)


def wander(seed: int, slowest: int = 1, fastest: int = 7) -> Float:
    """(2880,) about -1..1, aimless: sines that fit whole into the loop, the faster the smaller."""
    turns = 2 * np.pi * moments() / SECONDS
    total = np.zeros(len(turns))
    for cycles in range(slowest, fastest + 1):
        phase = 2 * np.pi * ((seed * 7 + cycles) * GOLDEN % 1.0)
        total += np.sin(cycles * turns + phase) * (slowest / cycles) ** 0.8
    return total / 2


def tracks(name: str) -> dict[str, Float]:
    """All channels of a table of keys (channel, softness, keys)."""
    return {row["channel"]: keyed(row["keys"], float(row["softness"])) for row in rows(name)}
