"""A glTF file opened: container, JSON, buffers, and the files and data URIs that they come from."""

from __future__ import annotations

import base64
import binascii
import json
import os
import re
import struct
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from urllib.parse import unquote

from fba.errors import FbaError, ModelError, warn
from fba.gltf._meshopt import unpack_view
from fba.gltf._values import Budget, Value
from fba.limits import DEFAULT_LIMITS, Limits
from fba.recognition import HEAD_BYTES, recognition_hint
from fba.source import Path, open_source

MAX_JSON = 64 << 20
"""Longest JSON text, in bytes; geometry belongs in buffers."""
JSON_BYTES = {b"{": 240, b"[": 72, b",": 8, b'"': 30}
"""Memory that the parsed JSON takes for each of these characters."""
MAX_ITEMS = 1 << 18
"""Most entries of one list of a document."""
MESHOPT = "EXT_meshopt_compression"

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
MAGIC = b"glTF"
JSON_CHUNK = b"JSON"
BIN_CHUNK = b"BIN\0"
HEADER_BYTES = 12
CHUNK_HEADER_BYTES = 8
MAX_BYTES = 1 << 30
"""Largest file, container or buffer that is read."""


@dataclass(frozen=True, eq=False)
class Document:
    """root: the JSON. buffers: their bytes. folder: where other files may lie, None for nowhere."""

    root: Value
    buffers: tuple[memoryview, ...]
    folder: str | None
    budget: Budget

    def entries(self, key: str) -> list[Value]:
        """Return the entries of one of the document's lists, e.g. "meshes"."""
        return self.root.elements(MAX_ITEMS, key)

    @cached_property
    def _views(self) -> list[Value]:
        return self.entries("bufferViews")

    @cached_property
    def _unpacked(self) -> dict[int, memoryview]:
        """Bytes of the packed buffer views that were read, by index."""
        return {}

    def view(self, reference: Value) -> tuple[memoryview, Value]:
        """Return the bytes of the buffer view that `reference` names by its index, and its entry."""
        index = reference.index(len(self._views), "buffer view")
        entry = self._views[index]
        packing = find_extension(entry, MESHOPT)
        if packing is None:
            return self._stored(entry), entry
        if index not in self._unpacked:
            data = unpack_view(self._stored(packing), packing, self.budget)
            length = entry.member("byteLength").integer(1, MAX_BYTES)
            if length > len(data):
                raise entry.error(f"should have {length} bytes, but unpacks to {len(data)}")
            self._unpacked[index] = data[:length]
        return self._unpacked[index], entry

    def _stored(self, entry: Value) -> memoryview:
        """Return the bytes of a buffer that a buffer view, or the extension that packs it, names."""
        buffer = self.buffers[entry.member("buffer").index(len(self.buffers), "buffer")]
        given = entry.get("byteOffset")
        offset = 0 if given is None else given.integer(0, MAX_BYTES)
        length = entry.member("byteLength").integer(1, MAX_BYTES)
        if offset + length > len(buffer):
            raise entry.error(
                f"reaches from byte {offset} to {offset + length}, but its buffer has {len(buffer)} bytes"
            )
        return buffer[offset : offset + length]

    def embedded(self, reference: Value, name: str) -> Document:
        """Return the document in a buffer view; it names no files and shares the budget. name: for errors."""
        data, entry = self.view(reference)
        self.budget.charge(len(data), entry)
        inner = parse_document(bytes(data), f"{self.root.file}: {name}", None, self.budget.limits)
        return Document(inner.root, inner.buffers, None, self.budget)

    def resource(self, uri: Value, most: int = MAX_BYTES) -> bytes:
        """Return the content of a data URI or a file beside the document; ModelError beyond `most` bytes."""
        if not isinstance(uri.data, str):
            raise uri.error("expected a URI")
        if uri.data.startswith("data:"):
            return _inline(uri)
        return _beside(uri, self.folder, most)


def open_document(path: Path, limits: Limits = DEFAULT_LIMITS) -> Document:
    """Open a .glb or .gltf file.

    Raises FormatError where it cannot be read, ModelError for its content, LimitError where that takes more
    memory than the limits allow; so does everything that is read from the document later.
    """
    name = os.fspath(path)
    data = _content(name, MAX_BYTES)
    folder = os.path.dirname(os.path.abspath(name))
    return parse_document(data, os.path.basename(name) or name, folder, limits)


def parse_document(
    data: bytes, file: str, folder: str | None = None, limits: Limits = DEFAULT_LIMITS
) -> Document:
    """Return a document from bytes. file: name for messages. folder: of the files that it names, or None."""
    binary: memoryview | None = None
    text = memoryview(data)
    if data[:4] == MAGIC:
        text, binary = split_container(data, file)
    elif data[:1000].lstrip(b"\xef\xbb\xbf \t\r\n")[:1] != b"{":
        kind = recognition_hint(data[:HEAD_BYTES])
        raise ModelError(f"{file}: is not glTF 2.0: neither a .glb container nor the JSON of a .gltf{kind}")
    root = Value(parse_json(text, file, limits), file)
    asset = root.member("asset")
    version = asset.member("version").text(100)
    if not re.fullmatch(r"2\.\d+", version):
        raise asset.member("version").error(f"is {version!r}; only glTF 2 is read")
    opened = Document(root, (), folder, Budget(limits, len(data)))
    buffers: list[memoryview] = []
    for number, entry in enumerate(opened.entries("buffers")):
        buffers.append(_buffer(opened, entry, binary if number == 0 else None))
    return Document(root, tuple(buffers), folder, opened.budget)


