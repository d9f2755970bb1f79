"""Motions limited to what the mesh can follow; beyond that, vertices stay where they are."""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.face.authoring.surface.fold_limits import Limiter
from fba.face.authoring.surface.motion import Motion, limits
from fba.face.authoring.surface.surface import Surface
from fba.face.authoring.surface.unfold import eased_field

EASE = (0.75, 1.25)
"""A motion slows down to half at this share of what the mesh can take, and stops at that one."""
MODERATE = 320.0
"""A FAP goes straight at least up to this value (or its limit), where easing the skin around allows."""
HALVINGS = 7
FULL = 0.98
"""Values are left alone where the mesh can take this share of them."""


def held_back(value: float, most: float) -> float:
    """A value that eases out towards `most` instead of passing it."""
    size = abs(value)
    slow, stop = EASE[0] * most, EASE[1] * most
    result = min(size, slow) + 0.5 * max(min(size, stop) - slow, 0.0)
    return float(np.copysign(result, value)) if value else 0.0


def knots(most: float, limit: float) -> list[float]:
    """The values between 0 and the limit where `held_back` bends."""
    return [round(share * most) for share in EASE if 1 <= share * most + 0.5 < limit]


def values_between(low: float, high: float, *bends: float) -> Float64:
    """Rising whole values from low to high with 0 and the given bends that lie between."""
    inner = {0, *(round(bend) for bend in bends if low < round(bend) < high)}
    return np.array(sorted({round(low), round(high)} | inner), dtype=np.float64)


@cache
def _caps() -> dict[int, tuple[float, float]]:
    with (files(__package__) / "caps.csv").open(encoding="utf-8") as file:
        return {
            int(fap): (float(row["low"]), float(row["high"]))
            for row in csv.DictReader(file)
            for fap in row["faps"].split()
        }


def caps(fap: int) -> tuple[float, float]:
    """Smallest and largest value of a FAP that tables cover: the range of a human face, with a margin."""
    return _caps().get(fap, (np.inf, np.inf))


def linear(
    surface: Surface, limiter: Limiter, vertices: Intp, field: Float64, fap: int, pinned: Bool
) -> Motion:
    """A straight motion of a FAP by value x field (N, 3) metres, held back where triangles would fold.

    pinned: (N,) vertices that go exactly so; around others what folds too early is eased.
    """
    whole = np.zeros((len(limiter), 3))
    whole[vertices] = field
    whole = eased_field(surface, limiter, whole, goals(fap), pinned)
    vertices = np.flatnonzero(whole.any(axis=1))
    return straight(limiter, vertices, whole[vertices], *limits(fap), caps(fap))


def goals(fap: int) -> list[float]:
    """Values that a FAP should be able to reach."""
    return [float(np.sign(end)) * min(MODERATE / EASE[0], abs(end)) for end in limits(fap) if abs(end) > 1]


def straight(
    limiter: Limiter,
    vertices: Intp,
    field: Float64,
    low: float,
    high: float,
    most: tuple[float, float] = (np.inf, np.inf),
) -> Motion:
    """A linear motion without easing, between two values. most: the values it always reaches."""
    whole = np.zeros((len(limiter), 3))
    whole[vertices] = field
    triangles = limiter.touched(vertices)
    stops = [
        min(cap, _most(limiter, whole * sign, triangles, abs(end)))
        for sign, end, cap in zip((-1, 1), (low, high), most, strict=True)
    ]
    bends = [-bend for bend in knots(stops[0], -low)] + knots(stops[1], high)
    values = values_between(low, high, *bends)
    held = np.array([held_back(value, stops[int(value > 0)]) for value in values])
    return guarded(limiter, Motion(values, vertices, held[:, None, None] * field))


def _most(limiter: Limiter, field: Float64, triangles: Intp, limit: float) -> float:
    reach = float(limiter.reach(field, triangles).min(initial=np.inf))
    return np.inf if FULL * reach >= limit else max(reach, 1.0)


def guarded(limiter: Limiter, motion: Motion, *, turning: bool = False) -> Motion:
    """The motion, stopped on each side of 0 where it would fold triangles."""
    triangles = limiter.touched(motion.vertices)
    zero = int(np.flatnonzero(motion.values == 0)[0])
    down = _stopped(limiter, motion, range(zero - 1, -1, -1), triangles, turning)
    up = _stopped(limiter, motion, range(zero + 1, len(motion.values)), triangles, turning)
    steps = [*down[::-1], (0.0, motion.shifts[zero]), *up]
    return Motion(np.array([v for v, _ in steps]), motion.vertices, np.array([s for _, s in steps]))


def _stopped(
    limiter: Limiter, motion: Motion, side: range, triangles: Intp, turning: bool
) -> list[tuple[float, Float64]]:
    """(value, shifts) going out from 0, up to where a triangle folds, and from there at rest."""
    steps: list[tuple[float, Float64]] = []
    value, shifts = 0.0, np.zeros_like(motion.shifts[0])
    for k in side:
        if _sound(limiter, motion, motion.shifts[k], triangles, turning):
            value, shifts = float(motion.values[k]), motion.shifts[k]
            steps.append((value, shifts))
            continue
        share = _last_sound(limiter, motion, shifts, motion.shifts[k], triangles, turning)
        end = float(np.round(value + (motion.values[k] - value) * share))
        if end != value:
            # rounded to a whole value, so that the slope up to here stays what it was
            share = (end - value) / (motion.values[k] - value)
            shifts = shifts * (1 - share) + motion.shifts[k] * share
            steps.append((end, shifts))
        if motion.values[side[-1]] != end:
            steps.append((float(motion.values[side[-1]]), shifts))
        break
    return steps


def _sound(limiter: Limiter, motion: Motion, shifts: Float64, triangles: Intp, turning: bool) -> bool:
    whole = np.zeros((len(limiter), 3))
    whole[motion.vertices] = shifts
    return limiter.sound(whole, triangles, turning=turning)


def _last_sound(
    limiter: Limiter, motion: Motion, start: Float64, end: Float64, triangles: Intp, turning: bool
) -> float:
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if _sound(limiter, motion, start * (1 - middle) + end * middle, triangles, turning):
            low = middle
        else:
            high = middle
    return low
