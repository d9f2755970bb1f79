"""Small glTF documents, put together by hand for the tests of the reader."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np

COMPONENT = {"f4": 5126, "u1": 5121, "i1": 5120, "u2": 5123, "i2": 5122, "u4": 5125}
TYPE = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Sheet:
    """A document and its bytes; `array` appends an accessor with a buffer view of its own."""

    def __init__(self) -> None:
        self.data = b""
        self.json: dict[str, Any] = {"asset": {"version": "2.0"}, "bufferViews": [], "accessors": []}

    def bytes(self, data: bytes, **more: Any) -> int:
        """A buffer view of these bytes."""
        self.json["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more}
        )
        self.data += data + b"\0" * (-len(data) % 4)
        return len(self.json["bufferViews"]) - 1

    def array(self, values: Any, kind: str = "f4", **more: Any) -> int:
        """An accessor of these numbers, one row an element."""
        array = np.array(values).astype(f"<{kind}")
        array = array.reshape(len(array), -1)
        view = self.bytes(array.tobytes())
        entry = {"bufferView": view, "componentType": COMPONENT[kind], "count": len(array)}
        self.json["accessors"].append(entry | {"type": TYPE[array.shape[1]]} | more)
        return len(self.json["accessors"]) - 1

    def triangle(self, **more: Any) -> dict[str, Any]:
        """A primitive: the corners of the unit square below its diagonal, facing +z."""
        corners = self.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)])
        return {"attributes": {"POSITION": corners}, "indices": self.array([0, 1, 2], "u2")} | more

    def show(self, primitive: dict[str, Any], **node: Any) -> Sheet:
        """One node with a mesh of one primitive."""
        self.json |= {"meshes": [{"primitives": [primitive]}], "nodes": [{"mesh": 0} | node]}
        return self

    def glb(self) -> bytes:
        buffers = {"buffers": [{"byteLength": len(self.data)}]} if self.data else {}
        return container(json.dumps(self.json | buffers).encode(), self.data)

    def save(self, path: Path) -> Path:
        path.write_bytes(self.glb())
        return path


def container(text: bytes, binary: bytes) -> bytes:
    """A .glb, after the description of the format: header, JSON chunk, binary chunk."""
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks
