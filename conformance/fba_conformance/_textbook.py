"""The adaptive arithmetic coder of FBA planes as in a textbook: a linear search, plain integers.

ISO/IEC 14496-2, FBA object plane, predictive mode. Written for clarity, to check a faster coder, so it
shares no code with `fba.codec`.

A segment is a run of symbols between a start (low 0, high 65535) and a flush. The decoder holds 16 bits, of
which the flush wrote only 2: it has always read 14 bits of what follows. So the length of a segment is the
number of bits shifted out, plus 2, and the bits beyond are not checked.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass

from fba.errors import BitstreamError

HALF = 32768
QUARTER = 16384
TOP = 65535
"""Of the interval of 16 bits: half, quarter, and largest value."""
COUNT_LIMIT = 16383
"""Sum of a table's counts at which all are halved."""
ZERO_RUN = 22
"""Number of zero bits after which a 1 is inserted, so that no start code (23 zeros) can appear."""
REGISTER_BITS = 16
FLUSH_BITS = 2


class FrequencyTable:
    """Counts of the symbols of an alphabet, which all start at 1.

    Only symbols with counts above 1 are stored, in order: of the thousands of symbols of a wide range a
    stream uses a few dozen. extra: their counts minus 1.
    """

    def __init__(self, size: int) -> None:
        self.size = size
        self.total = size
        self.symbols: list[int] = []
        self.extra: list[int] = []

    def find(self, target: int) -> tuple[int, int, int]:
        """Return the symbol at a target (0 <= target < total), and the cumulated counts around it.

        Returns symbol, sum of the counts from it on, and sum of the counts after it: symbol 0 is at the top.
        """
        symbol, above = 0, self.total
        for seen, extra in zip(self.symbols, self.extra, strict=True):
            if above - (seen - symbol) <= target:
                break  # among the symbols of count 1 before this one
            above -= seen - symbol
            if above - 1 - extra <= target:
                return seen, above, above - 1 - extra
            symbol, above = seen + 1, above - 1 - extra
        before = above - target - 1
        return symbol + before, above - before, above - before - 1

    def share(self, symbol: int) -> tuple[int, int]:
        """Return the sum of the counts from symbol on, and of those after it."""
        position = bisect_left(self.symbols, symbol)
        own = self.extra[position] if position < len(self.symbols) and self.symbols[position] == symbol else 0
        above = self.size - symbol + sum(self.extra[position:])
        return above, above - 1 - own

    def learn(self, symbol: int) -> None:
        """Count a symbol; at the limit, halve every count first (rounding up, so that 1 stays 1)."""
        if self.total >= COUNT_LIMIT:
            halved = [(s, e // 2) for s, e in zip(self.symbols, self.extra, strict=True) if e > 1]
            self.symbols = [s for s, _ in halved]
            self.extra = [e for _, e in halved]
            self.total = self.size + sum(self.extra)
        position = bisect_left(self.symbols, symbol)
        if position < len(self.symbols) and self.symbols[position] == symbol:
            self.extra[position] += 1
        else:
            self.symbols.insert(position, symbol)
            self.extra.insert(position, 1)
        self.total += 1


@dataclass(frozen=True, slots=True)
class Segment:
    """A decoded segment.

    symbols: one for each table. bits: length in the stream, with flush and inserted bits. inserted: number of
    inserted 1 bits.
    """

    symbols: tuple[int, ...]
    bits: int
    inserted: int


class _GuardedBits:
    """Bits of a segment without the inserted ones; zeros after the end of the data."""

    def __init__(self, data: bytes, start: int) -> None:
        self.data = data
        self.size = len(data) * 8
        self.position = start
        self.zeros = 0
        self.count = 0  # bits returned
        self.insertions: list[int] = []  # number of bits returned before each inserted one
        self.violation: tuple[int, int] | None = None  # the same for the first 0 in its place; its position

    def _raw(self) -> int:
        """Return the next bit of the stream."""
        position = self.position
        self.position = position + 1
        return self.data[position >> 3] >> (7 - (position & 7)) & 1 if position < self.size else 0

    def next(self) -> int:
        """Return the next bit that was not inserted."""
        if self.zeros == ZERO_RUN:
            self.insertions.append(self.count)
            if not self._raw() and self.violation is None:
                self.violation = self.count, self.position - 1
            self.zeros = 0
        bit = self._raw()
        self.zeros = 0 if bit else self.zeros + 1
        self.count += 1
        return bit


def decode_segment(
    data: bytes,
    start: int,
    tables: Sequence[FrequencyTable],
    *,
    learn: bool,
    name: str = "arithmetic segment",
    plane: int | None = None,
) -> Segment:
    """Read one symbol for each table from bit `start` of data; with `learn`, the tables count them.

    Raises BitstreamError with `name` and `plane` if the data ends inside the segment, 22 zeros are not
    followed by a 1, or the segment does not close as a coder closes it: that finds much of the damage that
    would otherwise become wrong values.
    """
    source = _GuardedBits(data, start)
    low, high, code = 0, TOP, 0
    for _ in range(REGISTER_BITS):
        code = code * 2 + source.next()
    symbols = []
    for table in tables:
        span = high - low + 1
        symbol, upper, lower = table.find(((code - low + 1) * table.total - 1) // span)
        high = low - 1 + span * upper // table.total
        low += span * lower // table.total
        while True:
            if high < HALF:
                offset = 0
            elif low >= HALF:
                offset = HALF
            elif low >= QUARTER and high < HALF + QUARTER:
                offset = QUARTER
            else:
                break
            low = (low - offset) * 2
            high = (high - offset) * 2 + 1
            code = (code - offset) * 2 + source.next()
        if learn:
            table.learn(symbol)
        symbols.append(symbol)
    used = source.count - REGISTER_BITS + FLUSH_BITS
    inserted = sum(1 for before in source.insertions if before < used)
    end = start + used + inserted
    if source.violation is not None and source.violation[0] < used and source.violation[1] < len(data) * 8:
        raise BitstreamError(
            f"{name}: {ZERO_RUN} zero bits are followed by another 0, where an inserted 1 was expected; "
            "the stream is damaged here or before",
            plane=plane,
            bit=source.violation[1],
        )
    if end > len(data) * 8:
        raise BitstreamError(
            f"{name}: starts at bit {start} and is not over where the data ends; "
            "the stream is cut or damaged",
            plane=plane,
            bit=len(data) * 8,
        )
    if code // QUARTER != (1 if low < QUARTER else 2):
        raise BitstreamError(
            f"{name}: starts at bit {start} and does not end with the bits that a coder flushes; "
            "the stream is damaged here or before",
            plane=plane,
            bit=end - FLUSH_BITS,
        )
    return Segment(tuple(symbols), end - start, inserted)


def encode_segment(symbols: Sequence[int], tables: Sequence[FrequencyTable], *, learn: bool) -> str:
    """Return the bits of a segment as a string of 0 and 1: the inverse of `decode_segment`."""
    bits: list[str] = []
    zeros = pending = 0

    def put(bit: int) -> None:
        nonlocal zeros, pending
        for value in (bit, *[1 - bit] * pending):
            if zeros == ZERO_RUN:
                bits.append("1")
                zeros = 0
            bits.append(str(value))
            zeros = 0 if value else zeros + 1
        pending = 0

    low, high = 0, TOP
    for symbol, table in zip(symbols, tables, strict=True):
        upper, lower = table.share(symbol)
        span = high - low + 1
        high = low - 1 + span * upper // table.total
        low += span * lower // table.total
        while True:
            if high < HALF:
                offset = 0
                put(0)
            elif low >= HALF:
                offset = HALF
                put(1)
            elif low >= QUARTER and high < HALF + QUARTER:
                offset = QUARTER
                pending += 1
            else:
                break
            low = (low - offset) * 2
            high = (high - offset) * 2 + 1
        if learn:
            table.learn(symbol)
    pending += 1
    put(0 if low < QUARTER else 1)
    return "".join(bits)
