"""A textbook arithmetic coder, compiled, with which `bench/` compares the codec.

Witten, Neal and Cleary's adaptive coder with cumulative counts in plain arrays: finding a symbol is a linear
search, and raising a count raises every cumulative count above it. It makes the same bits as
`fba.codec._plane.arithmetic`, which has its counts in trees, with the same guard against start codes.

Bounds: for streams that the benchmark makes itself. It passes models of `size` symbols, and checks in
`encode` that its data have room; `decode` reads what `encode` wrote.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Int64, UInt8
from fba.compiled import compiled


@compiled
def reset(cumulative: Int64, size: int) -> None:
    """Set all counts of all models (models, size + 1) to 1; symbol 0 is at the top."""
    for model in range(cumulative.shape[0]):
        for symbol in range(size + 1):
            cumulative[model, symbol] = size - symbol


@compiled
def _learn(cumulative: Int64, model: int, symbol: int, size: int) -> None:
    """Raise the count of a symbol, halving the counts of a full model."""
    if cumulative[model, 0] == 16383:
        total = 0
        following = int(cumulative[model, size])
        for index in range(size - 1, -1, -1):
            here = int(cumulative[model, index])
            total += (here - following + 1) // 2
            cumulative[model, index] = total
            following = here
    for index in range(symbol + 1):
        cumulative[model, index] += 1


@compiled
def encode(data: UInt8, symbols: Int64, size: int, cumulative: Int64) -> int:
    """Encode symbols (T, models), one segment for each row, into zeroed `data`; return the bits written."""
    if 16 * symbols.shape[0] * (symbols.shape[1] + 1) > 8 * len(data):
        raise IndexError("no room for the symbols")
    bit = 0
    for row in range(symbols.shape[0]):
        low, high, pending, zeros = 0, 65535, 0, 0
        for model in range(symbols.shape[1] + 1):
            ending = model == symbols.shape[1]
            if ending:
                pending += 1
                low, high = (16384, 32767) if low < 16384 else (32768, 49151)
            else:
                symbol = int(symbols[row, model])
                span = high - low + 1
                total = int(cumulative[model, 0])
                high = low - 1 + span * int(cumulative[model, symbol]) // total
                low = low + span * int(cumulative[model, symbol + 1]) // total
                _learn(cumulative, model, symbol, size)
            while True:
                if high < 32768:
                    value = 0
                elif low >= 32768:
                    value = 1
                    low -= 32768
                    high -= 32768
                elif low >= 16384 and high < 49152 and not ending:
                    pending += 1
                    low = 2 * (low - 16384)
                    high = 2 * (high - 16384) + 1
                    continue
                else:
                    break
                low = 2 * low
                high = 2 * high + 1
                for repeat in range(pending + 1):
                    out = value if repeat == 0 else 1 - value
                    if zeros == 22:
                        data[bit >> 3] |= np.uint8(128 >> (bit & 7))
                        bit += 1
                        zeros = 0
                    if out:
                        data[bit >> 3] |= np.uint8(128 >> (bit & 7))
                    zeros = 0 if out else zeros + 1
                    bit += 1
                pending = 0
                if ending:
                    break
    return bit


@compiled
def decode(data: UInt8, symbols: Int64, size: int, cumulative: Int64) -> int:
    """Decode rows of symbols (T, models) from `data`, which has 16 more bytes; return the bits read."""
    bit = 0
    for row in range(symbols.shape[0]):
        low, high, code, zeros, taken, guard_at = 0, 0, 0, 0, 0, -1
        for model in range(symbols.shape[1] + 1):
            while True:
                if high >= 32768:
                    if low >= 32768:
                        low -= 32768
                        high -= 32768
                        code -= 32768
                    elif low >= 16384 and high < 49152:
                        low -= 16384
                        high -= 16384
                        code -= 16384
                    else:
                        break
                low = 2 * low
                high = 2 * high + 1
                if zeros == 22:
                    guard_at = taken
                    bit += 1
                    zeros = 0
                value = (int(data[bit >> 3]) >> (7 - (bit & 7))) & 1
                bit += 1
                zeros = 0 if value else zeros + 1
                code = 2 * code + value
                taken += 1
            if model == symbols.shape[1]:
                break
            span = high - low + 1
            total = int(cumulative[model, 0])
            target = ((code - low + 1) * total - 1) // span
            symbol = 0
            while cumulative[model, symbol + 1] > target:
                symbol += 1
            symbols[row, model] = symbol
            high = low - 1 + span * int(cumulative[model, symbol]) // total
            low = low + span * int(cumulative[model, symbol + 1]) // total
            _learn(cumulative, model, symbol, size)
        bit -= 14 + (1 if guard_at >= taken - 14 else 0)
    return bit
