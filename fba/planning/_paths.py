"""Paths: the levels of one parameter, from frame to frame, that take the fewest bits within bounds.

A parameter has a lower and an upper bound at every frame, and a stream may leave frames out, which a player
fills in linearly. `find_path` searches the levels of the frames that are sent, the keys. It starts from a
path that changes as rarely as can be (a dead zone). Then, a few times over, it takes the shortest way
through all levels within the bounds (Viterbi), where each change costs what the adaptive coder would take
for it after the path found before.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Float64, Int32, Int64
from fba.codec import level_bits, range_limit
from fba.compiled import compiled

ROUNDS = 6
"""Most searches for one path; each starts from what the one before tells of the coder."""
WIDEST = 24
"""Levels that are tried at a frame; more of them lie within the bounds of parameters that move little."""
OUTSIDE = 1e6
"""Bits that count for a frame outside its bounds, and for a change that no P plane carries."""
JERK_BITS = 12.0
"""Bits that count for a change by which a viewer would see a jerk."""
ROUNDING = 1e-6
"""Share of a step by which a level may lie outside."""


class Bounds(NamedTuple):
    """Where one parameter may be, from one I plane up to the next.

    lower, upper: float64 (T,), values. keys: int64 (K,), ascending, the frames that are sent, with the first
    and the last. step: of the quantiser, in the parameter's unit. scale: table steps in it, which divide the
    limits of ranges (`fba.codec.step_scale`). source: float64 (T,), values that the path stands for; jump: by
    how much a change from one key to the next may differ from theirs without being seen as a jerk.
    """

    lower: Float64
    upper: Float64
    keys: Int64
    step: int
    scale: int
    source: Float64 | None = None
    jump: float = np.inf


def find_path(bounds: Bounds, start: Int64 | None = None, *, rounds: int = ROUNDS) -> Int64:
    """Return the cheapest levels found at the keys: int64 (K,).

    Within the bounds at every frame, those between keys included, wherever `start` is, or a path that holds
    its level as long as it may; and never costlier than that. Where no level is within the bounds of a key,
    the one nearest to their middle is taken: the caller checks what must hold.

    start: int64 (K,), a path to better. rounds: most searches, with ranges as they are and with
    narrower ones.
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
    """Return levels at the keys, int64 (K,), each held until bounds force another, then the nearest."""
    lowest, highest = _levels_within(bounds)
    return _hold(lowest, highest)


def _levels_within(bounds: Bounds) -> tuple[Int64, Int64]:
    """Return the lowest and the highest level within the bounds of each key: int64 (K,), (K,)."""
    lower, upper = bounds.lower[bounds.keys] / bounds.step, bounds.upper[bounds.keys] / bounds.step
    lowest = np.ceil(lower - ROUNDING).astype(np.int64)
    highest = np.floor(upper + ROUNDING).astype(np.int64)
    nearest = np.rint((lower + upper) / 2).astype(np.int64)
    none = lowest > highest
    return np.where(none, nearest, lowest), np.where(none, nearest, highest)


def _band(bounds: Bounds, start: Int64 | None) -> tuple[Int64, Int64]:
    """Return the levels that are tried at each key, from first to last: at most `WIDEST`."""
    lowest, highest = _levels_within(bounds)
    middle = _hold(lowest, highest) if start is None else start
    lowest, highest = np.minimum(lowest, middle), np.maximum(highest, middle)
    return np.maximum(lowest, middle - WIDEST // 2), np.minimum(highest, middle + WIDEST // 2)


def _cost(bounds: Bounds, path: Int64) -> float:
    """Return the bits of a path, and `OUTSIDE` for every frame at which it is outside its bounds."""
    shown = np.interp(np.arange(len(bounds.lower)), bounds.keys, path) * bounds.step
    slack = bounds.step * ROUNDING
    outside = int(((shown < bounds.lower - slack) | (shown > bounds.upper + slack)).sum())
    lowest, highest = _calm_changes(bounds)
    changes = np.diff(path)
    jerks = int(((changes < lowest) | (changes > highest)).sum())
    return level_bits(path, bounds.scale) + OUTSIDE * outside + JERK_BITS * jerks


def _calm_changes(bounds: Bounds) -> tuple[Float64, Float64]:
    """Return the least and the largest change to each key but the first that is no jerk: float64 (K - 1,)."""
    if bounds.source is None:
        none = np.full(len(bounds.keys) - 1, np.inf)
        return -none, none
    moved = np.diff(bounds.source[bounds.keys]) / bounds.step
    room = max(bounds.jump / bounds.step, 1.0)
    return np.minimum(moved - room, -ROUNDING), np.maximum(moved + room, ROUNDING)


def _search(bounds: Bounds, band: tuple[Int64, Int64], before: Int64, narrower: int) -> Int64:
    """Return the cheapest way through a band: int64 (K,).

    A change costs what the path before tells, and more where it is beyond the tightest ranges of that, made
    narrower by this number of units.
    """
    if len(before) < 2:
        return before
    changes = np.diff(before)
    high, low = int(max(changes.max(), 0)), int(max(-changes.min(), 0))
    unit = max(range_limit(1, bounds.scale), 1)
    high, low = (max(range_limit(one, bounds.scale) - narrower * unit, unit) for one in (high, low))
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
    """Return levels (K,) that change as late as can be. Bounds: all arrays have the length of lowest."""
    result = np.zeros(len(lowest), dtype=np.int64)
    level = 0
    if len(lowest):
        # The first one is held longest where later bounds agree with it, too.
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
    """Return the levels (K,) whose changes cost least together.

    within: lower and upper bounds (T,), in levels, for the frames between keys, too, where values are
    interpolated. band: lowest and highest levels (K,). calm: least and largest changes (K - 1,) that are no
    jerk. cost: of changes from -low on. choices: int32 (K, most levels), working array.

    Bounds: j and i are levels within the band, of which choices has a column each (`_search` makes it for the
    widest). j_first and j_last keep changes within -low..len(cost) - 1 - low. Keys are places in both
    bounds, those between two keys as well.
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
                held = level * (1.0 - share)
                lowest = max(lowest, (lower[frame] - held) / share - ROUNDING)
                highest = min(highest, (upper[frame] - held) / share + ROUNDING)
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
        for j in range(count):  # what no level before leads to
            if new_sums[j] > least + OUTSIDE:
                new_sums[j] = least + OUTSIDE
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
