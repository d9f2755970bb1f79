"""The loops of the meshopt decoder, compiled. They check every index, and return -1 for damaged data.

Bounds: results have the counts that `unpack_view` was given: rows and columns run over their own shape. The
decoder's memory of FIFO entries is reached by remainders, which Python and numba keep from 0 up; `state` and
`last` have two numbers. Bytes are read before `tail` or `end` only, which leave room for the 16 to 256 bytes
behind.
"""

from __future__ import annotations

from fba.arrays import Int64, UInt8, UInt32
from fba.compiled import compiled, inlined

GROUP = 16
"""Elements whose differences are stored together."""
FIFO = 16
"""Edges and vertices that the decoder of triangles remembers."""
END = 0xFFFFFFFF


@compiled
def unpack_attributes(data: UInt8, out: UInt8) -> int:
    """Write the decoded elements to out (count, stride); 0, or -1 where the data do not fit.

    data: the whole stream: a byte, blocks of differences, and the element before the first one at its end.
    """
    size, count, stride = len(data), out.shape[0], out.shape[1]
    tail = size - max(stride, 32)
    block = min((8192 // stride) & ~15, 256)
    position = 1
    for start in range(0, count, block):
        wanted = min(block, count - start)
        groups = (wanted + GROUP - 1) // GROUP
        for byte in range(stride):
            header = position
            position += (groups + 3) // 4
            if position > tail:
                return -1
            value = int(out[start - 1, byte]) if start else int(data[size - stride + byte])
            for group in range(groups):
                mode = (int(data[header + group // 4]) >> (2 * (group % 4))) & 3
                bits = 8 if mode == 3 else 2 * mode
                packed = position
                position += 2 * bits
                if position > tail:
                    return -1
                for index in range(GROUP):
                    delta = 0
                    if mode == 3:
                        delta = int(data[packed + index])
                    elif mode:
                        at = index * bits
                        delta = (int(data[packed + at // 8]) >> (8 - bits - at % 8)) & ((1 << bits) - 1)
                        if delta == (1 << bits) - 1:
                            if position >= tail:
                                return -1
                            delta = int(data[position])
                            position += 1
                    row = group * GROUP + index
                    if row < wanted:
                        value = (value + ((delta >> 1) ^ -(delta & 1))) & 255
                        out[start + row, byte] = value
    return 0 if position == tail else -1


@inlined
def _read_number(data: UInt8, state: Int64, end: int) -> int:
    """The number of 7 bits a byte at state[0], which moves on; -1 where the data end within it."""
    result = 0
    for shift in range(0, 35, 7):
        if state[0] >= end:
            return -1
        byte = int(data[state[0]])
        state[0] += 1
        result |= (byte & 127) << shift
        if byte < 128:
            return result & END
    return -1


@inlined
def _read_index(data: UInt8, state: Int64, end: int) -> int:
    """An index as its difference from the last explicit one, state[1]; -1 where the data end within it."""
    number = _read_number(data, state, end)
    if number < 0:
        return -1
    state[1] = (int(state[1]) + ((number >> 1) ^ -(number & 1))) & END
    return int(state[1])


@compiled
def unpack_triangles(data: UInt8, edges: Int64, vertices: Int64, state: Int64, out: UInt32) -> int:
    """Write the decoded corners to out (triangles, 3); 0, or -1 where the data do not fit.

    edges: (16, 2), vertices: (16,), state: (2,), all 0: the decoder's memory.
    """
    count = out.shape[0]
    end = len(data) - 16
    state[0] = 1 + count
    following, edge_top, vertex_top = 0, 0, 0
    if int(state[0]) > end:
        return -1
    for row in range(count):
        code = int(data[1 + row])
        high, low = code >> 4, code & 15
        if high < 15:
            edge = (edge_top - 1 - high) % FIFO
            a, b = int(edges[edge, 0]), int(edges[edge, 1])
            remember = low == 0 or low >= 13
            if low == 0:
                c = following
                following += 1
            elif low < 13:
                c = int(vertices[(vertex_top - 1 - low) % FIFO])
            elif low < 15:
                c = (int(state[1]) + (1 if low == 14 else -1)) & END
                state[1] = c
            else:
                c = _read_index(data, state, end)
                if c < 0:
                    return -1
            if remember:
                vertices[vertex_top % FIFO] = c
                vertex_top += 1
        else:
            if low < 14:
                pair = int(data[end + low])
            else:
                if int(state[0]) >= end:
                    return -1
                pair = int(data[state[0]])
                state[0] += 1
                if pair == 0:
                    following = 0
            second, third = pair >> 4, pair & 15
            if low == 15:
                a = _read_index(data, state, end)
                if a < 0:
                    return -1
            else:
                a = following
                following += 1
            if second == 0:
                b = following
                following += 1
            elif second == 15:
                if low < 14:
                    return -1
                b = _read_index(data, state, end)
                if b < 0:
                    return -1
            else:
                b = int(vertices[(vertex_top - second) % FIFO])
            if third == 0:
                c = following
                following += 1
            elif third == 15:
                if low < 14:
                    return -1
                c = _read_index(data, state, end)
                if c < 0:
                    return -1
            else:
                c = int(vertices[(vertex_top - third) % FIFO])
            vertices[vertex_top % FIFO] = a
            vertex_top += 1
            if second in (0, 15):
                vertices[vertex_top % FIFO] = b
                vertex_top += 1
            if third in (0, 15):
                vertices[vertex_top % FIFO] = c
                vertex_top += 1
            edges[edge_top % FIFO, 0], edges[edge_top % FIFO, 1] = b, a
            edge_top += 1
        edges[edge_top % FIFO, 0], edges[edge_top % FIFO, 1] = c, b
        edge_top += 1
        edges[edge_top % FIFO, 0], edges[edge_top % FIFO, 1] = a, c
        edge_top += 1
        out[row, 0], out[row, 1], out[row, 2] = a & END, b & END, c & END
    return 0 if int(state[0]) == end else -1


@compiled
def unpack_indices(data: UInt8, state: Int64, last: Int64, out: UInt32) -> int:
    """Write the decoded indices to out (count,); 0, or -1 where the data do not fit.

    state, last: (2,), all 0: the decoder's memory.
    """
    end = len(data) - 4
    state[0] = 1
    for row in range(len(out)):
        number = _read_number(data, state, end)
        if number < 0:
            return -1
        baseline = number & 1
        number >>= 1
        last[baseline] = (int(last[baseline]) + ((number >> 1) ^ -(number & 1))) & END
        out[row] = int(last[baseline])
    return 0 if int(state[0]) == end else -1
