"""Accessors of glTF 2.0: typed arrays in the bytes of buffers, plain, sparse, or packed for this project.

Packed numbers have 32 bits. The lowest bytes of all numbers come first, then all second, third and highest
ones: the higher bytes of neighbours are much alike, so they deflate well. The result is one zlib stream.
"""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np

from fba.arrays import Array, Float32
from fba.gltf._document import MAX_BYTES, Document
from fba.gltf._values import Value

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
"""NumPy types of the component types, by number."""
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
"""Numbers of components of an element, by its type."""
UNSIGNED = (5121, 5123, 5125)
MAX_ELEMENTS = 1 << 22
"""Most elements of one accessor: 4 million vertices or indices."""
DEFLATE_LEVEL = 7
"""Level of deflate; level 9 takes four times as long, for files 0.5 % smaller."""


class Accessors:
    """Reads the accessors of a document, each once, and checks everything before it is used."""

    def __init__(self, document: Document) -> None:
        self._document = document
        self._entries = document.entries("accessors")
        self._floats: dict[int, Float32] = {}
        self._integers: dict[int, Array] = {}
        self._filled: dict[int, Array] = {}

    def floats(self, reference: Value, *types: str, count: int | None = None) -> Float32:
        """Return float32 (N, width), finite, read-only; integers scaled as the document says.

        reference: the JSON value that is the accessor's index. types: allowed types of elements. count: the N
        that is needed, None for any. ModelError where the accessor is another.
        """
        index, entry = self._entry(reference)
        if index not in self._floats:
            raw = self._read(index, entry)
            scaled = _scaled(raw, _flag(entry, "normalized"))
            if not np.isfinite(scaled).all():
                row = int(np.argwhere(~np.isfinite(scaled))[0, 0])
                raise entry.error(f"element {row} is {scaled[row].tolist()}, which is not finite")
            scaled.flags.writeable = False
            self._floats[index] = scaled
        self._check(reference, entry, self._floats[index], types, count)
        return self._floats[index]

    def integers(self, reference: Value, *types: str, count: int | None = None) -> Array:
        """Return unsigned integers (N, width), unscaled, in their own dtype; else as `floats`."""
        index, entry = self._entry(reference)
        if entry.member("componentType").data not in UNSIGNED or _flag(entry, "normalized"):
            raise reference.error(
                f"{entry.path} must hold unsigned integers (component type 5121, 5123, 5125)"
            )
        if index not in self._integers:
            raw = self._read(index, entry)
            raw = raw.astype(raw.dtype.newbyteorder("="), copy=False)
            raw.flags.writeable = False
            self._integers[index] = raw
        self._check(reference, entry, self._integers[index], types, count)
        return self._integers[index]

    def charge(self, reference: Value) -> None:
        """Count the memory of an accessor that `fill` is going to be called for."""
        _, entry = self._entry(reference)
        kind, width, count = self._layout(entry)
        self._document.budget.charge(count * width * (kind.itemsize + 8), entry)

    def fill(self, reference: Value, rows: Array) -> None:
        """Give an accessor without bytes of its own its elements (N, width), as an extension unpacked them.

        Raises ModelError where they are not of the accessor's size and type.
        """
        index, entry = self._entry(reference)
        kind, width, count = self._layout(entry)
        if rows.shape != (count, width):
            raise entry.error(f"{count} elements of {width} numbers are announced, but {rows.shape} unpacked")
        low, high = (rows.min(), rows.max()) if rows.size else (0, 0)
        if kind.kind != "f" and (rows.dtype.kind == "f" or not _fits(low, high, kind)):
            raise entry.error(f"the unpacked numbers, {low} to {high}, are not of component type {kind}")
        self._filled[index] = rows.astype(kind)

    def _entry(self, reference: Value) -> tuple[int, Value]:
        index = reference.index(len(self._entries), "accessor")
        return index, self._entries[index]

    def _check(
        self, reference: Value, entry: Value, array: Array, types: tuple[str, ...], count: int | None
    ) -> None:
        if entry.data["type"] not in types:
            raise reference.error(
                f"{entry.path} holds {entry.data['type']} elements, but {' or '.join(types)} are needed"
            )
        if count is not None and len(array) != count:
            raise reference.error(f"{entry.path} has {len(array)} elements, but {count} are needed")

    def _layout(self, entry: Value) -> tuple[np.dtype[Any], int, int]:
        """Return the type of the numbers, how many an element has, and how many elements there are."""
        code = entry.member("componentType").integer(0, 1 << 16)
        if code not in COMPONENTS:
            raise entry.error(f"componentType {code} is not one of {', '.join(map(str, COMPONENTS))}")
        kind = np.dtype(COMPONENTS[code])
        shape = entry.member("type").text(100)
        if shape not in WIDTHS:
            raise entry.error(f"type {shape!r} is not one of {', '.join(WIDTHS)}")
        width = WIDTHS[shape]
        given = entry.member("count")
        if isinstance(given.data, int) and given.data > MAX_ELEMENTS:
            raise given.error(f"more than the {MAX_ELEMENTS} elements that can be read; simplify the model")
        count = given.integer(1, MAX_ELEMENTS)
        return kind, width, count

    def _read(self, index: int, entry: Value) -> Array:
        if index in self._filled:
            return self._filled[index]
        kind, width, count = self._layout(entry)
        # charged for the raw numbers and the float32 array
        self._document.budget.charge(count * width * (kind.itemsize + 4), entry)
        if entry.get("bufferView") is None:
            array: Array = np.zeros((count, width), kind)
        else:
            offset = _offset(entry)
            array = self._window(entry.member("bufferView"), offset, count, width, kind, entry)
        sparse = entry.get("sparse")
        if sparse is not None:
            self._substitute(array, sparse, width, kind)
        return array

    def _substitute(self, array: Array, sparse: Value, width: int, kind: np.dtype[Any]) -> None:
        count = sparse.member("count").integer(1, len(array))
        self._document.budget.charge(count * (4 + width * kind.itemsize), sparse)
        indices, values = sparse.member("indices"), sparse.member("values")
        code = indices.member("componentType").integer(0, 1 << 16)
        if code not in UNSIGNED:
            raise indices.error(f"componentType {code} is not an unsigned integer")
        rows = self._window(
            indices.member("bufferView"), _offset(indices), count, 1, np.dtype(COMPONENTS[code]), indices
        )[:, 0].astype(np.int64)
        if int(rows.max()) >= len(array):
            raise indices.error(f"names element {rows.max()}, but there are {len(array)}")
        if (np.diff(rows) <= 0).any():
            raise indices.error("the indices must increase")
        array[rows] = self._window(values.member("bufferView"), _offset(values), count, width, kind, values)

    def _window(
        self, reference: Value, offset: int, count: int, width: int, kind: np.dtype[Any], where: Value
    ) -> Array:
        """Return a copy of (count, width) numbers from a buffer view."""
        data, view = self._document.view(reference)
        element = width * kind.itemsize
        given = view.get("byteStride")
        stride = element if given is None else given.integer(4, 252)
        if stride < element:
            raise where.error(f"elements of {element} bytes do not fit the stride of {view.path}, {stride}")
        end = offset + (count - 1) * stride + element
        if end > len(data):
            raise where.error(
                f"{count} elements from byte {offset} on need {end} bytes, but {view.path} has {len(data)}"
            )
        window: Array = np.ndarray((count, width), kind, data, offset, (stride, kind.itemsize))
        return window.copy()


