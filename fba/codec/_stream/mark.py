"""The marks of a stream: which table of BAP steps it was made with, and the checks of its I periods.

No field of an FBA object says so. A mark is user data (user_data_start_code 00 00 01 b2, ISO/IEC 14496-2,
6.2.2) with fields behind the word "fba": `00 00 01 b2 "fba bap_steps=visage;crc32=2;"` and the checks. It
stands directly behind the end code, and not before the object, because of visage|SDK, the only other decoder
with public source: that exits unless the first four bytes are an object start code, and continues to decode
planes at any start code but the end code. It reads nothing behind the end code.

A program that reads a stream while it comes needs the table before. So in pipes, the headers of a visual
object sequence with the same user data stand before the object: see `write_opening`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from zlib import crc32

from fba.codec._plane import syntax
from fba.codec._stream.checksums import CHECK_BYTES, check_of
from fba.errors import warn
from fba.parameters import BAP_STEP_TABLES, BapTable

USER_DATA = 0xB2
"""Last byte of user_data_start_code."""
SEQUENCE = 0xB0
"""Last byte of visual_object_sequence_start_code."""
_PREFIX = bytes(syntax.START_CODE_PREFIX)
START = bytes([*syntax.START_CODE_PREFIX, USER_DATA])
_SEQUENCE_HEADER = bytes([*syntax.START_CODE_PREFIX, SEQUENCE, 0x64])
"""With profile_and_level_indication Simple FBA, level 2."""
_OBJECT_HEADER = bytes([*syntax.START_CODE_PREFIX, 0xB5, 0x23])
"""visual_object_start_code, no identifier, visual_object_type 4 (FBA), stuffing."""
_END_CODE = bytes([*syntax.START_CODE_PREFIX, syntax.END_CODE])
_OBJECT_CODES = tuple(bytes([*syntax.START_CODE_PREFIX, code]) for code in syntax.OBJECT_CODES)
_NAME = b"fba "
_FIELD = re.compile(rb"(bap_steps|crc32)=([^;=\0]{1,24});", re.DOTALL)
_SIMILAR = re.compile(rb"fba |bap_steps=|crc32=")
"""Text by which a mark with a flipped bit is recognised."""
_BEFORE_OBJECT = re.compile(
    re.escape(_SEQUENCE_HEADER[:4]) + rb"." + re.escape(START + _NAME) + rb"[^\0]{0,48}", re.DOTALL
)
MAX_MARK_BYTES = 64
"""Bytes of user data within which the words of a mark are complete."""


@dataclass(frozen=True)
class Mark:
    """A mark. table: of the object before it, which begins at byte `begin`. end: byte behind its words."""

    table: BapTable
    begin: int
    end: int


@dataclass(frozen=True)
class MarkContent:
    """The content of a mark.

    table: of BAP steps, or None. checks: of the I periods, four bytes each; None without any that are
    reliable. problem: a fault of the mark, or "".
    """

    table: BapTable | None = None
    checks: bytes | None = None
    problem: str = ""


def write_mark(table: BapTable | None, checks: bytes | None = None) -> bytes:
    """Return the mark to be put behind a stream.

    table: of BAP steps, or None. checks: of its I periods, four bytes each, or None.
    Raises ValueError for an unknown table.
    """
    if table is not None and table not in BAP_STEP_TABLES:
        raise ValueError(f"bap_steps must be one of {', '.join(BAP_STEP_TABLES)}, not {table!r}")
    words = b"" if table is None else b"bap_steps=%s;" % table.encode()
    if checks is not None:
        words += b"crc32=%d;" % (len(checks) // CHECK_BYTES) + checks
        words += check_of(crc32(_NAME + words))
    return START + _NAME + words if words else b""


def write_opening(table: BapTable) -> bytes:
    """Return the bytes before an object that name its table to live readers: 35 or 32.

    The headers of a visual object sequence and of a visual object, with user data between them (ISO/IEC
    14496-2, 6.2.2). Raises ValueError for an unknown table.
    """
    return _SEQUENCE_HEADER + write_mark(table) + _OBJECT_HEADER


def bytes_needed(content: bytes, most: int) -> int:
    """Return the number of bytes of a mark after the start code of user data, given its beginning.

    most: largest possible number of I periods of the object; a list that claims more is not waited for.
    """
    words, count = _words(content)[1:]
    if count is None:
        return MAX_MARK_BYTES
    return words + CHECK_BYTES * (count + 1) if count <= most else words


def read_mark(content: bytes) -> MarkContent | None:
    """Return the mark in user data, given the bytes after their start code; None if they are not a mark.

    Gives an FbaWarning for a mark with an unknown table.
    """
    head = content[:MAX_MARK_BYTES].partition(_PREFIX)[0]
    if not (_NAME.startswith(head[: len(_NAME)]) or _SIMILAR.search(head)):
        return None
    table, end, count = _words(content)
    problem = ""
    if not end or (count is None and end < len(head)):
        problem = "a mark of the stream was cut off or is damaged"
    if table is not None and table not in BAP_STEP_TABLES:
        warn(
            f"the stream says that it was made with the BAP steps {table!r}, which are not known here; those "
            f"that are: {', '.join(BAP_STEP_TABLES)}",
            stacklevel=2,
        )
        table = None
    checks = None
    if count is not None:
        stop = end + CHECK_BYTES * count
        if len(content) < stop + CHECK_BYTES:
            problem = f"the list of {count} checks behind the end was cut off; the stream cannot be checked"
        elif content[stop : stop + CHECK_BYTES] != check_of(crc32(content[:stop])):
            problem = "the mark behind the end does not match its own CRC-32; the stream cannot be checked"
        else:
            checks = content[end:stop]
    return MarkContent(table, checks, problem)


def _words(content: bytes) -> tuple[str | None, int, int | None]:
    """Return the table that a mark names, the byte behind its words, and the number of checks it announces.

    None, 0 and None without them.
    """
    table, position, count = None, 0, None
    if content.startswith(_NAME):
        at = len(_NAME)
        while count is None and (field := _FIELD.match(content, at, MAX_MARK_BYTES)) is not None:
            at = position = field.end()
            if field[1] == b"bap_steps":
                table = table or field[2].decode("latin-1")
            elif field[2].isdigit() and len(field[2]) <= 9:
                count = int(field[2])
            else:
                break
    return table, position, count


def find_marks(data: bytes | bytearray | memoryview) -> tuple[Mark, ...]:
    """Return the marks after the objects of a complete stream, or of several joined."""
    content = bytes(data)
    marks: list[Mark] = []
    position, begin = 0, 0
    while (position := content.find(_END_CODE + START, position)) >= 0:
        start = position + len(_END_CODE) + len(START)
        table, words, _ = _words(content[start : start + MAX_MARK_BYTES])
        if table in BAP_STEP_TABLES:
            object_start = max(content.rfind(code, begin, position) for code in _OBJECT_CODES)
            marks.append(Mark(table, max(object_start, begin), start + words))
            begin = start + words
        position = start
    return tuple(marks)


def marked_table(data: bytes | bytearray | memoryview) -> BapTable | None:
    """Return the table that the marks in a stream name; None without a mark, or if they differ."""
    tables = {mark.table for mark in find_marks(data)}
    for opening in _BEFORE_OBJECT.finditer(bytes(data)):
        table = _words(opening[0][len(_SEQUENCE_HEADER) + len(START) :])[0]
        if table in BAP_STEP_TABLES:
            tables.add(table)
    return tables.pop() if len(tables) == 1 else None