def parse_json(text: memoryview, file: str, limits: Limits = DEFAULT_LIMITS) -> Any:
    """Return the JSON object in UTF-8 text.

    Raises ModelError for other text and for text too long or nested too deeply, LimitError where it takes
    more memory than the limits allow: a list of empty lists takes many times its text.
    """
    if len(text) > MAX_JSON:
        raise ModelError(
            f"{file}: {len(text)} bytes of JSON, more than the {MAX_JSON} that can be read; "
            "keep geometry and pictures in a .glb or in files of their own"
        )
    raw = bytes(text)
    memory = sum(raw.count(mark) * size for mark, size in JSON_BYTES.items())
    limits.check_bytes(memory, f"{file}: its JSON", source=len(text))
    try:
        data = json.loads(raw.decode("utf-8-sig"), parse_constant=_refuse_constant, object_pairs_hook=_unique)
    except RecursionError:
        raise ModelError(f"{file}: the JSON is nested too deeply; glTF never needs that") from None
    except UnicodeDecodeError as error:
        raise ModelError(f"{file}: the JSON is not UTF-8 text (byte {error.start})") from None
    except ValueError as error:  # syntax, and numbers of thousands of digits
        raise ModelError(f"{file}: the JSON is damaged: {str(error)[:200]}") from None
    if not isinstance(data, dict):
        raise ModelError(f"{file}: the JSON must be an object, not {type(data).__name__}")
    return data


def _refuse_constant(word: str) -> float:
    raise ValueError(f"{word} is not a number")


def _unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    members = dict(pairs)
    if len(members) != len(pairs):
        twice, _ = Counter(name for name, _ in pairs).most_common(1)[0]
        raise ValueError(f"an object names {ascii(twice)[:60]} twice")
    return members


def find_extension(entry: Value, name: str) -> Value | None:
    """Return the object of an extension in an entry of the document, or None."""
    extensions = entry.get("extensions")
    return None if extensions is None else extensions.get(name)


def _buffer(document: Document, entry: Value, binary: memoryview | None) -> memoryview:
    length = entry.member("byteLength").integer(1, MAX_BYTES)
    uri = entry.get("uri")
    if uri is None and find_extension(entry, MESHOPT) is not None:
        return memoryview(b"")  # a place for unpacked bytes
    if uri is None:
        if binary is None:
            raise entry.error("has no uri, and there is no binary chunk in its place")
        content = binary
    else:
        if not (isinstance(uri.data, str) and uri.data.startswith("data:")):
            document.budget.charge(length, entry)
        content = memoryview(document.resource(uri, length))
        document.budget.add_source(len(content))
    if len(content) < length:
        raise entry.error(f"should have {length} bytes, but has only {len(content)}; was it fully copied?")
    return content[:length]


def _inline(uri: Value) -> bytes:
    head, comma, body = uri.data.partition(",")
    if not comma or not head.endswith(";base64"):
        raise uri.error("is not a data URI in base64 (data:...;base64,...)")
    try:
        return base64.b64decode(body, validate=True)
    except (binascii.Error, ValueError) as error:
        raise uri.error(f"the base64 of the data URI is damaged: {error}") from None


def _beside(uri: Value, folder: str | None, most: int) -> bytes:
    """Return at most `most` bytes of a file in the folder of the document, or below it."""
    if folder is None:
        raise uri.error("names another file, but the document comes from memory, not from a folder")
    name = unquote(uri.text(4096))
    if _SCHEME.match(name) or name.startswith(("/", "\\")) or os.path.isabs(name) or "\0" in name:
        raise uri.error(f"{name!r} is refused: only files in the folder of the document are read")
    base = os.path.realpath(folder)
    try:
        target = os.path.realpath(os.path.join(base, name))
        inside = os.path.commonpath([base, target]) == base
    except (OSError, ValueError):
        inside = False
    if not inside:
        raise uri.error(f"{name!r} is refused: it lies outside the folder of the document")
    try:
        return _content(target, most, start=True)
    except FbaError as error:
        raise uri.error(str(error).replace(target, repr(name), 1)) from error


def _content(path: str, most: int, *, start: bool = False) -> bytes:
    """Return all bytes of a file, at most `most`; with `start`, the first `most` of a longer one."""
    file, size = open_source(path)
    with file:
        if size > most and not start:
            raise ModelError(f"{path}: is {size} bytes long, more than the {most} that can be read")
        try:
            return file.read(min(size, most))
        except OSError as error:
            raise ModelError(f"{path}: cannot be read: {error.strerror or error}") from error


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
        warn(
            f"{file}: {len(data) - length} bytes after the end of the glTF container are ignored",
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
    """Return a container of JSON and bytes, both padded to 4 bytes. ModelError beyond `MAX_BYTES`."""
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    length = HEADER_BYTES + CHUNK_HEADER_BYTES + len(text) + (CHUNK_HEADER_BYTES + len(binary)) * bool(binary)
    if length > MAX_BYTES:
        raise ModelError(f"the glTF container would have {length} bytes, more than the {MAX_BYTES} allowed")
    parts = [struct.pack("<4sII", MAGIC, 2, length), struct.pack("<I4s", len(text), JSON_CHUNK), text]
    if binary:
        parts += [struct.pack("<I4s", len(binary), BIN_CHUNK), binary]
    return b"".join(parts)
