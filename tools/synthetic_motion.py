"""Synthetic motion for the test vectors: the same integers on every machine and in every version.

Random modules may change their sequences, so the noise comes from a generator defined here.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from fba.animation import Animation, BodyTrack, FaceTrack
from fba.parameters import BAP_COUNT, BAP_STANDARD_COUNT, FAP_COUNT, BapTable, bap_steps, baps, faps

_MULTIPLIER, _INCREMENT, _MODULUS = 1664525, 1013904223, 1 << 32


def noise(seed: int) -> Iterator[float]:
    """Yield numbers in -1..1 from a linear congruential generator."""
    state = seed
    while True:
        state = (state * _MULTIPLIER + _INCREMENT) % _MODULUS
        yield state / (_MODULUS // 2) - 1


def wander(count: int, limits: tuple[int, int], step: int, source: Iterator[float]) -> list[int]:
    """Return a random walk of `count` values within limits x step, which rests half of the time."""
    low, high = limits[0] * step, limits[1] * step
    value = 0.0
    values = []
    for _ in range(count):
        if next(source) > 0:
            value += next(source) * (high - low) / 40
        value = min(max(value, low), high)
        values.append(int(value))
    return values


def face(
    frames: int, *, faps_sent: tuple[int, ...] = tuple(range(3, 69)), seed: int = 1, high_level: bool = False
) -> FaceTrack:
    """Return a face whose FAPs walk within the standard's ranges. high_level: also viseme and expression."""
    source = noise(seed)
    values = np.zeros((frames, FAP_COUNT), dtype=np.int32)
    mask = np.zeros((frames, FAP_COUNT), dtype=bool)
    for number in faps_sent:
        fap = faps()[number - 1]
        assert fap.i_limits is not None
        values[:, number - 1] = wander(frames, fap.i_limits, fap.step, source)
        mask[:, number - 1] = True
    viseme = np.zeros((frames, 4), dtype=np.int16)
    expression = np.zeros((frames, 6), dtype=np.int16)
    if high_level:
        mask[:, :2] = True
        for frame in range(frames):
            viseme[frame] = (frame // 3 % 15, frame // 2 % 15, frame * 7 % 64, frame % 5 == 4)
            expression[frame] = (
                frame // 4 % 7, frame * 5 % 64, frame // 5 % 7, 63 - frame % 64,
                frame % 7 == 3, frame % 6 == 5,
            )  # fmt: skip
    return FaceTrack(values, mask, viseme, expression)


def body(
    frames: int, *, baps_sent: tuple[int, ...] | None = None, table: BapTable = "iso", seed: int = 2
) -> BodyTrack:
    """Return a body whose BAPs walk within the standard's ranges; extension BAPs within -1860..1860 steps."""
    source = noise(seed)
    values = np.zeros((frames, BAP_COUNT), dtype=np.int32)
    mask = np.zeros((frames, BAP_COUNT), dtype=bool)
    steps = bap_steps(table)
    for number in baps_sent if baps_sent is not None else range(1, BAP_STANDARD_COUNT + 1):
        bap = baps()[number - 1]
        values[:, number - 1] = wander(frames, bap.i_limits or (-1860, 1860), int(steps[number - 1]), source)
        mask[:, number - 1] = True
    return BodyTrack(values, mask)


def animation(
    face_track: FaceTrack | None,
    body_track: BodyTrack | None = None,
    *,
    rate: Fraction | int = 25,
    index: list[int] | None = None,
) -> Animation:
    """Return an animation of these tracks; index: 0, 1, ... if None."""
    track = face_track if face_track is not None else body_track
    assert track is not None
    numbers = np.arange(len(track)) if index is None else np.array(index)
    return Animation(Fraction(rate), numbers, face_track, body_track)
