"""The binary container of glTF 2.0: a header, a chunk of JSON and a chunk of bytes."""

from __future__ import annotations

import struct
import warnings

from fba.errors import FbaWarning, ModelError

MAGIC = b"glTF"
JSON_CHUNK = b"JSON"
BIN_CHUNK = b"BIN\0"
HEADER_BYTES = 12
CHUNK_HEADER_BYTES = 8
MAX_BYTES = 1 << 30
"""Largest file, container or buffer that is read."""


def split_container(data: bytes, file: str) -> tuple[memoryview, memoryview | None]:
    """Return the JSON text and the binary chunk (None if absent) of a container.

    data: all bytes of the file. file: its name for messages. Raises ModelError where the container is
    cut off, of another version, or damaged; bytes after its end are an FbaWarning.
    """
    if len(data) < HEADER_BYTES:
        raise ModelError(f"{file}: header: the file ends after {len(data)} bytes; was it fully copied?")
    magic, version, length = struct.unpack_from("<4sII", data)
    if magic != MAGIC:
        raise ModelError(f"{file}: header: begins with {magic!r}, not with {MAGIC!r}: this is no binary glTF")
    if version != 2:
        raise ModelError(f"{file}: header: this is glTF {version}; only glTF 2 is read")
    if length > len(data):
        raise ModelError(
            f"{file}: header: announces {length} bytes, but the file has {len(data)}; was it fully copied?"
        )
    if length < len(data):
        warnings.warn(
            f"{file}: {len(data) - length} bytes after the end of the glTF container are ignored",
            FbaWarning,
            stacklevel=2,
        )
    chunks = _chunks(memoryview(data)[:length], file)
    if not chunks or chunks[0][0] != JSON_CHUNK:
        raise ModelError(f"{file}: chunk 0: the first chunk of a glTF container must be its JSON")
    binary = chunks[1][1] if len(chunks) > 1 and chunks[1][0] == BIN_CHUNK else None
    return chunks[0][1], binary


def _chunks(data: memoryview, file: str) -> list[tuple[bytes, memoryview]]:
    """Return type and content of the first two chunks; readers may skip those after JSON and bytes."""
    chunks: list[tuple[bytes, memoryview]] = []
    position = HEADER_BYTES
    while position < len(data) and len(chunks) < 2:
        where = f"{file}: chunk {len(chunks)}"
        if len(data) - position < CHUNK_HEADER_BYTES:
            raise ModelError(f"{where}: the container ends within the chunk's header")
        length, kind = struct.unpack_from("<I4s", data, position)
        position += CHUNK_HEADER_BYTES
        if length > len(data) - position:
            raise ModelError(
                f"{where}: {length} bytes long, but the container ends after {len(data) - position}"
            )
        chunks.append((kind, data[position : position + length]))
        position += length
    return chunks


def join_container(text: bytes, binary: bytes) -> bytes:
    """Return a container of JSON text and bytes, both padded to multiples of 4 bytes, as the format requires.

    Raises ModelError where it would be longer than `MAX_BYTES`.
    """
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    length = HEADER_BYTES + CHUNK_HEADER_BYTES + len(text) + (CHUNK_HEADER_BYTES + len(binary)) * bool(binary)
    if length > MAX_BYTES:
        raise ModelError(f"the glTF container would have {length} bytes, more than the {MAX_BYTES} allowed")
    parts = [struct.pack("<4sII", MAGIC, 2, length), struct.pack("<I4s", len(text), JSON_CHUNK), text]
    if binary:
        parts += [struct.pack("<I4s", len(binary), BIN_CHUNK), binary]
    return b"".join(parts)
