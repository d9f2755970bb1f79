"""Approximate rows: P planes with values near the wanted ones that take fewer bits."""

from __future__ import annotations

import math

import numpy as np

from fba.arrays import Float64, Int32, Int64
from fba.codec._plane import slots
from fba.codec._plane.arithmetic import Counts
from fba.codec._plane.loops import Coding, Layout, State, coding_of, quantise_change
from fba.codec._plane.writer import PlaneWriter
from fba.compiled import compiled


def approximate_row(
    writer: PlaneWriter, mask: int, row: Int32, weights: Float64, price: float, skip: int
) -> tuple[Int32, int]:
    """Return what the next P plane brings for a row (columns,) at a price, and the bits that it takes.

    Of every parameter it takes the level with the least weight x error^2 + price x bits; equal to `row` in
    what is not coded. weights: float64 (slots,), of a slot by itself; infinite: the nearest level. mask:
    fba_object_mask. Nothing is written.
    """
    layout, state = writer.layout(mask), writer.models.state
    levels = choose_levels(layout, state, row, weights, price)
    result = row.copy()
    result[layout.order] = writer.models.last[layout.order] + levels * writer.models.step[layout.order]
    return result, writer.bits_of(mask, levels, row[slots.FLAGS].astype(np.int64), skip)


@compiled
def choose_levels(layout: Layout, state: State, row: Int32, weights: Float64, price: float) -> Int64:
    """Return the level of the difference of each slot that a plane codes: int64 (slots coded,)."""
    coding = coding_of(state, True)
    result = np.zeros(len(layout.order), np.int64)
    for position in range(len(layout.order)):
        slot = int(layout.order[position])
        result[position] = _choose_level(coding, slot, int(row[slot]), float(weights[slot]), price)
    return result


@compiled
def _choose_level(coding: Coding, slot: int, value: int, weight: float, price: float) -> int:
    """Return the level of one slot: from the nearest one outwards, as long as a better one may come."""
    low = int(coding.minimum[slot])
    high = low + int(coding.models.size[slot]) - 1
    last, step = int(coding.last[slot]), int(coding.step[slot])
    nearest = min(max(quantise_change(value, last, step), low), high)
    if math.isinf(weight):
        return nearest
    best = nearest
    least = _cost(coding, slot, nearest, value, weight, price)
    if low <= 0 <= high:  # no change costs the fewest bits nearly always: it shortens the search
        cost = _cost(coding, slot, 0, value, weight, price)
        if cost <= least:
            best, least = 0, cost
    for direction in (-1, 1):
        level = nearest + direction
        while low <= level <= high:
            error = float(value - last - level * step)
            if weight * error * error >= least:
                break
            cost = _cost(coding, slot, level, value, weight, price)
            if cost < least:
                best, least = level, cost
            level += direction
    return best


@compiled
def _cost(coding: Coding, slot: int, level: int, value: int, weight: float, price: float) -> float:
    """Return weight x error^2 + price x bits of a level."""
    error = float(value - int(coding.last[slot]) - level * int(coding.step[slot]))
    return weight * error * error + price * _symbol_bits(coding.models, slot, level - int(coding.minimum[slot]))


@compiled
def _symbol_bits(models: Counts, slot: int, symbol: int) -> float:
    """Return the length of a symbol by the adaptive model."""
    return math.log2(float(models.total[slot]) / (1.0 + float(models.added[slot, symbol])))