def _fits(low: Any, high: Any, kind: np.dtype[Any]) -> bool:
    limits = np.iinfo(kind)
    return int(limits.min) <= int(low) and int(high) <= int(limits.max)


def _offset(entry: Value) -> int:
    given = entry.get("byteOffset")
    return 0 if given is None else given.integer(0, MAX_BYTES)


def _flag(entry: Value, key: str) -> bool:
    given = entry.get(key)
    return False if given is None else given.boolean()


def _scaled(raw: Array, normalized: bool) -> Float32:
    if raw.dtype.kind == "f" or not normalized:
        return raw.astype(np.float32, copy=False)
    top = np.float32(np.iinfo(raw.dtype).max)
    # the lowest signed number would be a little below -1
    return np.asarray(np.maximum(raw.astype(np.float32) / top, np.float32(-1.0)))


def pack(array: Array) -> bytes:
    """Return compressed bytes of an array of 32-bit numbers, in its own order."""
    words = np.ascontiguousarray(array).astype(array.dtype.newbyteorder("<")).ravel()
    planes = words.view(np.uint8).reshape(-1, 4).T
    return zlib.compress(planes.tobytes(), DEFLATE_LEVEL)


def unpack(document: Document, reference: Value, dtype: type[np.generic], shape: tuple[int, ...]) -> Array:
    """Return the array of 32-bit numbers in the buffer view that `reference` names; its shape must be known.

    Raises ModelError where the stream is damaged, or holds more or fewer numbers.
    """
    count = int(np.prod(shape, dtype=object))
    document.budget.charge(count * 12, reference)  # as bytes, sorted back, and as the array returned
    data, view = document.view(reference)
    stream = zlib.decompressobj()
    try:
        raw = stream.decompress(data, count * 4) if count else b""
        excess = stream.decompress(stream.unconsumed_tail, 1)
    except zlib.error as error:
        raise reference.error(f"the packed numbers in {view.path} are damaged ({error})") from None
    if len(raw) != count * 4 or excess or not stream.eof:
        raise reference.error(f"{view.path} does not unpack to the {count} numbers that are needed")
    planes = np.frombuffer(raw, np.uint8).reshape(4, count)
    words = np.ascontiguousarray(planes.T).view(np.dtype(dtype).newbyteorder("<")).reshape(shape)
    return words.astype(dtype, copy=False)
