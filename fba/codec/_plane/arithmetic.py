"""The adaptive arithmetic coder of the FBA object plane, compiled (ISO/IEC 14496-2, FBA object).

A 16-bit integer coder in the style of H.263 Annex E. A symbol s of a model with counts c[0], c[1], ...
owns the part of the interval [low, high] between the cumulative counts C[s+1] and C[s], where C[s] is
the sum of c[s], c[s+1], ...: symbol 0 is at the top. Leading bits that low and high share are written;
two more bits at the end of a segment select a quarter inside the interval. Inside a segment, a 1 is
inserted after every 22 zero bits in a row, so that no start code can appear.

All counts start at 1 and grow by 1 each time their symbol is coded; at a total of 16383 they are
halved. A model therefore stores only what was *added* to the initial counts: `added[s]`, and a Fenwick
tree of partial sums, in which finding a symbol and raising a count take log2(size) steps: alphabets reach
3721 symbols. The symbol of no change, the most frequent in a predictive codec, is the `usual` symbol of its
model; it is outside the tree and needs no search.

The models of all slots are rows of arrays (slots, STRIDE). Coding a plane only reads them; `learn` updates
them afterwards. A plane uses each model at most once, so an incomplete or damaged plane changes nothing.

All functions work on NumPy arrays and plain integers, and also run uncompiled.

Bounds: slots are rows of `Counts` (`coder_state.Models` makes room for a part before its first plane). In
each row sizes are at most ALPHABET_MAX, which `header_loops.begin_models` checks, so that symbols and nodes
of trees up to the size lie within STRIDE. The functions here check that symbols are below the size and that
arrays are long enough. Otherwise they raise IndexError: a fault of the caller, never of a stream.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Int64, UInt8, UInt16
from fba.compiled import compiled, inlined

QUARTER = 16384
HALF = 32768
THREE_QUARTERS = 49152
TOP = 65535
TOTAL_MAX = 16383
GUARD = 22
"""Zero bits in a row after which a 1 is inserted."""

ALPHABET_MAX = 3721
"""-1860..1860, the widest range that a range list can express."""
STRIDE = ALPHABET_MAX + 1
TREE_TOP = 2048
"""Largest power of two within ALPHABET_MAX."""

OK = 0
OUT_OF_DATA = 1
BAD_GUARD = 2
"""A 0 in place of the 1 after 22 zeros."""
BAD_FLUSH = 3
"""The two closing bits do not fit the final interval."""


class Counts(NamedTuple):
    """The models of all slots.

    int64 (slots,): size of the alphabet, usual symbol, total of the counts, and sum of the counts of symbols
    below the usual one. uint16 (slots, STRIDE): additions to the counts, and the Fenwick tree over them.
    """

    size: Int64
    usual: Int64
    total: Int64
    below_usual: Int64
    added: UInt16
    tree: UInt16


@inlined
def _symbol_at(models: Counts, slot: int, target: int) -> tuple[int, int, int]:
    """Return the symbol whose share of the counts contains the target, the sum below it, and its count."""
    symbol = int(models.usual[slot])
    below = int(models.below_usual[slot])
    share = 1 + int(models.added[slot, symbol])
    if target < below:
        symbol, below = _find(models.tree, slot, int(models.size[slot]), target)
        share = 1 + int(models.added[slot, symbol])
    elif target >= below + share:
        symbol, below = _find(models.tree, slot, int(models.size[slot]), target - share + 1)
        below += share - 1
        share = 1 + int(models.added[slot, symbol])
    return symbol, below, share


@compiled
def decode_segment(
    data: UInt8, bit: int, end: int, slots: Int64, models: Counts, adaptive: bool, symbols: Int64
) -> tuple[int, int]:
    """Decode one segment that starts at `bit`: symbols[k] becomes the symbol of slot slots[k].

    data: the stream, valid up to bit `end`; zeros are assumed beyond. adaptive: P planes; in I planes all
    counts are 1. Returns OK and the bit after the segment, OUT_OF_DATA if it needs bits beyond `end`, or the
    kind of damage and its bit. IndexError if `end` is beyond the data, or symbols are fewer than slots.

    Bounds: bits are read before `end` only. The target is below the total of the counts, since the code stays
    within the interval. So the symbol, whose share of the counts contains the target, is below the model's
    size.
    """
    if len(symbols) < len(slots) or end > 8 * len(data) or bit < 0:
        raise IndexError("a segment beyond its arrays")
    low = high = code = 0  # so that renormalising reads the first 16 bits
    zeros = 0  # in a row, up to `bit`
    taken = 0  # logical bits: those read, without the inserted ones
    guard_at = -1  # value of `taken` at the last inserted one
    bad_guard = -1
    bad_guard_at = 0
    count = len(slots)
    for position in range(count + 1):
        while True:
            if high >= HALF:
                if low >= HALF:
                    low -= HALF
                    high -= HALF
                    code -= HALF
                elif low >= QUARTER and high < THREE_QUARTERS:
                    low -= QUARTER
                    high -= QUARTER
                    code -= QUARTER
                else:
                    break
            low = 2 * low
            high = 2 * high + 1
            if zeros == GUARD:
                if bit < end and not (int(data[bit >> 3]) >> (7 - (bit & 7))) & 1 and bad_guard < 0:
                    bad_guard = bit
                    bad_guard_at = taken
                guard_at = taken
                bit += 1
                zeros = 0
            value = (int(data[bit >> 3]) >> (7 - (bit & 7))) & 1 if bit < end else 0
            bit += 1
            zeros = 0 if value else zeros + 1
            code = 2 * code + value
            taken += 1
        if position == count:
            break

        slot = int(slots[position])
        span = high - low + 1
        total = int(models.total[slot]) if adaptive else int(models.size[slot])
        target = total - 1 - ((code - low + 1) * total - 1) // span  # counted from symbol 0 upwards
        symbol, below, share = _symbol_at(models, slot, target) if adaptive else (target, target, 1)
        symbols[position] = symbol
        above = total - below  # C[symbol]; C[symbol + 1] is less by the symbol's own count
        high = low - 1 + span * above // total
        low = low + span * (above - share) // total
    # Of the 16 bits in the register, the first two close the segment; the other 14 follow it, and so does
    # a 1 among them that was counted as inserted.
    used = taken - 14
    if bad_guard >= 0 and bad_guard_at < used:
        return BAD_GUARD, bad_guard
    after = bit - 14 - (1 if guard_at >= used else 0)
    if after > end:
        return OUT_OF_DATA, end
    if code >> 14 != (1 if low < QUARTER else 2):
        # With bits missing, this need not be damage: they may still change what was decoded.
        return (OUT_OF_DATA, end) if bit > end else (BAD_FLUSH, after - 2)
    return OK, after


@inlined
def _counts_below(models: Counts, slot: int, symbol: int) -> int:
    """Return the sum of the counts of all symbols below this one, of the usual symbol too."""
    usual = int(models.usual[slot])
    if symbol == usual:
        return int(models.below_usual[slot])
    below = int(_sum_below(models.tree, slot, symbol))
    return below + int(models.added[slot, usual]) if symbol > usual else below


@compiled
def encode_segment(
    data: UInt8, bit: int, slots: Int64, models: Counts, adaptive: bool, symbols: Int64
) -> int:
    """Encode symbols[k] for slot slots[k] into one segment that starts at `bit`; return the bit after it.

    data: zeroed from `bit` on, with room for 16 bits for each symbol and 16 more. IndexError without that
    room, for a symbol that its model does not have, and for fewer symbols than slots.

    Bounds: a symbol narrows the interval to no less than 1 / TOTAL_MAX of its size, which is more than
    QUARTER; to grow beyond that again takes at most 15 doublings, each of which writes a bit at once or
    later. So n symbols and the end write at most 15 n + 2 bits, and the guard one more after each 22: fewer
    than 16 n + 4.
    """
    if len(symbols) < len(slots) or bit < 0 or bit + 16 * (len(slots) + 1) > 8 * len(data):
        raise IndexError("a segment beyond its arrays")
    low = 0
    high = TOP
    pending = 0  # bits whose value the next one decides
    zeros = 0
    count = len(slots)
    for position in range(count + 1):
        if position < count:
            slot = int(slots[position])
            symbol = int(symbols[position])
            if symbol < 0 or symbol >= models.size[slot]:
                raise IndexError("a symbol beyond its model")
            span = high - low + 1
            total, above, share = int(models.size[slot]), int(models.size[slot]) - symbol, 1
            if adaptive:
                total = int(models.total[slot])
                above = total - _counts_below(models, slot, symbol)
                share = 1 + int(models.added[slot, symbol])
            high = low - 1 + span * above // total
            low = low + span * (above - share) // total
        else:  # the end: two bits, and those pending, select a quarter inside the interval
            pending += 1
            low, high = (QUARTER, HALF - 1) if low < QUARTER else (HALF, THREE_QUARTERS - 1)
        while True:
            if high < HALF:
                value = 0
            elif low >= HALF:
                value = 1
                low -= HALF
                high -= HALF
            elif low >= QUARTER and high < THREE_QUARTERS and position < count:
                pending += 1
                low = 2 * (low - QUARTER)
                high = 2 * (high - QUARTER) + 1
                continue
            else:
                break
            low = 2 * low
            high = 2 * high + 1
            for repeat in range(pending + 1):
                out = value if repeat == 0 else 1 - value
                if zeros == GUARD:
                    data[bit >> 3] |= np.uint8(128 >> (bit & 7))
                    bit += 1
                    zeros = 0
                if out:
                    data[bit >> 3] |= np.uint8(128 >> (bit & 7))
                    zeros = 0
                else:
                    zeros += 1
                bit += 1
            pending = 0
            if position == count:
                break
    return bit


@compiled
def learn(slots: Int64, symbols: Int64, models: Counts) -> None:
    """Raise the count of symbols[k] in the model of slots[k], halving the counts of full models.

    IndexError for fewer symbols than slots, or a symbol that its model does not have.
    """
    if len(symbols) < len(slots):
        raise IndexError("symbols beyond their array")
    for position in range(len(slots)):
        slot = int(slots[position])
        if models.total[slot] == TOTAL_MAX:
            models.total[slot], models.below_usual[slot] = _halve(
                models.added, models.tree, slot, int(models.size[slot]), int(models.usual[slot])
            )
        symbol = int(symbols[position])
        if symbol < 0 or symbol >= models.size[slot]:
            raise IndexError("a symbol beyond its model")
        models.added[slot, symbol] += np.uint16(1)
        models.total[slot] += 1
        if symbol != models.usual[slot]:
            if symbol < models.usual[slot]:
                models.below_usual[slot] += 1
            _raise(models.tree, slot, int(models.size[slot]), symbol, 1)


@compiled
def _find(tree: UInt16, slot: int, size: int, target: int) -> tuple[int, int]:
    """Return the symbol at position `target` of the counts added up from symbol 0, and the sum below it."""
    symbol = 0
    remaining = target
    step = TREE_TOP
    while step > 0:
        node = symbol + step
        if node <= size:
            weight = step + int(tree[slot, node])
            if weight <= remaining:
                symbol = node
                remaining -= weight
        step >>= 1
    return symbol, target - remaining


@compiled
def _sum_below(tree: UInt16, slot: int, symbol: int) -> int:
    """Return the sum of the counts in the tree of the symbols below this one."""
    below = symbol
    node = symbol
    while node > 0:
        below += int(tree[slot, node])
        node &= node - 1
    return below


@compiled
def _raise(tree: UInt16, slot: int, size: int, symbol: int, amount: int) -> None:
    """Raise the count of a symbol in the tree."""
    node = symbol + 1
    while node <= size:
        tree[slot, node] += np.uint16(amount)
        node += node & -node


@compiled
def _halve(added: UInt16, tree: UInt16, slot: int, size: int, usual: int) -> tuple[int, int]:
    """Halve every count, rounding up; return the new total and below_usual."""
    for node in range(1, size + 1):
        tree[slot, node] = 0
    total = size
    below_usual = usual
    for symbol in range(size):
        half = int(np.int64(added[slot, symbol])) >> 1  # signed, as wherever `_raise` is called
        added[slot, symbol] = half
        total += half
        if half > 0 and symbol != usual:
            if symbol < usual:
                below_usual += half
            _raise(tree, slot, size, symbol, half)
    return total, below_usual
