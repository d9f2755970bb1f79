"""Change the JSON of a .glb, for tests of what its reader says."""

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

HEAD = 20
"""Bytes before the JSON: magic, version, length; length and kind of the chunk."""


def document(data: bytes) -> dict[str, Any]:
    """The JSON of a .glb."""
    found: dict[str, Any] = json.loads(data[HEAD : _end(data)])
    return found


def edited(data: bytes, change: Callable[[dict[str, Any]], object]) -> bytes:
    """A .glb with another JSON, and the same binary chunk."""
    whole = document(data)
    change(whole)
    text = json.dumps(whole).encode()
    text += b" " * (-len(text) % 4)
    rest = data[_end(data) :]
    return struct.pack("<4sIII4s", b"glTF", 2, HEAD + len(text) + len(rest), len(text), b"JSON") + text + rest


def edit(source: Path, change: Callable[[dict[str, Any]], object], target: Path | None = None) -> None:
    """The same in a file; target: another file to write to."""
    (target or source).write_bytes(edited(source.read_bytes(), change))


def with_keys(data: bytes, count: int) -> bytes:
    """A .glb whose first channel of rotations has so many keys, all of them no rotation, 25 a second."""
    whole, binary = document(data), data[_end(data) + 8 :]
    animation = whole["animations"][0]
    channel = next(one for one in animation["channels"] if one["target"]["path"] == "rotation")
    sampler = animation["samplers"][channel["sampler"]]
    times = np.arange(count, dtype="<f4") / np.float32(25)
    turns = np.tile(np.array([0, 0, 0, 1], dtype="<f4"), (count, 1))
    for key, kind, array in (("input", "SCALAR", times), ("output", "VEC4", turns)):
        binary += bytes(-len(binary) % 4)
        view = {"buffer": 0, "byteOffset": len(binary), "byteLength": array.nbytes}
        accessor = {
            "componentType": 5126,
            "count": count,
            "type": kind,
            "bufferView": len(whole["bufferViews"]),
        }
        if key == "input":
            accessor |= {"min": [0.0], "max": [float(times[-1])]}
        sampler[key] = len(whole["accessors"])
        whole["bufferViews"].append(view)
        whole["accessors"].append(accessor)
        binary += array.tobytes()
    whole["buffers"][0]["byteLength"] = len(binary)
    text = json.dumps(whole).encode()
    text += b" " * (-len(text) % 4)
    chunks = (
        struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(binary), b"BIN\0") + binary
    )
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _end(data: bytes) -> int:
    length: int = struct.unpack_from("<I", data, 12)[0]
    return HEAD + length
