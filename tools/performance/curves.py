"""Curves over time: eased keys, smoothing, and slow wandering that repeats with the loop."""

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
"""Samples a second of all curves: a multiple of 60 (body) and of 25 (face)."""
GOLDEN = 0.6180339887498949


def sample_times() -> Float:
    """(2880,) times of the samples, seconds."""
    return np.arange(round(SECONDS * RATE)) / RATE


def read_table(name: str) -> list[dict[str, str]]:
    """The rows of a CSV table beside this module."""
    with (FOLDER / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def parse_schedule(text: str) -> tuple[list[float], list[str]]:
    """(times, values) of a schedule: "0:rest 1.2:wave" -> [0.0, 1.2], ["rest", "wave"]."""
    parts = [word.split(":") for word in text.split()]
    return [float(time) for time, _ in parts], [value for _, value in parts]


def keyed_curve(text: str, softness: float = 0.05) -> Float:
    """(2880,) curve through keys like "0:0 1.2:8 2:8", eased at every turn and hold, the last value held.

    softness: seconds over which changes of speed are smoothed.
    """
    times, values = parse_schedule(text)
    numbers = [float(value) for value in values]
    times = [times[0] - 1, *times, max(times[-1], SECONDS) + 1]
    numbers = [numbers[0], *numbers, numbers[-1]]
    curve: Float = PchipInterpolator(times, numbers)(sample_times())
    return smooth(curve, softness)


def smooth(values: Float, seconds: float) -> Float:
    """Values averaged by a Gaussian along time (first axis), around the loop."""
    if seconds <= 0:
        return values
    result: Float = gaussian_filter1d(values, seconds * RATE, axis=0, mode="wrap", truncate=4.0)
    return result


def delay(values: Float, seconds: float) -> Float:
    """Values delayed by some seconds around the loop, for parts that follow others."""
    return np.roll(values, round(seconds * RATE), axis=0)


def wander(seed: int, slowest: int = 1, fastest: int = 7) -> Float:
    """(2880,) aimless wandering, about -1..1: sines with whole periods in the loop, faster ones smaller."""
    turns = 2 * np.pi * sample_times() / SECONDS
    total = np.zeros(len(turns))
    for cycles in range(slowest, fastest + 1):
        phase = 2 * np.pi * ((seed * 7 + cycles) * GOLDEN % 1.0)
        total += np.sin(cycles * turns + phase) * (slowest / cycles) ** 0.8
    return total / 2


def read_tracks(name: str) -> dict[str, Float]:
    """The curves (2880,) of a table of keys (columns channel, softness, keys), by channel."""
    return {row["channel"]: keyed_curve(row["keys"], float(row["softness"])) for row in read_table(name)}
