"""Signs of life that a window shows and no file has: blinks, glances, breath, a head that is never still."""

from __future__ import annotations

import math

import numpy as np

from fba.animation import Animation
from fba.arrays import Array, Float32, Float64
from fba.parameters import bap_numbers

FIRST_BLINK = 0.7
"""Seconds until the first blink."""
BLINK_EVERY = 3.4
"""Seconds between blinks, on average; each comes up to half of that earlier or later."""
CLOSING, OPENING = 0.08, 0.17
"""Seconds in which the lids close, and open again."""
CLOSED = (900.0, 124.0)
"""Upper and lower lid of a closed eye, in IRISD."""
GLANCE_EVERY = 1.7
"""Seconds between glances; every second one goes back to the viewer."""
GLANCE = (6000.0, 2500.0)
"""Largest turn of a glance to a side, and up or down, in 1e-5 rad."""
GLANCE_SECONDS = 0.05
"""Seconds in which the eyes turn."""
BREATH_SECONDS = 4.2
"""Seconds of a breath."""
BREATHING = {"vt6_tilt": -900.0, "vt1_tilt": 700.0, "l_acromioclavicular_abduct": 1500.0,
             "r_acromioclavicular_abduct": 1500.0}  # fmt: skip
"""BAPs of a deep breath, in 1e-5 rad."""
SWAY = (900.0, 1400.0, 700.0)
"""How far the head nods, turns and leans while nothing moves it, in 1e-5 rad."""
LIDS, EYES, HEAD = (18, 19, 20, 21), (22, 23, 24, 25), (47, 48, 49)
"""Columns of FAPs."""


class Life:
    """Adds signs of life to what is drawn, where the animation itself does not move.

    It depends on the time alone, so the same time always looks the same.
    """

    def __init__(self, animation: Animation) -> None:
        face, body = animation.face, animation.body
        self._lids = face is None or not _moves(face.values, LIDS)
        self._eyes = face is None or not _moves(face.values, EYES)
        self._head = face is None or not _moves(face.values, HEAD)
        columns = {bap_numbers()[name] - 1: angle for name, angle in BREATHING.items()}
        self._breath = {
            column: angle
            for column, angle in columns.items()
            if body is not None and not _moves(body.values, (column,))
        }

    def __call__(self, seconds: float, faps: Float32, baps: Float64) -> None:
        """Change FAPs (68,) and BAPs (296,) in place."""
        if self._lids:
            share = blink(seconds)
            for column, closed in zip(LIDS, (CLOSED[0], CLOSED[0], CLOSED[1], CLOSED[1]), strict=True):
                faps[column] += share * (closed - faps[column])
        if self._eyes:
            side, up = glance(seconds)
            faps[list(EYES)] += np.array([side, side, up, up], dtype=np.float32)
        if self._head:
            waves = (math.sin(seconds / 1.9), math.sin(seconds / 3.1), math.sin(seconds / 2.3 + 1))
            faps[list(HEAD)] += np.array(
                [size * wave for size, wave in zip(SWAY, waves, strict=True)], np.float32
            )
        breath = 0.5 - 0.5 * math.cos(2 * math.pi * seconds / BREATH_SECONDS)
        for column, angle in self._breath.items():
            baps[column] += breath * angle


def blink(seconds: float) -> float:
    """Return how far the eyes are closed at a time, 0 to 1."""
    number = math.floor((seconds - FIRST_BLINK) / BLINK_EVERY)
    if number < 0:
        return 0.0
    begins = FIRST_BLINK + number * BLINK_EVERY + (_chance(number) * BLINK_EVERY / 2 if number else 0.0)
    since = seconds - begins
    if not 0 < since < CLOSING + OPENING:
        return 0.0
    return since / CLOSING if since < CLOSING else 1 - (since - CLOSING) / OPENING


def glance(seconds: float) -> tuple[float, float]:
    """Return the turn of the eyes to the left and down at a time, in 1e-5 rad."""
    number = math.floor(seconds / GLANCE_EVERY)
    share = min((seconds - number * GLANCE_EVERY) / GLANCE_SECONDS, 1.0)
    before, after = _fixation(number - 1), _fixation(number)
    return before[0] + (after[0] - before[0]) * share, before[1] + (after[1] - before[1]) * share


def _fixation(number: int) -> tuple[float, float]:
    if number % 2 == 0:
        return 0.0, 0.0
    return GLANCE[0] * (2 * _chance(number) - 1), GLANCE[1] * (2 * _chance(number + 0.5) - 1)


def _chance(number: float) -> float:
    """Return a number from 0 to 1 that is always the same for a number, and looks random."""
    return math.sin(12.9898 * (number + 1)) * 43758.5453 % 1.0


def _moves(values: Array, columns: tuple[int, ...]) -> bool:
    """Return whether any of these columns changes."""
    part = values[:, list(columns)]
    return bool(len(part)) and bool((part.max(axis=0) != part.min(axis=0)).any())
