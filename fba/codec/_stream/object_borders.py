"""The borders of a stream's objects, the bytes around them, and their marks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.arrays import UInt8
from fba.codec._plane import syntax
from fba.codec._stream.mark import SEQUENCE, USER_DATA, Mark, read_mark
from fba.parameters import BAP_STEP_TABLES, BapTable

_DEFAULT_TABLE: BapTable = BAP_STEP_TABLES[0]


class ObjectBorders:
    """The objects of a stream so far, and the state of the last of them.

    bap_steps: the table that all objects were made with; None: the table that a mark names, the mark before
    an object rather than the mark behind it. marks: those behind the objects of the whole stream, if all its
    bytes are there.

    count: number of objects begun. Of the last object, table: of BAP steps; has_body: whether any plane
    carries BAPs; end_code: last byte of the start code that ended it, None before that; end: byte of the
    stream behind that code, or behind user data that follow it; mark: the table that its marks name, None
    without a mark; checks: those that the mark behind it lists, see `checksums`, None without a list.
    """

    def __init__(self, bap_steps: BapTable | None, marks: Sequence[Mark]) -> None:
        self._bap_steps = bap_steps
        self._marks = marks
        self._in_user_data = False  # whether user data stand at `end`, up to the next start code
        self._in_headers = False  # whether headers of a sequence have begun, and no object in it
        self._before: BapTable | None = None  # the table that user data in those headers name
        self.count = 0
        self.table: BapTable = bap_steps or _DEFAULT_TABLE
        self.has_body = False
        self.end_code: int | None = None
        self.begin = self.end = 0
        self.mark: BapTable | None = None
        self.checks: bytes | None = None

    @property
    def ended(self) -> bool:
        """Whether an end code closed the last object."""
        return self.end_code == syntax.END_CODE

    @property
    def size(self) -> int:
        """Number of bytes of the last object, with the code that ended it."""
        return max(self.end - self.begin, 0)

    def begin_object(self, byte: int) -> None:
        """Begin another object, at this byte of the stream."""
        marked = next((mark.table for mark in self._marks if mark.begin <= byte < mark.end), None)
        self.table = self._bap_steps or self._before or marked or _DEFAULT_TABLE
        self.count += 1
        self.has_body = False
        self.end_code = None
        self.begin = byte
        self.mark, self._before = self._before, None
        self.checks = None
        self._in_headers = False

    def end_object(self, code: int, byte: int) -> str:
        """End the object at a start code; return a fault, or "". byte: of the stream, after the code."""
        self.end_code = code
        self.end = byte
        self._in_user_data = False
        self._in_headers = code == SEQUENCE
        return self._difference("before its planes")

    def read_user_data(self, code: int, byte: int, content: bytes) -> list[str]:
        """Read a start code outside of an object, and the mark if a mark begins there; return what is wrong.

        For example, planes with BAPs were decoded with other steps than the mark says. byte: of the stream,
        at which the start code stands. content: what follows it.
        """
        directly = byte == self.end and self.count > 0
        if self._in_user_data:
            self.end = byte
        self._in_user_data = code == USER_DATA and self.count > 0 and byte == self.end
        if code == SEQUENCE:
            self._in_headers, self._before = True, None
        if code != USER_DATA or not (directly or self._in_headers):
            return []
        mark = read_mark(content)
        if mark is None:
            return []
        problems = [mark.problem] if mark.problem else []
        if not directly:
            return problems + self._read_before(mark.table)
        if not self.ended:
            return ["a mark stands behind the object, but the end code before it is damaged; it was not used"]
        before, self.checks = self.mark, mark.checks
        if mark.table in (None, before):
            return problems
        self.mark = mark.table
        difference = self._difference("behind its end")
        return problems + ([difference] if difference else [])

    def _read_before(self, table: BapTable | None) -> list[str]:
        """Note the first table that user data before an object name; return what is wrong."""
        if self._before is None or table in (None, self._before):
            self._before = self._before or table
            return []
        return [f"the headers before the object name the BAP steps {self._before!r}, and then {table!r}"]

    def _difference(self, where: str) -> str:
        """Return the fault that planes with BAPs were decoded with other steps than the mark's, or ""."""
        if self.mark in (None, self.table) or not self.has_body:
            return ""
        return (
            f"the stream says {where} that it was made with the BAP steps {self.mark!r}; it was "
            f"decoded with {self.table!r}"
        )

    def unread(self, length: int) -> int:
        """Return how many bytes behind the last object are not user data. length: bytes of the stream."""
        return 0 if self._in_user_data else max(length - self.end, 0)


_MIN_BYTES = 4096
"""Smallest size of the buffer, and least number of bytes to drop: moving fewer is not worthwhile."""


class Buffer:
    """Bytes of a stream: `data[:length]`, after `offset` bytes that were dropped."""

    def __init__(self) -> None:
        self.length = 0
        self.offset = 0
        self._allocate(_MIN_BYTES)

    @property
    def data(self) -> UInt8:
        """The bytes, as an array that compiled code can read without a copy."""
        return np.frombuffer(self._bytes, dtype=np.uint8)

    def append(self, chunk: bytes | bytearray | memoryview) -> None:
        """Append bytes at the end."""
        new = np.frombuffer(chunk, dtype=np.uint8)
        need = self.length + len(new)
        if need > len(self._bytes):
            old = self.data[: self.length]
            self._allocate(max(need, 2 * len(self._bytes)))
            self.data[: self.length] = old
        self.data[self.length : need] = new
        self.length = need

    def can_drop(self, count: int) -> bool:
        """Return whether `drop` drops this number of bytes: not if moving the rest costs too much."""
        return count >= _MIN_BYTES and 2 * count >= self.length

    def drop(self, count: int) -> int:
        """Drop `count` bytes at the front, or none (see `can_drop`); return the number dropped."""
        if not self.can_drop(count):
            return 0
        rest = self.data[count : self.length]
        self._allocate(max(2 * len(rest), _MIN_BYTES))
        self.data[: len(rest)] = rest
        self.length = len(rest)
        self.offset += count
        return count

    def find_start_code(self, start: int) -> tuple[int, int] | None:
        """Return position and last byte of the first 00 00 01 xx from byte `start` on, or None."""
        position = self._bytes.find(b"\x00\x00\x01", start, self.length)
        if position < 0 or position + 3 >= self.length:
            return None
        return position, self._bytes[position + 3]

    def _allocate(self, size: int) -> None:
        self._bytes = bytearray(size)
