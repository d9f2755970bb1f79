"""What an encoder decides: masks, ranges, frame rate and time code of the planes it writes."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

import numpy as np

from fba.animation import Animation
from fba.arrays import Bool, Int32, Int64, UInt8
from fba.codec._plane import quantiser, slots, syntax
from fba.codec._plane.loops import quantise
from fba.codec.settings import QUANT_MAX, RANGE_CODE_MAX, RANGE_UNIT, FrameRate, RangeLists, TimeCode
from fba.compiled import compiled
from fba.errors import FbaWarning, RangeError, Remedy
from fba.parameters import BAP_COUNT, BAP_STEP_TABLES, FAP_COUNT, INTENSITY_MAX, Bap, Fap, baps, faps

PRESETS = ("reference",)
_HOURS = 32
_ROUNDED_AMOUNT_MAX = max((INTENSITY_MAX + quant // 2) // quant * quant for quant in range(1, QUANT_MAX + 1))
"""Largest blend or intensity that any quantiser makes a decoder give: 75, by fap_quant 25."""


@dataclass(frozen=True)
class EncoderOptions:
    """How to encode.

    fap_quant, bap_quant: 0..31. A FAP's quantiser step is the standard's table step times fap_quant, a
        BAP's the table step times bap_pred_scale[bap_quant]; 0 sends values as they are. Default 1.
    intra_period: seconds from one I plane to the next at most; None: only where one is needed.
    start_codes: a plane start code before every I plane after the first, and all ranges with each, so
        that a reader can join there or go on after damage.
    bap_steps: "iso" or "visage", the table of BAP steps; the reader must be told the same.
    preset: "reference", ranges that fit the data.
    unsent: what a FAP that is not sent means to the reader where the animation does not say so
        (`FaceTrack.interpolated`): "keep" its last value (mask type 1) or "interpolate" it from others
        (mask type 2).
    gender: suggested_gender, 1 male.
    clamp: bring values that no range can carry as near as it can, instead of a RangeError: I planes
        stop at the end of the widest range, and P planes after them catch up.

    Raises ValueError on anything else.
    """

    fap_quant: int = 1
    bap_quant: int = 1
    intra_period: Fraction | float | None = None
    start_codes: bool = False
    bap_steps: str = "iso"
    preset: str = "reference"
    unsent: str = "keep"
    gender: int = 0
    clamp: bool = False

    def __post_init__(self) -> None:
        for name in ("fap_quant", "bap_quant"):
            value = getattr(self, name)
            if not isinstance(value, (int, np.integer)) or not 0 <= value <= QUANT_MAX:
                raise ValueError(f"{name} must be an integer in 0..{QUANT_MAX}, not {value!r}")
        if self.intra_period is not None and not (self.intra_period > 0 and math.isfinite(self.intra_period)):
            raise ValueError(f"intra_period must be a positive number of seconds, not {self.intra_period!r}")
        for name, allowed in (
            ("bap_steps", BAP_STEP_TABLES),
            ("preset", PRESETS),
            ("unsent", ("keep", "interpolate")),
            ("gender", (0, 1)),
        ):
            if getattr(self, name) not in allowed:
                said = ", ".join(map(str, allowed))
                raise ValueError(f"{name} must be one of {said}, not {getattr(self, name)!r}")

    def quant(self, part: int) -> int:
        return self.fap_quant if part == slots.FACE_BIT else self.bap_quant


class Ranges:
    """Range codes of a part that grow with the data.

    codes: uint8 (4, 68) or (4, 296); I max, I min, P max, P min.
    """

    def __init__(self, part: int, quant: int) -> None:
        self._part = part
        self._scale = quantiser.scale(part, quant)
        self._first = slots.FAPS.start - 2 if part == slots.FACE_BIT else slots.BAPS.start
        self.codes = np.zeros((4, FAP_COUNT if part == slots.FACE_BIT else BAP_COUNT), dtype=np.uint8)

    def start_from_tables(self) -> None:
        """The standard's own limits: where to begin when the data is not known yet."""
        table: tuple[Fap | Bap, ...] = faps() if self._part == slots.FACE_BIT else baps()
        for column, one in enumerate(table):
            if one.i_limits is not None and one.p_limits is not None:
                limits = (one.i_limits[1], -one.i_limits[0], one.p_limits[1], -one.p_limits[0])
                self.codes[:, column] = [-(-limit // RANGE_UNIT) for limit in limits]

    def widen(self, slots_: Int64, levels: Int64) -> bool:
        """Hold these levels of slots (K,), as far as can be; whether that took wider ranges.

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
        """After an I plane that falls short of these levels: let P planes make up for what is missing."""
        columns = slots_ - self._first
        missing = np.maximum(self._codes(np.abs(levels)) - RANGE_CODE_MAX, 0) + 1
        self.codes[2:, columns] = np.minimum(self.codes[2:, columns] + missing, RANGE_CODE_MAX)

    def is_widest(self, slot: int) -> bool:
        """Whether differences of a slot have the widest range there is."""
        return bool((self.codes[2:, slot - self._first] == RANGE_CODE_MAX).all())

    def fits(self, levels: Int64) -> Bool:
        """Which of the levels any range can hold."""
        fitting: Bool = self._codes(np.abs(levels)) <= RANGE_CODE_MAX
        return fitting

    def lists(self) -> RangeLists:
        """All four lists, as they are now."""
        copies: list[UInt8] = [row.copy() for row in self.codes]
        return RangeLists(*copies)

    def _codes(self, levels: Int64) -> Int64:
        """Smallest codes whose limits, 60 x code / scale rounded down, reach the levels (0 and up)."""
        codes: Int64 = -(-levels * self._scale // RANGE_UNIT)
        return codes


def mask_types(part: int, mask: Bool, interpolated: Bool | None, unsent: str) -> tuple[int, ...]:
    """Mask type of every group: none, all, or masked (BAPs are always kept).

    interpolated: bool (68,), what the animation asks to have interpolated, or None. A group of which
    all that is unsent shall be interpolated says so; one type holds for the whole group. Where the
    animation asks for none of a group, `unsent` decides.
    """
    return _mask_types(
        part, mask.tobytes(), interpolated.tobytes() if interpolated is not None else b"", unsent
    )


@lru_cache(maxsize=64)
def _mask_types(part: int, mask: bytes, interpolated: bytes, unsent: str) -> tuple[int, ...]:
    """Of bytes, to be kept: asked for with every frame that an encoder takes."""
    some = syntax.MASK_INTERPOLATE if unsent == "interpolate" and part == slots.FACE_BIT else syntax.MASK_KEEP
    types = []
    for group in syntax.groups(part):
        sent = [mask[number - 1] for number in group]
        if all(sent):
            types.append(syntax.MASK_ALL)
        elif interpolated and all(mask[number - 1] or interpolated[number - 1] for number in group):
            types.append(syntax.MASK_INTERPOLATE)
        else:
            types.append(some if any(sent) else syntax.MASK_NONE)
    return tuple(types)


def frame_rate(rate: Fraction) -> FrameRate:
    """The header fields for a rate. Raises RangeError where the syntax cannot carry it."""
    fields = FrameRate.from_fraction(rate)
    if fields is None:
        nearest = max(Fraction(round(rate * 16), 16), Fraction(1, 16))
        raise RangeError(
            f"{rate} frames/s cannot be coded: a rate is n/16 below 256, or 1000/1001 of that"
        ).with_remedies(
            Remedy(
                "rate", "resample first, e.g. with {}", f"{float(min(nearest, Fraction(4095, 16))):g}",
                "Animation.resample",
            )
        )  # fmt: skip
    return fields


def time_code(index: int, rate: Fraction) -> TimeCode | None:
    """The time code that makes a decoder show the first plane at this index; None where index is 0.

    Time codes count whole seconds below 32 hours. A start that none gives is left out, with an FbaWarning.
    """
    if index == 0:
        return None
    seconds = math.floor(index / rate + Fraction(1, 2))
    if 0 <= seconds < _HOURS * 3600 and math.floor(seconds * rate + Fraction(1, 2)) == index:
        return TimeCode(seconds // 3600, seconds // 60 % 60, seconds % 60)
    warnings.warn(
        f"the animation starts at {float(index / rate):g} s, which no time code says; the stream starts at 0",
        FbaWarning,
        stacklevel=3,
    )
    return None


def fitting_ranges(animation: Animation, options: EncoderOptions) -> dict[int, Ranges]:
    """The ranges that hold all of an animation, as far as any do, by part."""
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
    """Largest and negated smallest levels of I and P planes, per column, were each frame coded as both."""
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
    """The error for a value that no range can carry: frame, parameter, limits, what would help."""
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
    """Largest value that an I plane carries in a slot at a quantiser."""
    step = int(quantiser.steps(part, quant, table)[column])
    limit = RANGE_CODE_MAX * RANGE_UNIT // quantiser.scale(part, quant)
    return limit * step + (step - 1) // 2


def clip_amounts(rows: Int32) -> list[tuple[int, int, int]]:
    """Bring blends and intensities into 0..63: a coarse quantiser makes a decoder round them past it.

    Returns row, slot and value of those that are too far away for that, in order.
    """
    amounts = rows[:, slots.AMOUNTS]
    wrong = np.argwhere((amounts < 0) | (amounts > _ROUNDED_AMOUNT_MAX)).tolist()
    rows[:, slots.AMOUNTS] = np.clip(amounts, 0, INTENSITY_MAX)
    return [(row, slots.AMOUNTS[column], int(amounts[row, column])) for row, column in wrong]
