"""Ranges of values in planes: fit them to an animation, widen them, report values beyond them."""

from __future__ import annotations

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Int32, Int64, UInt8
from fba.codec._options import EncoderOptions
from fba.codec._plane import quantiser, slots
from fba.codec._plane.loops import quantise
from fba.codec.settings import QUANT_MAX, RANGE_CODE_MAX, RANGE_UNIT, RangeLists
from fba.compiled import compiled
from fba.errors import RangeError, Remedy
from fba.parameters import BAP_COUNT, BAP_STEP_TABLES, FAP_COUNT, INTENSITY_MAX, Bap, Fap, baps, faps

_ROUNDED_AMOUNT_MAX = max((INTENSITY_MAX + quant // 2) // quant * quant for quant in range(1, QUANT_MAX + 1))
"""Largest blend or intensity that a decoder returns for any quantiser: 75, with fap_quant 25."""


class Ranges:
    """Range codes of the face or the body, which grow with the data.

    codes: uint8 (4, 68) or (4, 296); I max, I min, P max, P min.
    """

    def __init__(self, part: int, quant: int) -> None:
        self._part = part
        self._scale = quantiser.scale(part, quant)
        self._first = slots.FAPS.start - 2 if part == slots.FACE_BIT else slots.BAPS.start
        self.codes = np.zeros((4, FAP_COUNT if part == slots.FACE_BIT else BAP_COUNT), dtype=np.uint8)

    def start_from_tables(self) -> None:
        """Set the standard's own limits, for data that is not known in advance."""
        table: tuple[Fap | Bap, ...] = faps() if self._part == slots.FACE_BIT else baps()
        for column, one in enumerate(table):
            if one.i_limits is not None and one.p_limits is not None:
                limits = (one.i_limits[1], -one.i_limits[0], one.p_limits[1], -one.p_limits[0])
                self.codes[:, column] = [-(-limit // RANGE_UNIT) for limit in limits]

    def widen(self, slots_: Int64, levels: Int64) -> bool:
        """Widen the ranges of slots (K,) to hold these levels as far as possible; return whether any changed.

        levels: (4, K): I max, I min, P max, P min, the minima negated.
        """
        columns = slots_ - self._first
        wanted = np.minimum(self._codes(np.maximum(levels, 0)), RANGE_CODE_MAX)
        held = self.codes[:, columns]
        wider = bool((wanted > held).any())
        if wider:
            self.codes[:, columns] = np.maximum(held, wanted)
        return wider

    def widen_to_catch_up(self, slots_: Int64, levels: Int64) -> None:
        """Widen the ranges of P planes, which catch up after an I plane could not carry these levels."""
        columns = slots_ - self._first
        missing = np.maximum(self._codes(np.abs(levels)) - RANGE_CODE_MAX, 0) + 1
        self.codes[2:, columns] = np.minimum(self.codes[2:, columns] + missing, RANGE_CODE_MAX)

    def is_widest(self, slot: int) -> bool:
        """Whether differences of a slot have the widest range there is."""
        return bool((self.codes[2:, slot - self._first] == RANGE_CODE_MAX).all())

    def fits(self, levels: Int64) -> Bool:
        """Return bool (K,): whether the widest range can hold each level."""
        fitting: Bool = self._codes(np.abs(levels)) <= RANGE_CODE_MAX
        return fitting

    def lists(self) -> RangeLists:
        """Return a copy of all four lists."""
        copies: list[UInt8] = [row.copy() for row in self.codes]
        return RangeLists(*copies)

    def _codes(self, levels: Int64) -> Int64:
        """Return the smallest codes whose limits, 60 x code / scale rounded down, reach levels from 0 up."""
        codes: Int64 = -(-levels * self._scale // RANGE_UNIT)
        return codes


def fitting_ranges(animation: Animation, options: EncoderOptions) -> dict[int, Ranges]:
    """Return by part the ranges that hold all values of an animation, as far as any can."""
    result = {}
    for part, track in ((slots.FACE_BIT, animation.face), (slots.BODY_BIT, animation.body)):
        if track is None:
            continue
        ranges = Ranges(part, options.quant(part))
        step = quantiser.steps(part, options.quant(part), options.bap_steps)
        skipped = 2 if part == slots.FACE_BIT else 0  # the viseme and expression have fixed ranges
        if part == slots.FACE_BIT:
            step = step[slots.FAPS]
        extremes = np.zeros((4, track.values.shape[1] - skipped), dtype=np.int64)
        _extremes(track.values[:, skipped:], track.mask[:, skipped:], step, extremes)
        first = slots.FAPS.start if part == slots.FACE_BIT else slots.BAPS.start
        ranges.widen(np.arange(extremes.shape[1]) + first, extremes)
        result[part] = ranges
    return result


@compiled
def _extremes(values: Int32, mask: Bool, step: Int64, extremes: Int64) -> None:
    """Fill extremes (4, columns): largest and negated smallest levels of frames as I and as P planes."""
    for column in range(values.shape[1]):
        one_step = int(step[column])
        last = 0
        following = False
        for frame in range(values.shape[0]):
            if not mask[frame, column]:
                following = False
                continue
            value = int(values[frame, column])
            level = quantise(value, one_step)
            extremes[0, column] = max(int(extremes[0, column]), level)
            extremes[1, column] = max(int(extremes[1, column]), -level)
            if following:
                change = quantise(value - last, one_step)
                extremes[2, column] = max(int(extremes[2, column]), change)
                extremes[3, column] = max(int(extremes[3, column]), -change)
                last += change * one_step
            else:
                last = level * one_step
            following = True


CLAMP = Remedy("clamp", "or bring what does not fit as near as can be with {}", "True", "EncoderOptions")


def does_not_fit(slot: int, value: int, position: int, options: EncoderOptions) -> RangeError:
    """Return the error for a value that no range can carry, with frame, parameter, limits and a remedy."""
    part = slots.FACE_BIT if slot < slots.FAPS.stop else slots.BODY_BIT
    column = slot if part == slots.FACE_BIT else slot - slots.BAPS.start
    name = "fap_quant" if part == slots.FACE_BIT else "bap_quant"
    tables = BAP_STEP_TABLES if part == slots.BODY_BIT else (options.bap_steps,)
    fitting = {
        table: next((q for q in range(QUANT_MAX + 1) if _largest(part, column, q, table) >= abs(value)), None)
        for table in tables
    }
    largest = _largest(part, column, options.quant(part), options.bap_steps)
    here = fitting[options.bap_steps]
    others = [
        f"bap_steps {table} with {name} {q}"
        for table, q in fitting.items()
        if q is not None and table != options.bap_steps
    ]
    if here is not None:
        remedy = f"the smallest quantiser that would do is {name} {here}"
    elif others:
        remedy = f"no {name} would do; {others[0]} would"
    else:
        remedy = f"no {name} would do"
    return RangeError(
        f"the value {value} cannot be carried: with {name} {options.quant(part)} the largest is {largest}; "
        f"{remedy}",
        parameter=slots.label(slot),
        value=value,
        limits=(-largest, largest),
        frame=position,
    ).with_remedies(CLAMP)


def _largest(part: int, column: int, quant: int, table: str) -> int:
    """Return the largest value that an I plane can carry in a column with this quantiser."""
    step = int(quantiser.steps(part, quant, table)[column])
    limit = RANGE_CODE_MAX * RANGE_UNIT // quantiser.scale(part, quant)
    return limit * step + (step - 1) // 2


def clip_amounts(rows: Int32) -> list[tuple[int, int, int]]:
    """Limit blends and intensities to 0..63, in place: a coarse quantiser makes a decoder round beyond that.

    Returns row, slot and value of those that no quantiser explains, in order.
    """
    amounts = rows[:, slots.AMOUNTS]
    wrong = np.argwhere((amounts < 0) | (amounts > _ROUNDED_AMOUNT_MAX)).tolist()
    rows[:, slots.AMOUNTS] = np.clip(amounts, 0, INTENSITY_MAX)
    return [(row, slots.AMOUNTS[column], int(amounts[row, column])) for row, column in wrong]
