"""Approximations of frames: P planes whose values are near those of the frame and take fewer bits."""

from __future__ import annotations

import math

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64, Int32, Int64
from fba.codec._plane import slots
from fba.codec._plane.arithmetic import Counts
from fba.codec._plane.loops import Coding, Layout, State, coding_of, quantise_change
from fba.codec._plane.writer import PlaneWriter
from fba.compiled import compiled


class NextPlane:
    """Prices of what the next P plane may send of a frame; nothing of it is written yet.

    It is valid until the next plane is written. frame: the frame to approximate. mask: fba_object_mask.
    row: int32 (columns,), the frame's values.
    """

    def __init__(self, writer: PlaneWriter, frame: Animation, mask: int, row: Int32) -> None:
        self.frame = frame
        self._writer = writer
        self._mask = mask
        self._row = row

    def levels(self, weights: Float64, price: float) -> Int64:
        """Return the differences to code, in quantiser steps: int64 (parameters coded,).

        For each parameter the level with the least weight x error^2 + price x bits, by the present models.
        weights: float64 (364,), of the FAPs, then of the BAPs; infinite for the nearest level that the
        ranges contain, at any price, as for visemes and expressions. An infinite price: no change.
        """
        by_slot = slots.weights_of_slots(weights)
        return choose_levels(self._layout, self._writer.models.state, self._row, by_slot, price)

    def bits(self, levels: Int64) -> int:
        """Return the bits of the plane with these differences."""
        flags = self._row[slots.FLAGS].astype(np.int64)
        return self._writer.bits_of(self._mask, levels, flags)

    def with_levels(self, levels: Int64) -> Animation:
        """Return the frame as these differences show it."""
        row, order, models = self._row.copy(), self._layout.order, self._writer.models
        row[order] = models.last[order] + levels * models.step[order]
        return slots.with_values(self.frame, row)

    @property
    def _layout(self) -> Layout:
        return self._writer.layout(self._mask)


@compiled
def choose_levels(layout: Layout, state: State, row: Int32, weights: Float64, price: float) -> Int64:
    """Return the level of the difference of each slot that a plane codes: int64 (slots coded,).

    Bounds: a level is between 0 and the nearest level that the range contains; every range of P planes
    contains 0, so each level that is priced has a symbol.
    """
    coding = coding_of(state, True)
    result = np.zeros(len(layout.order), np.int64)
    for position in range(len(layout.order)):
        slot = int(layout.order[position])
        result[position] = _choose_level(coding, slot, int(row[slot]), float(weights[slot]), price)
    return result


@compiled
def _choose_level(coding: Coding, slot: int, value: int, weight: float, price: float) -> int:
    """Return the level of a slot: the nearest, or a level on the way to it that takes fewer bits.

    A still value stays still, and no value overshoots or moves back, even if that would take fewer bits: it
    would visibly tremble.
    """
    low = int(coding.minimum[slot])
    high = low + int(coding.models.size[slot]) - 1
    last, step = int(coding.last[slot]), int(coding.step[slot])
    nearest = min(max(quantise_change(value, last, step), low), high)
    if math.isinf(weight):
        return nearest
    if nearest == 0 or math.isinf(price):
        return 0
    best = nearest
    least = _cost(coding, slot, nearest, value, weight, price)
    cost = _cost(coding, slot, 0, value, weight, price)
    if cost <= least:  # nearly always; this shortens the search
        best, least = 0, cost
    towards = -1 if nearest > 0 else 1
    level = nearest + towards
    while level != 0:
        error = float(value - last - level * step)
        if weight * error * error >= least:
            break
        cost = _cost(coding, slot, level, value, weight, price)
        if cost < least:
            best, least = level, cost
        level += towards
    return best


@compiled
def _cost(coding: Coding, slot: int, level: int, value: int, weight: float, price: float) -> float:
    """Return weight x error^2 + price x bits of a level."""
    error = float(value - int(coding.last[slot]) - level * int(coding.step[slot]))
    return weight * error * error + price * _symbol_bits(
        coding.models, slot, level - int(coding.minimum[slot])
    )


@compiled
def _symbol_bits(models: Counts, slot: int, symbol: int) -> float:
    """Return the length of a symbol by the adaptive model."""
    return math.log2(float(models.total[slot]) / (1.0 + float(models.added[slot, symbol])))
