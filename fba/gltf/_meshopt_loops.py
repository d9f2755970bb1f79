"""The loops of the meshopt decoder, compiled. They check every index, and return -1 for damaged data.

Bounds: results have the counts that `unpack_view` was given: rows and columns run over their own shape. The
decoder's memory of FIFO entries is reached by remainders, which Python and numba keep from 0 up; `state` has
five numbers, `last` two. Bytes are read before `tail` or `end` only, which leave room for the 16 to 256 bytes
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
POSITION, LAST, NEXT, VERTICES, EDGES = range(5)
"""What `state` counts: bytes read, the last explicit index, the next new vertex, vertices and edges that went
into the FIFOs."""


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
    """Return the number of 7 bits a byte at state[POSITION], which moves on; -1 where data are short."""
    result = 0
    for shift in range(0, 35, 7):
        if state[POSITION] >= end:
            return -1
        byte = int(data[state[POSITION]])
        state[POSITION] += 1
        result |= (byte & 127) << shift
        if byte < 128:
            return result & END
    return -1


@inlined
def _read_index(data: UInt8, state: Int64, end: int) -> int:
    """Return an index stored as its difference from state[LAST]; -1 where the data end within it."""
    number = _read_number(data, state, end)
    if number < 0:
        return -1
    state[LAST] = (int(state[LAST]) + ((number >> 1) ^ -(number & 1))) & END
    return int(state[LAST])


@inlined
def _new_vertex(state: Int64) -> int:
    """Return the next vertex that no triangle had before."""
    vertex = int(state[NEXT])
    state[NEXT] += 1
    return vertex


@inlined
def _remember_vertex(vertices: Int64, state: Int64, vertex: int) -> None:
    vertices[state[VERTICES] % FIFO] = vertex
    state[VERTICES] += 1


@inlined
def _remember_edge(edges: Int64, state: Int64, a: int, b: int) -> None:
    edges[state[EDGES] % FIFO, 0], edges[state[EDGES] % FIFO, 1] = a, b
    state[EDGES] += 1


@inlined
def _third_corner(data: UInt8, vertices: Int64, state: Int64, end: int, code: int) -> int:
    """Return the corner of a triangle that shares an edge; -1 where the data end within it."""
    if 0 < code < 13:
        return int(vertices[(state[VERTICES] - 1 - code) % FIFO])
    if code == 0:
        corner = _new_vertex(state)
    elif code < 15:
        corner = (int(state[LAST]) + (1 if code == 14 else -1)) & END
        state[LAST] = corner
    else:
        corner = _read_index(data, state, end)
    _remember_vertex(vertices, state, corner)
    return corner


@inlined
def _free_corner(data: UInt8, vertices: Int64, state: Int64, end: int, code: int) -> int:
    """Return the second or third corner of a triangle that shares no edge; -1 where data are short."""
    if code == 0:
        return _new_vertex(state)
    if code == 15:
        return _read_index(data, state, end)
    return int(vertices[(state[VERTICES] - code) % FIFO])


@inlined
def _free_corners(data: UInt8, vertices: Int64, state: Int64, end: int, code: int) -> tuple[int, int, int]:
    """Return the corners of a triangle that shares no edge; one is -1 where the data do not fit."""
    if code < 14:
        pair = int(data[end + code])
    else:
        if int(state[POSITION]) >= end:
            return -1, -1, -1
        pair = int(data[state[POSITION]])
        state[POSITION] += 1
        if pair == 0:
            state[NEXT] = 0
    second, third = pair >> 4, pair & 15
    if code < 14 and (second == 15 or third == 15):
        return -1, -1, -1
    a = _read_index(data, state, end) if code == 15 else _new_vertex(state)
    b = _free_corner(data, vertices, state, end, second)
    c = _free_corner(data, vertices, state, end, third)
    _remember_vertex(vertices, state, a)
    if second in (0, 15):
        _remember_vertex(vertices, state, b)
    if third in (0, 15):
        _remember_vertex(vertices, state, c)
    return a, b, c


@compiled
def unpack_triangles(data: UInt8, edges: Int64, vertices: Int64, state: Int64, out: UInt32) -> int:
    """Write the decoded corners to out (triangles, 3); 0, or -1 for damage. Its memory starts as 0."""
    count = out.shape[0]
    end = len(data) - 16
    state[POSITION] = 1 + count
    if int(state[POSITION]) > end:
        return -1
    for row in range(count):
        code = int(data[1 + row])
        high, low = code >> 4, code & 15
        if high < 15:
            edge = (int(state[EDGES]) - 1 - high) % FIFO
            a, b = int(edges[edge, 0]), int(edges[edge, 1])
            c = _third_corner(data, vertices, state, end, low)
        else:
            a, b, c = _free_corners(data, vertices, state, end, low)
            _remember_edge(edges, state, b, a)
        if min(a, b, c) < 0:
            return -1
        _remember_edge(edges, state, c, b)
        _remember_edge(edges, state, a, c)
        out[row, 0], out[row, 1], out[row, 2] = a & END, b & END, c & END
    return 0 if int(state[POSITION]) == end else -1


@compiled
def unpack_indices(data: UInt8, state: Int64, last: Int64, out: UInt32) -> int:
    """Write the decoded indices to out (count,); 0, or -1 for damage. state, last: 0."""
    end = len(data) - 4
    state[POSITION] = 1
    for row in range(len(out)):
        number = _read_number(data, state, end)
        if number < 0:
            return -1
        baseline = number & 1
        number >>= 1
        last[baseline] = (int(last[baseline]) + ((number >> 1) ^ -(number & 1))) & END
        out[row] = int(last[baseline])
    return 0 if int(state[POSITION]) == end else -1
