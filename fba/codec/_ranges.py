"""Ranges of values in planes: fitted to an animation, widened, and reported where a value is beyond them."""

from __future__ import annotations

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Int32, Int64, UInt8
from fba.codec._plane import full_turns, quantiser, slots
from fba.codec._plane.loops import quantise, quantise_change
from fba.codec.settings import RANGE_CODE_MAX, RANGE_UNIT, RangeLists
from fba.compiled import compiled
from fba.encoder_options import QUANT_MAX, EncoderOptions
from fba.errors import RangeError, Remedy
from fba.parameters import BAP_COUNT, BAP_STEP_TABLES, FAP_COUNT, FULL_TURN, Bap, Fap, baps, faps
from fba.tracks import batches


class Ranges:
    """Range codes of the face or the body, which grow with the data.

    codes: uint8 (4, 68) or (4, 296); I max, I min, P max, P min. changed: a decoder does not know them yet.
    """

    def __init__(self, part: int, options: EncoderOptions) -> None:
        self._part = part
        self._options = options
        self._scale = quantiser.scale(part, slots.quantiser_of(options, part))
        self._step = quantiser.steps(part, slots.quantiser_of(options, part), options.bap_steps)
        self._first = slots.FAPS.start - 2 if part == slots.FACE_BIT else slots.BAPS.start
        self.codes = np.zeros((4, FAP_COUNT if part == slots.FACE_BIT else BAP_COUNT), dtype=np.uint8)
        self.changed = True

    def start_from_tables(self) -> None:
        """Set the standard's limits, for data that is not known in advance."""
        table: tuple[Fap | Bap, ...] = faps() if self._part == slots.FACE_BIT else baps()
        for column, parameter in enumerate(table):
            i_limits, p_limits = parameter.i_limits, parameter.p_limits
            if i_limits is not None and p_limits is not None:
                limits = (i_limits[1], -i_limits[0], p_limits[1], -p_limits[0])
                self.codes[:, column] = [-(-limit // RANGE_UNIT) for limit in limits]

    def widen(self, slots_: Int64, levels: Int64) -> None:
        """Widen the ranges of slots (K,) to contain these levels as far as possible.

        levels: (4, K): I max, I min, P max, P min, the minima negated.
        """
        columns = slots_ - self._first
        wanted = np.minimum(self._codes(np.maximum(levels, 0)), RANGE_CODE_MAX)
        present = self.codes[:, columns]
        if (wanted > present).any():
            self.codes[:, columns] = np.maximum(present, wanted)
            self.changed = True

    def widen_for_intra(self, mask: Bool, row: Int32, position: int) -> None:
        """Widen the ranges to contain the sent values of row (columns,) in an I plane.

        With options.clamp, P planes get room to catch up with a value that no I plane can carry; without it,
        such a value is a RangeError. position: the frame that the error names.
        """
        coded, levels = self._levels(mask, row)
        beyond = ~self._fit(levels)
        if beyond.any():
            slot = int(coded[beyond][0])
            if not self._options.clamp:
                raise does_not_fit(slot, int(row[slot]), position, self._options)
            self.widen_to_catch_up(coded[beyond], levels[beyond])
        zeros = np.zeros_like(levels)
        self.widen(coded, np.stack([levels, -levels, zeros, zeros]))

    def widen_to_catch_up(self, slots_: Int64, levels: Int64) -> None:
        """Widen the ranges of P planes, which catch up after an I plane could not carry these levels."""
        columns = slots_ - self._first
        missing = np.maximum(self._codes(np.abs(levels)) - RANGE_CODE_MAX, 0) + 1
        self.codes[2:, columns] = np.minimum(self.codes[2:, columns] + missing, RANGE_CODE_MAX)
        self.changed = True

    def lacking(self, mask: Bool, row: Int32) -> Int64:
        """Return int64 (columns,): by how many levels an I plane with the widest ranges misses each value.

        0 for what is not sent. row: (columns,).
        """
        result = np.zeros(len(row), dtype=np.int64)
        coded, levels = self._levels(mask, row)
        result[coded] = np.maximum(np.abs(levels) - RANGE_CODE_MAX * RANGE_UNIT // self._scale, 0)
        return result

    def lists(self) -> RangeLists:
        """Return a copy of all four lists."""
        copies: list[UInt8] = [row.copy() for row in self.codes]
        return RangeLists(*copies)

    def _levels(self, mask: Bool, row: Int32) -> tuple[Int64, Int64]:
        """Return slots (K,) and levels (K,) that an I plane sends, except viseme and expression."""
        face = self._part == slots.FACE_BIT
        coded = np.flatnonzero(mask[2:]) + slots.FAPS.start if face else np.flatnonzero(mask) + self._first
        return coded, quantiser.levels(row[coded], self._step[coded - (0 if face else self._first)])

    def _fit(self, levels: Int64) -> Bool:
        """Return bool (K,): whether the widest range contains each level."""
        fitting: Bool = self._codes(np.abs(levels)) <= RANGE_CODE_MAX
        return fitting

    def _codes(self, levels: Int64) -> Int64:
        """Return the smallest codes whose limits, 60 x code / scale rounded down, reach levels from 0 up."""
        codes: Int64 = -(-levels * self._scale // RANGE_UNIT)
        return codes


def fitting_ranges(animation: Animation, options: EncoderOptions) -> dict[int, Ranges]:
    """Return by part the ranges that contain all values of an animation, as far as ranges can."""
    result = {}
    for part, track in ((slots.FACE_BIT, animation.face), (slots.BODY_BIT, animation.body)):
        if track is None:
            continue
        step = quantiser.steps(part, slots.quantiser_of(options, part), options.bap_steps)
        turn = np.where(full_turns.angle_slots() & options.clamp, FULL_TURN, 0)
        # The viseme and expression, the first two columns of a face, have fixed ranges.
        skipped, first = 2 * (part == slots.FACE_BIT), slots.BAPS.start
        if part == slots.FACE_BIT:
            step, first = step[slots.FAPS], slots.FAPS.start
        turn = turn[first : first + len(step)]
        extremes = np.zeros((4, len(step)), dtype=np.int64)
        before = np.zeros(len(step), dtype=np.int64), np.zeros(len(step), dtype=np.bool_)
        for frames in batches(track):
            mask = np.ascontiguousarray(frames.mask[:, skipped:])
            _extremes(np.ascontiguousarray(frames.values[:, skipped:]), mask, step, turn, extremes, *before)
        result[part] = Ranges(part, options)
        result[part].widen(np.arange(len(step)) + first, extremes)
    return result


@compiled
def _extremes(
    values: Int32, mask: Bool, step: Int64, turn: Int64, extremes: Int64, last_values: Int64, sent: Bool
) -> None:
    """Raise extremes (4, columns): largest and negated smallest levels of frames as I and as P planes.

    turn: int64 (columns,), the full turn by which P planes may change a value, or 0.
    last_values: int64 (columns,), the decoder's values before the first frame. sent: bool (columns,), whether
    the frame before it sent them. Both are updated to the last frame.

    Bounds: all arrays are as wide as values, since `fitting_ranges` makes them for the columns of one part.
    """
    for column in range(values.shape[1]):
        own_step, own_turn = int(step[column]), int(turn[column])
        last = int(last_values[column])
        following = bool(sent[column])
        for frame in range(values.shape[0]):
            if not mask[frame, column]:
                following = False
                continue
            value = int(values[frame, column])
            level = quantise(value, own_step)
            extremes[0, column] = max(int(extremes[0, column]), level)
            extremes[1, column] = max(int(extremes[1, column]), -level)
            if following:
                if own_turn and abs(value - last) > own_turn // 2:  # as `full_turns.follow` does
                    value += (last - value + own_turn // 2) // own_turn * own_turn
                change = quantise_change(value, last, own_step)
                extremes[2, column] = max(int(extremes[2, column]), change)
                extremes[3, column] = max(int(extremes[3, column]), -change)
                last += change * own_step
            else:
                last = level * own_step
            following = True
        last_values[column] = last
        sent[column] = following


CLAMP = Remedy("clamp", "or send the nearest value that fits with {}", "True", "EncoderOptions")


def does_not_fit(slot: int, value: int, position: int, options: EncoderOptions) -> RangeError:
    """Return the error for a value that no range can carry, with frame, parameter, limits and a remedy."""
    part = slots.part_of(slot)
    name = "fap_quant" if part == slots.FACE_BIT else "bap_quant"
    tables = BAP_STEP_TABLES if part == slots.BODY_BIT else (options.bap_steps,)
    fitting = {
        table: next(
            (q for q in range(QUANT_MAX + 1) if quantiser.largest(part, slot, q, table) >= abs(value)), None
        )
        for table in tables
    }
    largest = quantiser.largest(part, slot, slots.quantiser_of(options, part), options.bap_steps)
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
        f"the value {value} cannot be carried: with {name} {slots.quantiser_of(options, part)} the largest "
        f"is {largest}; {remedy}",
        parameter=slots.label(slot),
        value=value,
        limits=(-largest, largest),
        frame=position,
    ).with_remedies(CLAMP)
