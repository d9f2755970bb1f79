"""A common frame rate, and frame indices at it, for a stream that may change its rate and set its clock."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.arrays import Int64
from fba.codec._rows import Rows
from fba.codec._stream.clock import DEFAULT_RATE

COMMON_RATE_MAX = 1_000_000
"""Highest rate, in frames per second, that is chosen to make all times exact."""
_INT64_MAX = 2**63 - 1


@dataclass(frozen=True)
class _Run:
    """Frames of one rate, from position `first` on.

    A frame with the clock's index i is shown at start + (i - first_index) / rate seconds.
    """

    first: int
    first_index: int
    start: Fraction
    rate: Fraction


class TimeBase:
    """Collects the times of blocks in stream order; `index` / `rate` are the times of their frames.

    If the stream has one frame rate, that is the rate. Otherwise it is the lowest rate at which all frames
    have integer indices; beyond `COMMON_RATE_MAX`, it is the highest of the stream's rates, and times are
    rounded to the nearest frame. The result does not depend on how planes are divided into blocks.

    in_place: see `fba.codec._rows.Rows`; `index` may then be called only once, at the end.
    """

    def __init__(self, *, in_place: bool = False) -> None:
        self._in_place = in_place
        self._runs: list[_Run] = []
        self._rates: set[Fraction] = set()
        self._exact: Fraction | None = Fraction(1)  # lowest rate with exact times; None beyond a limit
        self._clock_index = Rows((), np.int64, in_place=in_place)
        self._index = self._clock_index
        self._index_rate = DEFAULT_RATE  # the rate of `_index`
        self._runs_placed = 0  # runs in `_index`, the last one perhaps not completely

    def add(self, index: Int64, start: Fraction, rate: Fraction) -> None:
        """Append frames shown at start + (index - index[0]) / rate; index int64 (T,), T >= 1."""
        if not self._continues(int(index[0]), start, rate):
            self._runs.append(_Run(self._clock_index.count, int(index[0]), start, rate))
            self._rates.add(rate)
            for part in (rate, 1 / start) if start else (rate,):
                self._extend_exact(part)
        self._clock_index.append(index, len(index))

    @property
    def rate(self) -> Fraction:
        """Frames per second; 25 before the first frame."""
        if len(self._rates) > 1:
            return self._exact or max(self._rates)
        return self._runs[0].rate if self._runs else DEFAULT_RATE

    def index(self) -> Int64:
        """Return int64 (T,), read-only, strictly increasing if the clock's indices are."""
        if len(self._rates) > 1:
            self._update_index(self.rate)
        return self._index.view()

    def _continues(self, index: int, start: Fraction, rate: Fraction) -> bool:
        """Whether a frame continues the last run."""
        if not self._runs:
            return False
        run = self._runs[-1]
        return rate == run.rate and start == run.start + Fraction(index - run.first_index) / rate

    def _extend_exact(self, rate: Fraction) -> None:
        """Make `_exact` a multiple of a rate, or None beyond the limit."""
        if not self._clock_index.count:
            self._exact = self._runs[0].rate
        if self._exact is not None:
            common = Fraction(
                math.lcm(self._exact.numerator, rate.numerator),
                math.gcd(self._exact.denominator, rate.denominator),
            )
            self._exact = common if common <= COMMON_RATE_MAX else None

    def _update_index(self, rate: Fraction) -> None:
        """Append the indices of new frames to `_index`; compute all of it anew if the rate has changed."""
        if self._index is self._clock_index or rate != self._index_rate:
            # a new array, because arrays that were returned must not change
            self._index = Rows((), np.int64, in_place=self._in_place)
            self._index_rate, self._runs_placed = rate, 0
        clock, placed = self._clock_index.view(), self._index
        runs = self._runs[max(self._runs_placed - 1, 0) :]
        for run, stop in zip(runs, [*(after.first for after in runs[1:]), len(clock)], strict=True):
            part = clock[max(run.first, placed.count) : stop]
            if len(part):
                piece = _round_index(run.start * rate, part - run.first_index, rate / run.rate)
                following = int(placed.view()[-1]) + 1 if placed.count else 0
                placed.append(piece + max(following - int(piece[0]), 0), len(piece))
        self._runs_placed = len(self._runs)


def _round_index(offset: Fraction, steps: Int64, factor: Fraction) -> Int64:
    """Return int64 (T,), nearest to offset + steps x factor; halves are rounded up."""
    offset += Fraction(1, 2)
    integral = math.floor(offset)
    rest = offset - integral
    divisor = rest.denominator * factor.denominator
    scale = factor.numerator * rest.denominator
    fits = (abs(int(steps[-1])) + 1) * scale + divisor < _INT64_MAX
    scaled = (steps if fits else steps.astype(object)) * scale + rest.numerator * factor.denominator
    result: Int64 = (scaled // divisor).astype(np.int64) + integral
    return result
