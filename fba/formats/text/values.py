"""Value lines of FAP and BAP files as numbers: many lines at once, and one with its fault named."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64, Int32, Int64
from fba.formats.text._layout import Layout

FRAME_NUMBER_MAX = 2**31 - 1

_NUMBER = re.compile(rb"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d+)?")


@dataclass(frozen=True, slots=True)
class Row:
    """The value line of a frame, without comment, as many numbers as its mask asks for.

    number: of the line. mask: number of the mask. brought: bool (1 + slots,), which numbers the mask
    brings, the frame number first.
    """

    line: bytes
    number: int
    mask: int
    brought: Bool


class ValueParser:
    """Turns rows into frame numbers and slots. rounded: values so far that were no integers;
    rounded_line: the first line with one."""

    def __init__(self, layout: Layout, angle_scale: float) -> None:
        self.layout = layout
        self.scale = angle_scale
        self.rounded = 0
        self.rounded_line = 0

    def parse(self, rows: list[Row]) -> tuple[Int64, Int32] | None:
        """Frame numbers (n,) and slots (n, slots), or None where any row has a fault."""
        brought = np.stack([row.brought for row in rows])
        flat = _numbers(b" ".join([row.line for row in rows]))
        if flat is None or len(flat) != int(brought.sum()) or not np.isfinite(flat).all():
            return None
        table: Float64 = np.zeros(brought.shape)
        table[brought] = flat
        index, slots = table[:, 0], table[:, 1:]
        if (np.abs(index) > FRAME_NUMBER_MAX).any() or (index != np.trunc(index)).any():
            return None
        fractions = slots != np.trunc(slots)
        if self.scale != 1:
            with np.errstate(over="ignore"):
                slots = np.where(self.layout.angle, slots * self.scale, slots)
        if self.scale != 1 or fractions.any():
            slots = _rounded(slots)
        if not ((slots >= self.layout.low) & (slots <= self.layout.high)).all():
            return None
        if fractions.any():
            if not self.rounded:
                self.rounded_line = rows[int(np.argmax(fractions.any(axis=1)))].number
            self.rounded += int(fractions.sum())
        return index.astype(np.int64), slots.astype(np.int32)

    def fault(self, row: Row) -> tuple[str, bytes] | None:
        """What is wrong with a row, and the token that is; None where nothing is."""
        brought = np.flatnonzero(row.brought) - 1
        for slot, token in zip(brought.tolist(), row.line.split(), strict=True):
            what = "the frame number" if slot < 0 else self.layout.names[slot]
            if token.lower().lstrip(b"+-") in (b"inf", b"infinity", b"nan"):
                return f"{what} must be a finite number", token
            if not _NUMBER.fullmatch(token):
                return f"{what} is no number", token
            value = float(token)
            if slot < 0:
                if not abs(value) <= FRAME_NUMBER_MAX or value != int(value):
                    return f"the frame number must be an integer up to {FRAME_NUMBER_MAX}", token
                continue
            scaled = ""
            if self.layout.angle[slot] and self.scale != 1:
                value *= self.scale
                scaled = f" after angle_scale {self.scale:g}"
            low, high = int(self.layout.low[slot]), int(self.layout.high[slot])
            if not low <= float(_rounded(np.array(value))) <= high:
                return f"{what} must lie in {low}..{high}{scaled}", token
        return None


def _numbers(text: bytes) -> Float64 | None:
    """All numbers of a text, or None where something in it is none."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        try:
            return np.fromstring(text, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            return None


def _rounded(values: Float64) -> Float64:
    """Integers, half away from zero; infinities stay what they are."""
    whole = np.trunc(values)
    with np.errstate(invalid="ignore"):
        away = np.abs(values - whole) >= 0.5
    return whole + np.where(away, np.sign(values), 0.0)
