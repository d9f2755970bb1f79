"""Parse value lines of FAP and BAP files, many at once; find the fault of a single line."""

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
    """Value line of a frame, without comment, with as many numbers as its mask asks for.

    number: of the line, 1-based. mask: number of the mask. present: bool (1 + slots,), the numbers that are
    on the line, the frame number first.
    """

    line: bytes
    number: int
    mask: int
    present: Bool


class ValueParser:
    """Parser of rows into frame numbers and slots.

    rounded: count of values so far that were no integers. rounded_line: the first line with such a value.
    """

    def __init__(self, layout: Layout, angle_scale: float) -> None:
        self.layout = layout
        self.scale = angle_scale
        self.rounded = 0
        self.rounded_line = 0

    def parse(self, rows: list[Row]) -> tuple[Int64, Int32] | None:
        """Return frame numbers (n,) and slots (n, slots), or None if any row has a fault."""
        present = np.stack([row.present for row in rows])
        flat = _numbers(b" ".join([row.line for row in rows]))
        if flat is None or len(flat) != int(present.sum()) or not np.isfinite(flat).all():
            return None
        table: Float64 = np.zeros(present.shape)
        table[present] = flat
        index, slots = table[:, 0], table[:, 1:]
        if (np.abs(index) > FRAME_NUMBER_MAX).any() or (index != np.trunc(index)).any():
            return None
        fractions = slots != np.trunc(slots)
        if self.scale != 1:
            with np.errstate(over="ignore"):
                slots = np.where(self.layout.angle, slots * self.scale, slots)
        if self.scale != 1 or fractions.any():
            slots = _round(slots)
        if not ((slots >= self.layout.low) & (slots <= self.layout.high)).all():
            return None
        if fractions.any():
            if not self.rounded:
                self.rounded_line = rows[int(np.argmax(fractions.any(axis=1)))].number
            self.rounded += int(fractions.sum())
        return index.astype(np.int64), slots.astype(np.int32)

    def find_fault(self, row: Row) -> tuple[str, bytes] | None:
        """Return the fault of a row and its token; None for a row without a fault."""
        slots = np.flatnonzero(row.present) - 1
        for slot, token in zip(slots.tolist(), row.line.split(), strict=True):
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
            if not low <= float(_round(np.array(value))) <= high:
                return f"{what} must lie in {low}..{high}{scaled}", token
        return None


def _numbers(text: bytes) -> Float64 | None:
    """Return all numbers of a text; None if a word in it is no number."""
    with warnings.catch_warnings(action="error", category=DeprecationWarning):
        try:
            return np.fromstring(text, dtype=np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            return None


def _round(values: Float64) -> Float64:
    """Return integers, halves rounded away from zero; infinities unchanged."""
    truncated = np.trunc(values)
    with np.errstate(invalid="ignore"):
        away = np.abs(values - truncated) >= 0.5
    return truncated + np.where(away, np.sign(values), 0.0)
