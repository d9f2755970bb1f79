"""Paths: the levels of one parameter, from frame to frame, that take the fewest bits within bounds.

A parameter has a lower and an upper bound at every frame, and a stream may leave out frames, which a player
interpolates linearly. `find_path` searches the levels of the frames that are sent, the keys. It starts from a
path that changes as rarely as possible (a dead zone). Then it repeats a Viterbi search for the cheapest path
through all levels within the bounds, in which a change costs the bits that the adaptive coder would take for
it after the previous path.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Float64, Int32, Int64
from fba.codec import range_limit
from fba.compiled import compiled
from fba.planning._code_lengths import level_bits

MAX_ROUNDS = 6
"""Most searches for a path; each starts from the statistics of the path before."""
MAX_LEVELS = 24
"""Most levels that are tried at a frame; bounds of parameters that move little contain more levels."""
OUTSIDE_BITS = 1e6
"""Bits counted for a frame outside its bounds, and for a change that no P plane carries."""
JERK_BITS = 12.0
"""Bits counted for a change that a viewer would see as a jerk."""
ROUNDING = 1e-6
"""Share of a step by which a level may lie outside its bounds."""


class Bounds(NamedTuple):
    """Bounds of a parameter from one I plane up to the next.

    lower, upper: float64 (T,), values. keys: int64 (K,), ascending, the frames that are sent, with the first
    and the last. step: of the quantiser, in the parameter's unit. scale: table steps in it, which divide the
    limits of ranges (`fba.codec.step_scale`). source: float64 (T,), values that the path represents; jump: by
    how much a change from key to key may differ from the source's before it is seen as a jerk.
    """

    lower: Float64
    upper: Float64
    keys: Int64
    step: int
    scale: int
    source: Float64 | None = None
    jump: float = np.inf


def find_path(bounds: Bounds, start: Int64 | None = None, *, rounds: int = MAX_ROUNDS) -> Int64:
    """Return the cheapest levels at the keys that the search comes to: int64 (K,).

    They never cost more than `start` or the path that holds each level as long as it may, and stay within the
    bounds, also between keys, if one of these does. If no level is within the bounds of a key, the nearest to
    their middle is taken: the caller checks what must be true.

    start: int64 (K,), a path to improve. rounds: most searches for each width of ranges: that of the path,
    and narrower.
    """
    band = _band(bounds, start)
    candidates = [hold_level(bounds)] if start is None else [start, hold_level(bounds)]
    best = min(candidates, key=lambda path: _cost(bounds, path))
    least = _cost(bounds, best)
    for narrower in (0, 1) if rounds > 1 else (0,):
        for _ in range(rounds):
            path = _search(bounds, band, best, narrower)
            bits = _cost(bounds, path)
            if bits >= least - 1e-6:
                break
            best, least = path, bits
    return best


def hold_level(bounds: Bounds) -> Int64:
    """Return levels at the keys, int64 (K,), each kept until the bounds force another, then the nearest."""
    return _hold(*_levels_within(bounds))


def _levels_within(bounds: Bounds) -> tuple[Int64, Int64]:
    """Return the lowest and the highest level within the bounds of each key: int64 (K,), (K,)."""
    lower, upper = bounds.lower[bounds.keys] / bounds.step, bounds.upper[bounds.keys] / bounds.step
    lowest = np.ceil(lower - ROUNDING).astype(np.int64)
    highest = np.floor(upper + ROUNDING).astype(np.int64)
    nearest = np.rint((lower + upper) / 2).astype(np.int64)
    empty = lowest > highest
    return np.where(empty, nearest, lowest), np.where(empty, nearest, highest)


def _band(bounds: Bounds, start: Int64 | None) -> tuple[Int64, Int64]:
    """Return the first and the last level that are tried at each key, about `MAX_LEVELS` of them."""
    lowest, highest = _levels_within(bounds)
    middle = _hold(lowest, highest) if start is None else start
    lowest, highest = np.minimum(lowest, middle), np.maximum(highest, middle)
    return np.maximum(lowest, middle - MAX_LEVELS // 2), np.minimum(highest, middle + MAX_LEVELS // 2)


def _cost(bounds: Bounds, path: Int64) -> float:
    """Return the bits of a path, with those counted for frames outside the bounds and for jerks."""
    shown = np.interp(np.arange(len(bounds.lower)), bounds.keys, path) * bounds.step
    slack = bounds.step * ROUNDING
    outside = int(((shown < bounds.lower - slack) | (shown > bounds.upper + slack)).sum())
    lowest, highest = _calm_changes(bounds)
    changes = np.diff(path)
    jerks = int(((changes < lowest) | (changes > highest)).sum())
    return level_bits(path, bounds.scale) + OUTSIDE_BITS * outside + JERK_BITS * jerks


def _calm_changes(bounds: Bounds) -> tuple[Float64, Float64]:
    """Return the least and the largest change from key to key that is not a jerk: float64 (K - 1,) each."""
    if bounds.source is None:
        unlimited = np.full(len(bounds.keys) - 1, np.inf)
        return -unlimited, unlimited
    moved = np.diff(bounds.source[bounds.keys]) / bounds.step
    room = max(bounds.jump / bounds.step, 1.0)
    return np.minimum(moved - room, -ROUNDING), np.maximum(moved + room, ROUNDING)


def _search(bounds: Bounds, band: tuple[Int64, Int64], before: Int64, narrower: int) -> Int64:
    """Return the cheapest path through a band: int64 (K,).

    A change costs its bits by the statistics of the path before, or `OUTSIDE_BITS` beyond the tightest ranges
    of that path, made narrower by this number of units.
    """
    if len(before) < 2:
        return before
    changes = np.diff(before)
    high, low = int(max(changes.max(), 0)), int(max(-changes.min(), 0))
    unit = max(range_limit(1, bounds.scale), 1)
    high, low = (max(range_limit(limit, bounds.scale) - narrower * unit, unit) for limit in (high, low))
    counts = np.bincount(np.clip(changes + low, 0, high + low), minlength=high + low + 1)
    cost = np.log2((len(changes) + high + low + 1) / (counts + 1.0))
    first, last = band
    choices = np.zeros((len(first), int((last - first).max()) + 1), dtype=np.int32)
    lowest, highest = _calm_changes(bounds)
    return _shortest(
        (bounds.lower / bounds.step, bounds.upper / bounds.step),
        bounds.keys,
        (first, last),
        (lowest, highest),
        cost,
        low,
        choices,
    )


@compiled
def _hold(lowest: Int64, highest: Int64) -> Int64:
    """Return levels (K,) that change as late as possible. Bounds: all arrays have the length of lowest."""
    result = np.zeros(len(lowest), dtype=np.int64)
    level = 0
    if len(lowest):
        # The first level lasts longest if it is within later bounds, too.
        low, high = int(lowest[0]), int(highest[0])
        for key in range(1, len(lowest)):
            if max(low, int(lowest[key])) > min(high, int(highest[key])):
                break
            low, high = max(low, int(lowest[key])), min(high, int(highest[key]))
        level = min(max(0, low), high)
    for key in range(len(lowest)):
        level = min(max(level, int(lowest[key])), int(highest[key]))
        result[key] = level
    return result


@compiled
def _shortest(
    within: tuple[Float64, Float64],
    keys: Int64,
    band: tuple[Int64, Int64],
    calm: tuple[Float64, Float64],
    cost: Float64,
    low: int,
    choices: Int32,
) -> Int64:
    """Return the levels (K,) whose changes cost least in total.

    within: lower and upper bounds (T,), in levels, also for the frames between keys, where values are
    interpolated. band: lowest and highest levels (K,). calm: least and largest changes (K - 1,) that are not
    jerks. cost: of changes from -low on. choices: int32 (K, most levels), working array.

    Bounds: i and j are levels within the band, and choices has a column for each (`_search` makes it for the
    widest). j_first and j_last keep changes within -low..len(cost) - 1 - low. Keys, and the frames between
    two keys, are places in both bounds.
    """
    lower, upper = within
    first, last = band
    width = choices.shape[1]
    sums, new_sums = np.zeros(width), np.zeros(width)
    for key in range(1, len(keys)):
        begin, end = int(keys[key - 1]), int(keys[key])
        base, before = int(first[key]), int(first[key - 1])
        count = int(last[key]) - base + 1
        least, cheapest = np.inf, 0
        for j in range(count):
            new_sums[j] = np.inf
        for i in range(int(last[key - 1]) - before + 1):
            level = before + i
            lowest, highest = -1e18, 1e18  # levels at this key that keep the frames between within bounds
            for frame in range(begin + 1, end):
                share = (frame - begin) / (end - begin)
                before_part = level * (1.0 - share)
                lowest = max(lowest, (lower[frame] - before_part) / share - ROUNDING)
                highest = min(highest, (upper[frame] - before_part) / share + ROUNDING)
            j_first = max(0, level - low - base, int(np.ceil(max(lowest, -1e9))) - base)
            j_last = min(
                count - 1, level - low + len(cost) - 1 - base, int(np.floor(min(highest, 1e9))) - base
            )
            for j in range(j_first, j_last + 1):
                change = base + j - level
                total = sums[i] + cost[change + low]
                if change < calm[0][key - 1] or change > calm[1][key - 1]:
                    total += JERK_BITS
                if total < new_sums[j]:
                    new_sums[j] = total
                    choices[key, j] = i
            least = min(least, sums[i])
            if sums[i] == least:
                cheapest = i
        for j in range(count):  # levels that no level before leads to
            if new_sums[j] > least + OUTSIDE_BITS:
                new_sums[j] = least + OUTSIDE_BITS
                choices[key, j] = cheapest
        sums, new_sums = new_sums, sums
    result = np.zeros(len(keys), dtype=np.int64)
    best = 0
    for j in range(int(last[-1]) - int(first[-1]) + 1):
        if sums[j] < sums[best]:
            best = j
    for key in range(len(keys) - 1, -1, -1):
        result[key] = int(first[key]) + best
        best = int(choices[key, best])
    return result
