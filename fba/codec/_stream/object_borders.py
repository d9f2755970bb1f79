"""Where the objects of a stream begin and end, what stands behind them, and what their marks say."""

from __future__ import annotations

from collections.abc import Sequence

from fba.codec._plane import syntax
from fba.codec._stream.mark import USER_DATA, Mark, read_mark
from fba.parameters import BAP_STEP_TABLES

_DEFAULT_TABLE = BAP_STEP_TABLES[0]


class ObjectBorders:
    """What is known of the objects of a stream so far, and of the last one in particular.

    bap_steps: the table that all objects were made with; None: the one that a mark names. marks: those of the
    whole stream, where they are known beforehand; each holds for the object before it.

    count: objects begun. table: of the last one. has_body: whether one of its planes carries BAPs.
    end_code: last byte of the start code that ended it; None before that. end: byte of the stream behind that
    code, or behind user data that follow it. mark: the table that the mark behind it names, None without one.
    """

    def __init__(self, bap_steps: str | None, marks: Sequence[Mark]) -> None:
        self._bap_steps = bap_steps
        self._marks = marks
        self._in_user_data = False  # whether user data stand at `end`, up to the next start code
        self.count = 0
        self.table = bap_steps or _DEFAULT_TABLE
        self.has_body = False
        self.end_code: int | None = None
        self.end = 0
        self.mark: str | None = None

    @property
    def ended(self) -> bool:
        """Whether an end code closed the last object."""
        return self.end_code == syntax.END_CODE

    def begin_object(self, byte: int) -> None:
        """Begin another object, at this byte of the stream."""
        marked = (mark.table for mark in self._marks if mark.begin <= byte < mark.end)
        self.table = self._bap_steps or next(marked, _DEFAULT_TABLE)
        self.count += 1
        self.has_body = False
        self.end_code = None
        self.mark = None

    def end_object(self, code: int, byte: int) -> None:
        """End the object at a start code. byte: of the stream, behind it."""
        self.end_code = code
        self.end = byte
        self._in_user_data = False

    def read_user_data(self, code: int, byte: int, content: bytes) -> str:
        """Take a start code outside of an object, and read the mark if it begins one.

        byte: of the stream, at which the start code stands. content: what follows it. Returns what is wrong:
        planes with BAPs were decoded with other steps than the mark says; "" if nothing is.
        """
        directly = byte == self.end
        if self._in_user_data:
            self.end = byte
        self._in_user_data = code == USER_DATA and byte == self.end
        if not (code == USER_DATA and directly and self.ended):
            return ""
        self.mark = read_mark(content) or self.mark
        if self.mark in (None, self.table) or not self.has_body:
            return ""
        return (
            f"the stream says behind its end that it was made with the BAP steps {self.mark!r}; it was "
            f"decoded with {self.table!r}"
        )

    def unread(self, length: int) -> int:
        """Return how many bytes behind the last object are no user data. length: bytes of the stream."""
        return 0 if self._in_user_data else max(length - self.end, 0)
