"""The mark behind the end of a stream, which says with which table of BAP steps it was made.

No bit of an FBA object says so. The mark is user data (user_data_start_code 00 00 01 b2, ISO/IEC 14496-2,
6.2.2) directly behind the end code: `00 00 01 b2 "fba bap_steps=visage;"`. It stands there, and not before
the object, because the decoder of visage|SDK, the only other one whose source is public, exits unless the
first four bytes are an object start code, and goes on decoding planes at any start code but the end code.
Behind the end code it reads nothing.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

from fba.codec._plane import syntax
from fba.errors import FbaWarning
from fba.parameters import BAP_STEP_TABLES

USER_DATA = 0xB2
"""Last byte of user_data_start_code."""
START = bytes([*syntax.START_CODE_PREFIX, USER_DATA])
_END_CODE = bytes([*syntax.START_CODE_PREFIX, syntax.END_CODE])
_OBJECT_CODES = tuple(bytes([*syntax.START_CODE_PREFIX, code]) for code in syntax.OBJECT_CODES)
_WORDS = b"fba bap_steps="
_STOP = b";"
LONGEST = 64
"""Bytes of user data within which a mark is complete."""


@dataclass(frozen=True)
class Mark:
    """A mark. table: of the object before it, which begins at the byte `begin`. end: byte behind the mark."""

    table: str
    begin: int
    end: int


def write_mark(table: str) -> bytes:
    """Return the mark to be put behind a stream. Raises ValueError for an unknown table."""
    if table not in BAP_STEP_TABLES:
        raise ValueError(f"bap_steps must be one of {', '.join(BAP_STEP_TABLES)}, not {table!r}")
    return START + _WORDS + table.encode() + _STOP


def read_mark(content: bytes) -> str | None:
    """Return the table that user data name, given what follows their start code; None if they are no mark.

    Gives an FbaWarning where they name a table that is not known here.
    """
    words, stop, _ = content[:LONGEST].partition(_STOP)
    if not stop or not words.startswith(_WORDS):
        return None
    table = words.removeprefix(_WORDS).decode("latin-1")
    if table not in BAP_STEP_TABLES:
        warnings.warn(
            f"the stream says that it was made with the BAP steps {table!r}, which are not known here; those "
            f"that are: {', '.join(BAP_STEP_TABLES)}",
            FbaWarning,
            stacklevel=2,
        )
        return None
    return table


def find_marks(data: bytes | bytearray | memoryview) -> tuple[Mark, ...]:
    """Return the marks in a complete stream, or in several one after another."""
    content = bytes(data)
    marks: list[Mark] = []
    position, begin = 0, 0
    while (position := content.find(_END_CODE + START, position)) >= 0:
        start = position + len(_END_CODE) + len(START)
        table = read_mark(content[start : start + LONGEST])
        if table is not None:
            found = max(content.rfind(code, begin, position) for code in _OBJECT_CODES)
            end = content.index(_STOP, start) + 1
            marks.append(Mark(table, max(found, begin), end))
            begin = end
        position = start
    return tuple(marks)


def marked_table(data: bytes | bytearray | memoryview) -> str | None:
    """Return the table that the marks in a stream name; None without a mark, or where they differ."""
    tables = {mark.table for mark in find_marks(data)}
    return tables.pop() if len(tables) == 1 else None
