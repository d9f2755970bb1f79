"""Long recordings in pieces that end in pauses, so that memory and errors stay small."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from fba.arrays import Float64, Int16

RATE = 16_000
"""Samples per second that the recogniser takes."""
SHORTEST, LONGEST = 6.0, 20.0
"""Seconds of a piece, except the last."""
WINDOW = 0.25
"""Seconds of the pause that is looked for."""
STEP = RATE // 100


def cut_at_pauses(blocks: Iterable[Int16]) -> Iterator[tuple[float, Int16, bool]]:
    """Yield begin in seconds, samples int16 (N,) and whether it is the last, of pieces of 6 to 20 s.

    Each ends in the middle of the quietest quarter of a second that its length permits. blocks: 16 kHz.
    """
    start = 0
    waiting: list[Int16] = []
    size = 0
    for block in blocks:
        waiting.append(block)
        size += len(block)
        while size > (LONGEST + SHORTEST) * RATE:
            sound = np.concatenate(waiting)
            cut = _quietest(sound)
            yield start / RATE, sound[:cut], False
            waiting, start, size = [sound[cut:]], start + cut, size - cut
    sound = np.concatenate([np.zeros(0, dtype=np.int16), *waiting])
    if len(sound) > LONGEST * RATE:
        cut = _quietest(sound[:-RATE])
        yield start / RATE, sound[:cut], False
        start, sound = start + cut, sound[cut:]
    yield start / RATE, sound, True


def _quietest(sound: Int16) -> int:
    """Return the sample at which to cut, between the shortest and the longest piece."""
    levels = measure_loudness(sound[: round(LONGEST * RATE)])
    window = round(WINDOW * 100)
    means = np.convolve(levels, np.ones(window), "valid")
    first = min(round(SHORTEST * 100), len(means) - 1)
    return (first + int(np.argmin(means[first:])) + window // 2) * STEP


def measure_loudness(sound: Int16) -> Float64:
    """Return the loudness of each hundredth of a second, in dB below full scale, -96 for silence."""
    count = len(sound) // STEP
    frames = sound[: count * STEP].reshape(count, STEP).astype(np.float64)
    return np.asarray(10 * np.log10(np.maximum((frames**2).mean(axis=1) / 2.0**30, 10**-9.6)))
