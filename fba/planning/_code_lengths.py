"""Code lengths: the bits that a parameter takes between two I planes, computed without coding it."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from fba.arrays import Float64, Int64
from fba.codec import levels, range_limit, step_scale
from fba.compiled import compiled
from fba.encoder_options import EncoderOptions
from fba.tracks import BodyTrack, FaceTrack

BEYOND_RANGES = 1 << 20
"""A level, or a number of levels, beyond every range."""
RANGE_BITS = 4 * 5
"""Bits of the four range codes of a parameter."""
INTRA_BITS = 64
"""Bits of an I plane apart from its parameters: its header, mask types, and the coder's flush."""
UNCODABLE_BITS = 500
"""Bits counted for a difference that no P plane carries: about those of an I plane for it."""
IMPOSSIBLE_BITS = 1e9
"""Bits counted for a value that no I plane carries, so that no segment begins there if any other can."""


def code_lengths(track: FaceTrack | BodyTrack, cuts: Int64, options: EncoderOptions) -> Float64:
    """Return the bits of each parameter between cuts: float64 (68 or 296, C, C).

    The element (n, a, b) is the bits of parameter n + 1 if frames cuts[a] to cuts[b] - 1 are an I plane and
    the P planes after it, with ranges that fit them: its ranges, its first value, and the differences. The
    adaptive model codes differences in a length that depends on how often each occurs, not on their order. 0
    for a parameter that is 0 throughout, for FAPs 1 and 2, and where b <= a.

    cuts: int64 (C,), increasing, from 0 to the number of frames; ValueError for others.
    """
    if len(cuts) and not (cuts[0] >= 0 and cuts[-1] <= len(track) and (np.diff(cuts) > 0).all()):
        raise ValueError(f"cuts must increase from 0 to {len(track)} frames, not {cuts.tolist()}")
    scale = step_scale(options, body=isinstance(track, BodyTrack))
    values = levels(track, options)
    result = np.zeros((values.shape[1], len(cuts), len(cuts)))
    logarithms, factorials = _logarithms(len(values))
    for column in np.flatnonzero(values.any(axis=0)).tolist():
        own = np.ascontiguousarray(values[:, column])
        _add_lengths(own, cuts, scale, logarithms, factorials, result[column])
    return result


def level_bits(values: Int64, scale: int) -> float:
    """Return the bits of a parameter with these levels (T,), in an I plane and the P planes after it.

    As `code_lengths` counts them. scale: `step_scale` of the part.
    """
    if not values.any():
        return 0.0
    logarithms, factorials = _logarithms(len(values))
    result = np.zeros((2, 2))
    cuts = np.array([0, len(values)])
    _add_lengths(np.ascontiguousarray(values), cuts, scale, logarithms, factorials, result)
    return float(result[0, 1])


@lru_cache(maxsize=4)
def _logarithms(count: int) -> tuple[Float64, Float64]:
    """Return log2(n) and log2(n!) for n from 0 up to the sum of `count` planes and all symbols."""
    symbols = 2 * range_limit(BEYOND_RANGES, 1) + 1
    logarithms = np.log2(np.maximum(np.arange(count + symbols + 1, dtype=np.float64), 1))
    return logarithms, np.cumsum(logarithms)


@compiled
def _add_lengths(
    values: Int64, cuts: Int64, scale: int, logarithms: Float64, factorials: Float64, result: Float64
) -> None:
    """Fill in result (C, C) for a parameter. values: int64 (T,), levels.

    logarithms, factorials: log2(n) and log2(n!) for n from 0 on.

    Bounds: cuts are places in values, as `code_lengths` checks and `level_bits` makes them. Changes are
    counted up to `largest` either way, and neither they nor limits of ranges exceed what `_logarithms` has
    room for.
    """
    largest = range_limit(BEYOND_RANGES, scale)
    counts = np.zeros(2 * largest + 1, dtype=np.int64)
    for first in range(len(cuts) - 1):
        counts[:] = 0
        learnt, coded, beyond, high, low = 0.0, 0, 0, 0, 0
        start = int(cuts[first])
        intra = RANGE_BITS + logarithms[range_limit(abs(int(values[start])), scale) + 1]
        if abs(int(values[start])) > largest:
            intra += IMPOSSIBLE_BITS
        frame = start
        for last in range(first + 1, len(cuts)):
            while frame < int(cuts[last]):
                if frame > start:
                    change = int(values[frame]) - int(values[frame - 1])
                    if abs(change) > largest:
                        beyond += 1
                    else:
                        counts[change + largest] += 1
                        learnt += logarithms[counts[change + largest]]
                        coded += 1
                        high, low = max(high, change), max(low, -change)
                frame += 1
            # Counts start at 1: the shares of all symbols multiply to others! c1! c2! .. / (others + coded)!
            others = range_limit(high, scale) + range_limit(low, scale)
            differences = factorials[others + coded] - factorials[others] - learnt
            result[first, last] = intra + differences + UNCODABLE_BITS * beyond
