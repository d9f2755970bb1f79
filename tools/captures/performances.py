"""Performances of an actor: FAPs over time, synthetic or from a file, and the motion of the head."""

from __future__ import annotations

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64
from fba.capture.blendshapes.combination import part_lids
from fba.errors import ModelError
from fba.face import FaceModel, resolve
from fba.parameters import FAP_COUNT, faps

AMPLITUDES = {
    3: 500, 14: 120, 15: 60, 16: 150, 17: 150, 18: 120, 19: 900, 20: 900, 31: 200, 32: 200, 33: 200, 34: 200,
    35: 200, 36: 200, 37: 80, 38: 80, 39: 60, 40: 60, 41: 120, 42: 120, 51: 200, 52: 300, 53: 120, 54: 120,
    55: 200, 56: 200, 57: 300, 58: 300, 59: 200, 60: 200, 61: 40, 62: 40, 63: 60, 64: 40,
}  # fmt: skip
"""FAPs that the actor performs, and how far."""
ONE_WAY = (3, 14, 19, 20, 41, 42)
INNER = {51: 4, 52: 5, 53: 6, 54: 7, 55: 8, 56: 9, 57: 10, 58: 11, 59: 12, 60: 13}
"""FAPs of the inner lips, which do as the outer ones."""
REST = 0.5
"""Seconds for which a performance rests before it begins, and those in which it gets there."""
HEAD = slice(47, 50)
"""Columns of the FAPs that turn the head."""


def speech(frames: int, rate: float, seed: int = 1) -> Float64:
    """FAPs of a face that talks, frowns, smiles and blinks, from rest: float64 (T, 68)."""
    random = np.random.default_rng(seed)
    times = np.arange(frames) / rate
    start = ease_in(times, 0.3, 0.3)
    values = np.zeros((frames, FAP_COUNT))
    for fap, amplitude in AMPLITUDES.items():
        curve = sum(
            np.sin(2 * np.pi * (random.uniform(0.2, 2.5) * times + random.uniform())) for _ in range(3)
        ) / 2.0  # fmt: skip
        if fap in (19, 20):
            curve = np.maximum(0.0, np.sin(2 * np.pi * (0.4 * times + 0.3))) ** 24
        elif fap in ONE_WAY:
            curve = np.maximum(curve, 0.0)
        values[:, fap - 1] = amplitude * curve * start
    for outer, inner in INNER.items():
        values[:, inner - 1] = values[:, outer - 1]
    return values


def head_motion(frames: int, rate: float, seed: int = 2) -> tuple[Float64, Float64]:
    """Pitch, yaw, roll, radians (T, 3), and the path of the spine's top, metres (T, 3), from rest."""
    random = np.random.default_rng(seed)
    times = np.arange(frames) / rate
    start = np.clip((times - 0.3) / 0.5, 0, 1)[:, None]
    waves = np.stack([
        sum(np.sin(2 * np.pi * (random.uniform(0.1, 0.9) * times + random.uniform())) for _ in range(2)) / 2
        for _ in range(6)
    ], axis=1) * start  # fmt: skip
    return waves[:, :3] * (0.25, 0.45, 0.15), waves[:, 3:] * (0.05, 0.02, 0.04)


def perform_track(animation: Animation, rate: float) -> Float64:
    """Return what a face of an animation does, at another rate, after a rest: FAPs, float64 (T, 68).

    Visemes and expressions become FAPs. What no face shows is left out: values below 0 of FAPs that go one
    way only, and lids that are more than closed. Raises ModelError if there is no face.
    """
    if animation.face is None:
        raise ModelError("the animation has no face")
    shown = resolve(animation.face, FaceModel.default()).astype(np.float64)
    shown[:, :2] = 0
    part_lids(shown)
    one_way = [fap.direction == "U" for fap in faps()]
    shown[:, one_way] = np.maximum(shown[:, one_way], 0)
    times = animation.index / float(animation.rate)
    times = times - times[0] + 2 * REST
    at = np.arange(round((times[-1]) * rate) + 1) / rate
    values = np.stack([np.interp(at, times, column) for column in shown.T], axis=1)
    return values * ease_in(at, REST, REST)[:, None]


def ease_in(times: Float64, start: float, length: float) -> Float64:
    """Return shares (T,) that go from 0 to 1 within some seconds."""
    share: Float64 = np.clip((times - start) / length, 0, 1)
    return share * share * (3 - 2 * share)
