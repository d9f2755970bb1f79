"""Limits motions to what the mesh can follow without folding; beyond that, its vertices stop."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.face.authoring.surface._fold_limits import Limiter, Patch
from fba.face.authoring.surface._motion import Motion, ease_field, fap_limits
from fba.face.authoring.surface.surface import Surface
from fba.text_files import packaged_rows

EASE = (0.75, 1.25)
"""Shares of the largest value without folds at which a motion slows to half speed, and at which it stops."""
MODERATE_VALUE = 320.0
"""Value (or limit of the FAP, if lower) up to which motions are kept linear by easing the skin around."""
HALVINGS = 7
"""Steps of bisection for the point at which a motion must stop."""
LEAST_REACH = 0.98
"""Motions that can reach this share of the limit without folds are not slowed."""


def soft_limit(value: float, most: float) -> float:
    """Return the value, growing at half speed near `most` and no more soon beyond it (`EASE`)."""
    size = abs(value)
    slow, stop = EASE[0] * most, EASE[1] * most
    result = min(size, slow) + 0.5 * max(min(size, stop) - slow, 0.0)
    return float(np.copysign(result, value)) if value else 0.0


def knots(most: float, limit: float) -> list[float]:
    """Return the values between 0 and the limit at which the slope of `soft_limit` changes."""
    return [round(share * most) for share in EASE if 1 <= share * most + 0.5 < limit]


def values_between(low: float, high: float, *bends: float) -> Float64:
    """Return the rising whole values: low, high, 0 and the given bends between them."""
    inner = {0, *(round(bend) for bend in bends if low < round(bend) < high)}
    return np.array(sorted({round(low), round(high)} | inner), dtype=np.float64)


@cache
def _human_ranges() -> dict[int, tuple[float, float]]:
    return {
        int(fap): (float(row["low"]), float(row["high"]))
        for row in packaged_rows(__package__, "human_ranges.csv")
        for fap in row["faps"].split()
    }


def human_range(fap: int) -> tuple[float, float]:
    """Return how far a FAP goes on human faces, below and above 0, with a margin; inf if not listed."""
    return _human_ranges().get(fap, (np.inf, np.inf))


def eased_linear_motion(
    surface: Surface, limiter: Limiter, vertices: Intp, field: Float64, fap: int, pinned: Bool
) -> Motion:
    """Return the motion of a FAP by value x field (N, 3) metres, limited where triangles would fold.

    vertices: (N,), of the surface. pinned: mask of the surface's vertices whose motion must not change; that
    of others is eased where triangles would fold early.
    """
    eased = ease_field(surface, limiter, limiter.spread(vertices, field), values_to_reach(fap), pinned)
    vertices = np.flatnonzero(eased.any(axis=1))
    return linear_motion(limiter, vertices, eased[vertices], *fap_limits(fap), human_range(fap))


def values_to_reach(fap: int) -> list[float]:
    """Return the values that a FAP should be able to reach."""
    return [
        float(np.sign(end)) * min(MODERATE_VALUE / EASE[0], abs(end))
        for end in fap_limits(fap)
        if abs(end) > 1
    ]


def linear_motion(
    limiter: Limiter,
    vertices: Intp,
    field: Float64,
    low: float,
    high: float,
    most: tuple[float, float] = (np.inf, np.inf),
) -> Motion:
    """Return the motion by value x field (N, 3) metres, limited where triangles would fold.

    low, high: the range of values. most: sizes of the values, below 0 and above, that it never exceeds.
    The field is not eased.
    """
    full_field = limiter.spread(vertices, field)
    patch = limiter.patch(vertices)
    stops = [
        min(cap, _largest_value(patch, full_field * sign, abs(end)))
        for sign, end, cap in zip((-1, 1), (low, high), most, strict=True)
    ]
    bends = [-bend for bend in knots(stops[0], -low)] + knots(stops[1], high)
    values = values_between(low, high, *bends)
    limited = np.array([soft_limit(value, stops[int(value > 0)]) for value in values])
    return stop_at_folds(limiter, Motion(values, vertices, limited[:, None, None] * field))


def coupled_motions(
    limiter: Limiter, inner: tuple[Float64, Float64], outer: tuple[Float64, Float64], fap: int
) -> tuple[Motion, Motion]:
    """Return (inner, outer) motions of a pair of FAPs whose sum stays linear although each alone is limited.

    A contour that gets as close to the other as the skin between them allows goes on with the other one.

    inner, outer: (N, 3) metres a step, below and above 0, of the contour of `fap` and of the other one.
    """
    low, high = fap_limits(fap)
    vertices = np.flatnonzero(np.sum([np.abs(field) for field in (*inner, *outer)], axis=0).max(axis=1) > 0)
    patch = limiter.patch(vertices)
    most = {}
    for side, (sign, end, cap) in enumerate(zip((-1.0, 1.0), (low, high), human_range(fap), strict=True)):
        fields = (inner[side], outer[side], inner[side] + outer[side])
        reach = [patch.least_reach(sign * field) for field in fields]
        together = min(cap, np.inf if LEAST_REACH * reach[2] >= abs(end) else max(reach[2], 1.0))
        apart = min(reach[0], reach[1])
        apart = np.inf if LEAST_REACH * apart >= abs(end) else max(apart, 1.0)
        most[sign] = (together, apart, reach[0] <= reach[1])
    bends = []
    for sign, end in ((-1.0, low), (1.0, high)):
        for limit in most[sign][:2]:
            bends += [sign * bend for bend in knots(limit, abs(end))]
    values = values_between(low, high, *bends)
    moves: list[list[Float64]] = [[], []]
    for value in values:
        side = int(value > 0)
        together, apart, inner_stops = most[1.0 if side else -1.0]
        joint = soft_limit(value, together)
        ahead = soft_limit(joint, apart)
        stops, goes = (inner[side], outer[side]) if inner_stops else (outer[side], inner[side])
        alone, taking = ahead * stops, joint * goes + (joint - ahead) * stops
        for shifts, shift in zip(moves, (alone, taking) if inner_stops else (taking, alone), strict=True):
            shifts.append(shift[vertices])
    motions = [stop_at_folds(limiter, Motion(values, vertices, np.array(shifts))) for shifts in moves]
    return motions[0], motions[1]


def _largest_value(patch: Patch, field: Float64, limit: float) -> float:
    """Return the value >= 1 that a linear motion (N, 3) reaches without folds; inf from `LEAST_REACH` on."""
    reach = patch.least_reach(field)
    return np.inf if LEAST_REACH * reach >= limit else max(reach, 1.0)


def stop_at_folds(limiter: Limiter, motion: Motion, *, turning: bool = False) -> Motion:
    """Return the motion, stopped where it would fold triangles. turning: as in `Patch.soundness`."""
    patch = limiter.patch(motion.vertices)

    def is_sound(shifts: Float64) -> bool:
        return patch.is_sound(limiter.spread(motion.vertices, shifts), turning=turning)

    return stop_motion(motion, is_sound)


def stop_motion(motion: Motion, is_sound: Callable[[Float64], bool]) -> Motion:
    """Return the motion, stopped on both sides of 0 where its shifts (N, 3) are not sound."""
    zero = int(np.flatnonzero(motion.values == 0)[0])
    down = _stop_one_side(motion, range(zero - 1, -1, -1), is_sound)
    up = _stop_one_side(motion, range(zero + 1, len(motion.values)), is_sound)
    steps = [*down[::-1], (0.0, motion.shifts[zero]), *up]
    return Motion(np.array([v for v, _ in steps]), motion.vertices, np.array([s for _, s in steps]))


def _stop_one_side(
    motion: Motion, side: range, is_sound: Callable[[Float64], bool]
) -> list[tuple[float, Float64]]:
    """Return (value, shifts) outwards from 0 up to where a triangle folds, constant from there on."""
    steps: list[tuple[float, Float64]] = []
    value, shifts = 0.0, np.zeros_like(motion.shifts[0])
    for k in side:
        if is_sound(motion.shifts[k]):
            value, shifts = float(motion.values[k]), motion.shifts[k]
            steps.append((value, shifts))
            continue
        share = _last_sound_share(shifts, motion.shifts[k], is_sound)
        end = float(np.round(value + (motion.values[k] - value) * share))
        if end != value:
            # values are whole; the slope up to here stays the same
            share = (end - value) / (motion.values[k] - value)
            shifts = shifts * (1 - share) + motion.shifts[k] * share
            steps.append((end, shifts))
        if motion.values[side[-1]] != end:
            steps.append((float(motion.values[side[-1]]), shifts))
        break
    return steps


def _last_sound_share(start: Float64, end: Float64, is_sound: Callable[[Float64], bool]) -> float:
    """Return the largest share between two shifts at which no triangle has folded yet, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        if is_sound(start * (1 - middle) + end * middle):
            low = middle
        else:
            high = middle
    return low
