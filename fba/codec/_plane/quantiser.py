"""Quantiser steps: table step times fap_quant, or times the predictive scale of bap_quant."""

from __future__ import annotations

from functools import cache

import numpy as np

from fba.arrays import Int64, Integer
from fba.codec._plane import slots
from fba.codec.settings import RANGE_CODE_MAX, RANGE_UNIT
from fba.encoder_options import QUANT_MAX
from fba.parameters import INTENSITY_MAX, BapTable, bap_steps, fap_steps

BAP_PREDICTIVE_SCALE = (
    0, 1, 2, 3, 5, 7, 9, 11, 14, 17, 20, 23, 27, 31, 35, 39, 43, 47, 52, 57, 62, 67, 72, 77, 82, 88, 94, 100,
    106, 113, 120, 127,
)  # fmt: skip
"""bap_pred_scale by bap_quant; 0: not quantised."""

ROUNDED_AMOUNT_MAX = max((INTENSITY_MAX + quant // 2) // quant * quant for quant in range(1, QUANT_MAX + 1))
"""Largest blend or intensity that a decoder returns for any quantiser: 75, with fap_quant 25."""


def scale(part: int, quant: int) -> int:
    """Return the factor of table steps, by which limits of ranges are divided; 1 without quantisation."""
    return max(quant if part == slots.FACE_BIT else BAP_PREDICTIVE_SCALE[quant], 1)


@cache
def steps(part: int, quant: int, bap_table: BapTable) -> Int64:
    """Return the steps of a part, int64 (73,) or (296,) in slot order; 1 for unquantised values."""
    factor = scale(part, quant)
    if part == slots.BODY_BIT:
        table = bap_steps(bap_table)
        return table * factor if quant else np.ones_like(table)
    result = np.ones(slots.FAPS.stop, dtype=np.int64)
    if quant:
        result[slots.FAPS] = fap_steps()[2:] * quant
        result[slots.AMOUNTS] = quant  # blend and intensities; selects are never quantised
    return result


def levels(values: Integer, step: Int64) -> Int64:
    """Return the levels of values: nearest multiples of step, halves away from 0, but 0 up to step // 2."""
    size, half = np.abs(values.astype(np.int64)), step // 2
    quantised: Int64 = np.sign(values) * np.where(size <= half, 0, (size + half) // step)
    return quantised


def largest(part: int, slot: int, quant: int, bap_table: BapTable) -> int:
    """Return the largest value that an I plane can carry in a slot with this quantiser."""
    step = int(steps(part, quant, bap_table)[slot if part == slots.FACE_BIT else slot - slots.BAPS.start])
    limit = RANGE_CODE_MAX * RANGE_UNIT // scale(part, quant)
    return limit * step + (step - 1) // 2
