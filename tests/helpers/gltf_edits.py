"""Change the JSON of a .glb, for tests of what its reader says."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

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


def _end(data: bytes) -> int:
    length: int = struct.unpack_from("<I", data, 12)[0]
    return HEAD + length
