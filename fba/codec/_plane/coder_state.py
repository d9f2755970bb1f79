"""State of the coder between planes: ranges in force, quantiser steps, adaptive models, last values."""

from __future__ import annotations

from functools import cache

import numpy as np

from fba.arrays import Int64, UInt16
from fba.codec._plane import loops, quantiser, slots
from fba.codec._plane.arithmetic import STRIDE
from fba.codec._plane.header_loops import begin_models
from fba.codec._plane.loops import State
from fba.codec.settings import RANGE_UNIT, PartSettings
from fba.parameters import EXPRESSION_SELECT_MAX, INTENSITY_MAX, VISEME_SELECT_MAX, BapTable, baps, faps

UNDEFINED = -1
"""Limit of a parameter without a default range, as long as no range was sent."""

_SELECTS = (0, 1, 3, 5)
_SELECT_LIMITS = np.array(
    [VISEME_SELECT_MAX] * 2 + [0] + [EXPRESSION_SELECT_MAX, 0, EXPRESSION_SELECT_MAX, 0]
)
_INT32 = np.iinfo(np.int32)


def _row(number: int) -> property:
    """Return a property of `Models`: this row of its numbers, int64 (372,), to be read and written."""

    def row(models: Models) -> Int64:
        numbers: Int64 = models.state.numbers[number]
        return numbers

    return property(row)


class Models:
    """State that encoder and decoder must share, as arrays over the 372 slots (see `slots`).

    `i_minimum`, `i_size`, `minimum`, `size`: smallest level and number of symbols, for I and P planes.
    `step`, `last`: quantiser step and last value. `lowest`, `highest`: limits of values. All are rows of
    `state`, which also has the adaptive models of P planes (see `arithmetic`); models of the body take 4 MB
    and are made when a body comes. The rows are looked up each time: stored views would not follow a copy's
    state.
    """

    i_minimum, i_size = _row(loops.I_MINIMUM), _row(loops.I_SIZE)
    minimum, size = _row(loops.P_MINIMUM), _row(loops.P_SIZE)
    step, last = _row(loops.STEP), _row(loops.LAST)
    lowest, highest = _row(loops.LOWEST), _row(loops.HIGHEST)

    def __init__(self, bap_table: BapTable) -> None:
        self.bap_table = bap_table
        self.limits = default_limits().copy()
        numbers = np.zeros((loops.NUMBERS, slots.SLOTS), dtype=np.int64)
        numbers[[loops.I_SIZE, loops.P_SIZE, loops.STEP, loops.TOTAL]] = 1
        self.state = State(numbers, _table(slots.BAPS.start), _table(slots.BAPS.start))
        self.lowest[:] = _INT32.min
        self.highest[:] = _INT32.max
        self.lowest[slots.AMOUNTS] = -2 * INTENSITY_MAX  # the quantiser may round them past 0..63
        self.highest[slots.AMOUNTS] = 2 * INTENSITY_MAX
        self.lowest[list(_SELECTS)] = 0
        self.highest[list(_SELECTS)] = _SELECT_LIMITS[list(_SELECTS)]

    def begin_object(self) -> None:
        """Forget all ranges that were sent; the next I planes set the rest of the state."""
        self.limits[:] = default_limits()

    def begin_intra(self, part: int, settings: PartSettings) -> None:
        """Apply the settings of an I plane to a part: set ranges and steps, and reset the models."""
        columns = slots.FAPS if part == slots.FACE_BIT else slots.BAPS
        if len(self.state.added) < columns.stop:
            self._make_room_for_body()
        coded = settings.mask[2:] if part == slots.FACE_BIT else settings.mask
        for limits, codes in zip(self.limits, settings.ranges, strict=True):
            if codes is not None:
                sent = codes[2:] if part == slots.FACE_BIT else codes
                limits[columns][coded] = RANGE_UNIT * sent[coded].astype(np.int64)
        span = slice(0 if part == slots.FACE_BIT else columns.start, columns.stop)
        self.step[span] = quantiser.steps(part, settings.quant, self.bap_table)
        scale = quantiser.scale(part, settings.quant)
        high_level = _SELECT_LIMITS.copy()
        high_level[slots.AMOUNTS] = (
            (INTENSITY_MAX + settings.quant // 2) // scale if settings.quant else INTENSITY_MAX
        )
        begin_models((span.start, span.stop), scale, self.limits, high_level, self.state)

    def _make_room_for_body(self) -> None:
        """Add the models of the BAPs to those of the FAPs."""
        face, self.state = self.state, State(self.state.numbers, _table(slots.SLOTS), _table(slots.SLOTS))
        self.state.added[: len(face.added)] = face.added
        self.state.tree[: len(face.tree)] = face.tree

    def undefined(self, settings: PartSettings, part: int) -> int | None:
        """Return a slot that the settings send although it has no range, or None."""
        if part == slots.FACE_BIT:
            return None
        missing = np.flatnonzero((self.limits[:, slots.BAPS] == UNDEFINED).any(axis=0) & settings.mask)
        return int(missing[0]) + slots.BAPS.start if len(missing) else None


def _table(count: int) -> UInt16:
    """Return zeros, uint16 (count, STRIDE), for the models of `count` slots."""
    return np.zeros((count, STRIDE), dtype=np.uint16)


@cache
def default_limits() -> Int64:
    """Return the default ranges, int64 (4, 372): magnitudes of I max, I min, P max, P min.

    Not yet divided by the quantiser's scale. FAPs: symmetric, the largest limit in the standard's table
    rounded up to a multiple of 60; FAP 47 as in the reference decoder. BAPs: the limits of the table.
    Extension BAPs have no range: UNDEFINED.
    """
    limits = np.zeros((4, slots.SLOTS), dtype=np.int64)
    for fap in faps()[2:]:
        assert fap.i_limits is not None
        assert fap.p_limits is not None
        i_limit, p_limit = (1080, 420) if fap.number == 47 else (max(fap.i_limits), max(fap.p_limits))
        rounded = [-(-limit // RANGE_UNIT) * RANGE_UNIT for limit in (i_limit, i_limit, p_limit, p_limit)]
        limits[:, slots.fap_slot(fap.number)] = rounded
    for bap in baps():
        if bap.i_limits is None or bap.p_limits is None:
            limits[:, slots.bap_slot(bap.number)] = UNDEFINED
        else:
            limits[:, slots.bap_slot(bap.number)] = (
                bap.i_limits[1], -bap.i_limits[0], bap.p_limits[1], -bap.p_limits[0],
            )  # fmt: skip
    return limits
