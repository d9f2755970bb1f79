"""Writer of glTF 2.0 files: arrays become accessors, sparse ones where these take fewer bytes."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import numpy.typing as npt

from fba.arrays import Array, Floating
from fba.atomic import atomic
from fba.errors import ModelError
from fba.gltf._accessors import COMPONENTS, MAX_ELEMENTS, WIDTHS, pack
from fba.gltf._document import MAX_BYTES, MAX_JSON, join_container
from fba.gltf._materials import WEBP, media_type
from fba.source import Path

ATTRIBUTES = 34962
ELEMENTS = 34963
"""Targets of buffer views: vertex attributes, and indices of triangles."""
RESTART = 65535
"""The index of 16 bits by which a primitive restarts: no vertex can have it."""

_TYPES = {width: word for word, width in WIDTHS.items()}
_CODES = {np.dtype(kind).newbyteorder("="): code for code, kind in COMPONENTS.items()}


class Builder:
    """Collects a document and its bytes, then writes them as one .glb.

    root: the JSON object, to which callers may add entries; `add` appends to its lists. Indices are stored in
    the fewest bytes that hold them, other numbers as integers of their own type or as float32. The same calls
    give the same bytes.
    """

    def __init__(self) -> None:
        self.root: dict[str, Any] = {"asset": {"version": "2.0", "generator": "fba"}}
        self._views: dict[tuple[int | None, int | None], tuple[int, bytearray]] = {}
        self._blobs: list[tuple[int, bytes]] = []
        self._pictures: dict[bytes, int] = {}

    def add(self, key: str, entry: dict[str, Any]) -> int:
        """Append an entry to a list of the document, such as "nodes"; return its index."""
        entries: list[dict[str, Any]] = self.root.setdefault(key, [])
        entries.append(entry)
        return len(entries) - 1

    def attribute(self, values: npt.ArrayLike, *, bounds: bool = False) -> int:
        """Add a vertex attribute, (V, width); return its accessor. Floats become float32.

        bounds: also write the smallest and largest of each component, as positions need them.
        """
        array = _native(values)
        stride = array.shape[1] * array.dtype.itemsize
        view, offset = self._append(array, (ATTRIBUTES, stride))
        return self._accessor(array, bounds, view, offset)

    def colours(self, colours: npt.ArrayLike) -> int:
        """Add colours (V, 4), in 8 or 16 bits where these are exact, else as floats; return the accessor."""
        array = _native(colours)
        for kind in (np.uint8, np.uint16):
            top = np.float32(np.iinfo(kind).max)
            levels = np.rint(np.clip(array, 0, 1) * top)
            if np.array_equal(levels / top, array):  # as readers scale them
                accessor = self.attribute(levels.astype(kind))
                self.root["accessors"][accessor]["normalized"] = True
                return accessor
        return self.attribute(array)

    def triangles(self, triangles: npt.ArrayLike) -> int:
        """Add the corners of triangles, (F, 3); return the accessor."""
        corners = _unsigned(np.asarray(triangles).reshape(-1, 1), RESTART - 1)
        view, offset = self._append(corners, (ELEMENTS, None))
        return self._accessor(corners, False, view, offset)

    def data(self, values: npt.ArrayLike, *, bounds: bool = False) -> int:
        """Add keys or tables, (N, width) or (N,); return the accessor."""
        array = _native(values)
        array = array[:, None] if array.ndim == 1 else array
        view, offset = self._append(array, (None, None))
        return self._accessor(array, bounds, view, offset)

    def matrices(self, values: npt.ArrayLike) -> int:
        """Add matrices (N, 4, 4), in a buffer view of their own; return the accessor."""
        array = _native(np.swapaxes(np.asarray(values, dtype=np.float64), -1, -2).reshape(-1, 16))
        view = self.blob(array.astype(array.dtype.newbyteorder("<")).tobytes())
        return self._accessor(array, False, view, 0)

    def packed(self, array: Array) -> int:
        """Add compressed 32-bit numbers, for `unpack` alone; return the buffer view."""
        return self.blob(pack(array))

    def blob(self, data: bytes) -> int:
        """Add bytes, such as those of a document within the document; return their buffer view."""
        view = self.add("bufferViews", {})
        self._blobs.append((view, data))
        return view

    def displacements(self, values: Floating) -> int:
        """Add a morph target, (V, 3), sparse where most vertices do not move; return the accessor."""
        array = np.asarray(values, dtype=np.float32)
        rows = np.flatnonzero(array.any(axis=1))
        index_bytes = 2 if len(array) <= RESTART + 1 else 4
        if len(rows) * (12 + index_bytes) >= array.nbytes:
            return self.attribute(array, bounds=True)
        entry = _entry(array, True)
        if len(rows):
            indices = _unsigned(rows[:, None], 65535)
            view, start = self._append(indices, (None, None))
            values_view, values_start = self._append(array[rows], (None, None))
            entry["sparse"] = {
                "count": len(rows),
                "indices": _located({"componentType": _CODES[indices.dtype]}, view, start),
                "values": _located({}, values_view, values_start),
            }
        return self.add("accessors", entry)

    def image(self, data: bytes, name: str = "") -> int:
        """Add a PNG, JPEG or WebP picture once; return its index. ModelError for other content."""
        if data not in self._pictures:
            kind = media_type(data)
            if kind is None:
                raise ModelError(f"the picture {name!r} is neither PNG, JPEG nor WebP")
            entry: dict[str, Any] = {"bufferView": self.blob(data), "mimeType": kind}
            self._pictures[data] = self.add("images", entry | ({"name": name} if name else {}))
        return self._pictures[data]

    def texture(self, image: int) -> int:
        """Add a texture that shows an image; return its index."""
        source: dict[str, Any] = {"source": image}
        if self.root["images"][image]["mimeType"] == "image/webp":
            source = {"extensions": {WEBP: source}}
        return self.add("textures", source)

    def glb(self) -> bytes:
        """Return the bytes of the file. ModelError where it would be too large, or a text is not Unicode."""
        chunks: list[bytes] = []
        offset = 0
        if any(image["mimeType"] == "image/webp" for image in self.root.get("images", [])):
            for key in ("extensionsUsed", "extensionsRequired"):
                self.root[key] = [*self.root.get(key, []), *({WEBP} - set(self.root.get(key, [])))]
        views = self.root.get("bufferViews", [])
        streams = [(number, bytes(content), key) for key, (number, content) in self._views.items()]
        for number, content, (target, stride) in (
            *streams,
            *((number, content, (None, None)) for number, content in self._blobs),
        ):
            view: dict[str, Any] = {"buffer": 0, "byteOffset": offset, "byteLength": len(content)}
            if stride is not None:
                view["byteStride"] = stride
            if target is not None:
                view["target"] = target
            views[number] = view
            padding = -len(content) % 4
            chunks += [content, b"\0" * padding]
            offset += len(content) + padding
        if offset:
            self.root["buffers"] = [{"byteLength": offset}]
        try:
            text = json.dumps(self.root, ensure_ascii=False, allow_nan=False, separators=(",", ":")).encode()
        except UnicodeEncodeError:
            raise ModelError("a name or note holds half a character (a lone surrogate)") from None
        except ValueError as error:
            raise ModelError(f"a number cannot be written: {error}") from None
        if len(text) > MAX_JSON:
            raise ModelError(
                f"the file would have {len(text)} bytes of JSON, more than the {MAX_JSON} allowed"
            )
        return join_container(text, b"".join(chunks))

    def save(self, path: Path) -> None:
        """Write the file, completely or not at all. Raises what `glb` and `atomic` raise."""
        data = self.glb()
        with atomic(path) as file:
            file.write(data)

    def _append(self, array: Array, key: tuple[int | None, int | None]) -> tuple[int, int]:
        """Add to the stream of a target and stride; return its buffer view, and the offset in it."""
        if key not in self._views:
            self._views[key] = (self.add("bufferViews", {}), bytearray())
        view, content = self._views[key]
        content += b"\0" * (-len(content) % 4)
        start = len(content)
        if start + array.nbytes > MAX_BYTES:
            raise ModelError(f"the file would be larger than {MAX_BYTES} bytes; simplify the model")
        content += array.astype(array.dtype.newbyteorder("<")).tobytes()
        return view, start

    def _accessor(self, array: Array, bounds: bool, view: int, offset: int) -> int:
        return self.add("accessors", _located(_entry(array, bounds), view, offset))


def _entry(array: Array, bounds: bool) -> dict[str, Any]:
    if not 1 <= len(array) <= MAX_ELEMENTS:
        raise ModelError(f"a glTF accessor holds 1 to {MAX_ELEMENTS} elements, not {len(array)}")
    entry = {"componentType": _CODES[array.dtype], "count": len(array), "type": _TYPES[array.shape[1]]}
    if bounds:
        entry |= {"min": array.min(axis=0).tolist(), "max": array.max(axis=0).tolist()}
    return entry


def _located(entry: dict[str, Any], view: int, offset: int) -> dict[str, Any]:
    return entry | {"bufferView": view} | ({"byteOffset": offset} if offset else {})


def _native(values: npt.ArrayLike) -> Array:
    array = np.asarray(values)
    if array.dtype.kind == "f":
        return np.ascontiguousarray(array, dtype=np.float32)
    if array.dtype not in _CODES:
        raise TypeError(f"glTF has no numbers of type {array.dtype}")
    return np.ascontiguousarray(array)


def _unsigned(array: Array, most_short: int) -> Array:
    kind = np.uint16 if not array.size or int(array.max()) <= most_short else np.uint32
    return np.ascontiguousarray(array, dtype=kind)
