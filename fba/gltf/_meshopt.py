"""Buffer views packed by meshoptimizer: EXT_meshopt_compression, by appendices A and B of its specification.

Written here, as meshoptimizer's package for Python has no wheels.
"""

from __future__ import annotations

import numpy as np

from fba.arrays import Array, UInt8
from fba.gltf._meshopt_loops import unpack_attributes, unpack_indices, unpack_triangles
from fba.gltf._values import Budget, Value

MARKS = {"ATTRIBUTES": 0xA0, "TRIANGLES": 0xE1, "INDICES": 0xD1}
"""First byte of a stream of each mode."""
MOST_ELEMENTS = 1 << 26
"""Most elements of a buffer view."""
TAIL = {"ATTRIBUTES": 32, "TRIANGLES": 16, "INDICES": 4}
"""Fewest bytes at the end of a stream of each mode."""


def unpack_view(data: memoryview, entry: Value, budget: Budget) -> memoryview:
    """Return the bytes of a packed buffer view.

    data: the packed bytes. entry: the extension's object in the view. Raises ModelError where the data are
    damaged or of a kind that the extension does not have, LimitError where they unpack to too much.
    """
    mode = entry.member("mode").text(20)
    if mode not in MARKS:
        raise entry.member("mode").error(f"{mode!r} is not one of {', '.join(MARKS)}")
    stride = entry.member("byteStride").integer(1, 256)
    count = entry.member("count").integer(1, MOST_ELEMENTS)
    if (mode == "ATTRIBUTES" and stride % 4) or (mode != "ATTRIBUTES" and stride not in (2, 4)):
        raise entry.member("byteStride").error(f"is {stride}, which {mode} cannot have")
    if mode == "TRIANGLES" and count % 3:
        raise entry.member("count").error(f"is {count}, not a multiple of 3")
    # the shortest stream: two bits for 16 bytes of attributes, a byte for a triangle or an index
    least = {"ATTRIBUTES": count * stride // 64, "TRIANGLES": count // 3, "INDICES": count}[mode]
    if len(data) < 1 + TAIL[mode] + least:
        raise entry.error(f"{len(data)} bytes are too few for {count} packed elements; was the file cut?")
    if data[0] != MARKS[mode]:
        raise entry.error(
            f"begins with 0x{data[0]:02x}, not 0x{MARKS[mode]:02x} as version 0 of {mode} does; convert the "
            "file without compression: npx @gltf-transform/cli copy in.glb out.glb"
        )
    budget.charge(count * max(stride, 4) * 2, entry)
    packed = np.frombuffer(data, np.uint8)
    if mode == "ATTRIBUTES":
        rows = np.zeros((count, stride), np.uint8)
        failed = unpack_attributes(packed, rows)
        result = rows if failed else _filtered(rows, entry)
    else:
        state, last = np.zeros(5, np.int64), np.zeros(2, np.int64)
        indices = np.zeros(count, np.uint32)
        if mode == "TRIANGLES":
            memory = np.zeros((16, 2), np.int64), np.zeros(16, np.int64)
            failed = unpack_triangles(packed, *memory, state, indices.reshape(-1, 3))
        else:
            failed = unpack_indices(packed, state, last, indices)
        if not failed and stride == 2 and int(indices.max()) > 0xFFFF:
            failed = -1
        result = indices.astype(f"<u{stride}")
    if failed:
        raise entry.error(f"the packed {mode.lower()} are damaged")
    return memoryview(np.ascontiguousarray(result).tobytes())


def _filtered(rows: UInt8, entry: Value) -> Array:
    """Return the elements (count, stride) after the filter that the view names."""
    given = entry.get("filter")
    name = "NONE" if given is None else given.text(20)
    stride = rows.shape[1]
    if name == "NONE":
        return rows
    if name == "OCTAHEDRAL" and stride in (4, 8):
        return _unfold_octahedron(rows.view("<i1" if stride == 4 else "<i2"))
    if name == "QUATERNION" and stride == 8:
        return _complete_quaternions(rows.view("<i2"))
    if name == "EXPONENTIAL":
        packed = rows.view("<i4")
        return np.asarray(np.ldexp(((packed << 8) >> 8).astype(np.float32), packed >> 24).astype("<f4"))
    where = entry if given is None else given
    raise where.error(f"the filter {name!r} does not exist for elements of {stride} bytes")


def _unfold_octahedron(packed: Array) -> Array:
    """Return the normals (N, 4), of which x and y were stored, and 1 as z; the fourth number stays."""
    most = float(np.iinfo(packed.dtype).max)
    one = np.maximum(packed[:, 2].astype(np.float64), 1.0)
    x, y = packed[:, 0] / one, packed[:, 1] / one
    z = 1.0 - np.abs(x) - np.abs(y)
    beyond = np.minimum(z, 0.0)
    x, y = x - np.copysign(beyond, x), y - np.copysign(beyond, y)
    unit = np.stack([x, y, z], axis=1)
    unit /= np.maximum(np.linalg.norm(unit, axis=1, keepdims=True), 1e-12)
    result = packed.copy()
    result[:, :3] = np.round(unit * most).astype(packed.dtype)
    return result


def _complete_quaternions(packed: Array) -> Array:
    """Return the quaternions (N, 4), whose largest component was left out."""
    largest = (packed[:, 3] & 3).astype(np.intp)
    one = np.maximum((packed[:, 3] | 3).astype(np.float64), 3.0)
    small = packed[:, :3] / one[:, None] * np.sqrt(0.5)
    missing = np.sqrt(np.maximum(1.0 - (small**2).sum(axis=1), 0.0))
    values = np.clip(np.round(np.column_stack([missing, small]) * 32767.0), -32767, 32767).astype("<i2")
    result = np.empty_like(packed)
    for place in range(4):
        result[np.arange(len(packed)), (largest + place) % 4] = values[:, place]
    return result
