"""Checked access to a JSON document: every value knows its file and its path in the document."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from typing import Any

from fba.errors import ModelError
from fba.limits import Limits

MAX_TEXT = 1 << 16
"""Most characters of a text; names and notes are far shorter."""


class Budget:
    """Counts the memory that the content of one file takes, so that a small file cannot exhaust it.

    limits: how much that may be. source: bytes of the file, and of the files that it names.
    """

    def __init__(self, limits: Limits, source: int) -> None:
        self.limits, self._source = limits, source
        self._used = 0

    def charge(self, amount: int, where: Value) -> None:
        """Count `amount` bytes, before they are allocated; LimitError where that is too much."""
        self._used += max(amount, 256)  # even an empty array or object takes this much
        place = f"{where.file}: {where.path}" if where.path else where.file
        self.limits.check_bytes(self._used, f"{place}: what the file unpacks to", source=self._source)

    def add_source(self, size: int) -> None:
        """Count the bytes of another file that the file names."""
        self._source += size

    def copy(self) -> Budget:
        """Return a budget that has used as much, for one of several results made from the file."""
        copied = Budget(self.limits, self._source)
        copied._used = self._used
        return copied


class Value:
    """A JSON value and its place.

    data: as `json.loads` returns it. file: its name, for messages. path: such as "meshes[0].name". Methods
    that find something unexpected raise ModelError with file and path.
    """

    __slots__ = ("data", "file", "path")

    def __init__(self, data: Any, file: str, path: str = "") -> None:
        self.data = data
        self.file = file
        self.path = path

    def error(self, text: str) -> ModelError:
        """Return the error to raise about this value."""
        return ModelError(f"{self.file}: {self.path}: {text}" if self.path else f"{self.file}: {text}")

    def get(self, key: str) -> Value | None:
        """Return a member of an object, or None if it is absent."""
        members = self._object()
        return self._member(key, members[key]) if key in members else None

    def member(self, key: str) -> Value:
        """Return a member of an object; ModelError where it is missing."""
        value = self.get(key)
        if value is None:
            raise self.error(f"{key!r} is missing")
        return value

    def members(self) -> Iterator[tuple[str, Value]]:
        """Return names and members of an object."""
        for key, data in self._object().items():
            yield key, self._member(key, data)

    def entries(self, key: str, most: int) -> list[tuple[str, Value]]:
        """Return names and members of the object in member `key`, at most `most`; empty without one."""
        content = self.get(key)
        if content is None:
            return []
        entries = list(content.members())
        if len(entries) > most:
            raise content.error(f"more than the {most} entries that can be read")
        for name, _ in entries:
            Value(name, content.file, content.path).text()  # names must be Unicode too
        return entries

    def elements(self, most: int, key: str | None = None) -> list[Value]:
        """Return the elements of this list, or of the list in member `key` (empty without one)."""
        if key is not None:
            value = self.get(key)
            return [] if value is None else value.elements(most)
        if not isinstance(self.data, list):
            raise self._unexpected("a list")
        if len(self.data) > most:
            raise self.error(f"{len(self.data)} elements, more than the {most} that can be read")
        return [Value(data, self.file, f"{self.path}[{n}]") for n, data in enumerate(self.data)]

    def integer(self, low: int, high: int) -> int:
        """Return a whole number within low..high."""
        data = self.data
        if isinstance(data, float) and data.is_integer():
            data = int(data)  # some writers write 3.0
        if isinstance(data, bool) or not isinstance(data, int):
            raise self._unexpected("a whole number")
        if not low <= data <= high:
            raise self.error(f"{_short(data)} is not within {low}..{high}")
        return data

    def index(self, count: int, what: str) -> int:
        """Return a whole number below `count`: the index of a `what`."""
        if not count:
            raise self.error(f"names {what} {_short(self.data)}, of which the file has none")
        return self.integer(0, count - 1)

    def number(self, low: float = -math.inf, high: float = math.inf) -> float:
        """Return a finite number within low..high."""
        if isinstance(self.data, bool) or not isinstance(self.data, int | float):
            raise self._unexpected("a number")
        try:
            number = float(self.data)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise self.error("the number is too large")
        if not low <= number <= high:
            raise self.error(f"{number:g} is not within {low:g}..{high:g}")
        return number

    def numbers(self, count: int, low: float = -math.inf, high: float = math.inf) -> tuple[float, ...]:
        """Return a list of exactly `count` finite numbers."""
        if not isinstance(self.data, list) or len(self.data) != count:
            raise self._unexpected(f"a list of {count} numbers")
        return tuple(element.number(low, high) for element in self.elements(count))

    def text(self, most: int = MAX_TEXT) -> str:
        """Return a text of at most `most` characters, all of which can be written as UTF-8."""
        if not isinstance(self.data, str):
            raise self._unexpected("text")
        if len(self.data) > most:
            raise self.error(f"a text of {len(self.data)} characters, more than the {most} that can be read")
        try:
            self.data.encode()
        except UnicodeEncodeError:
            raise self.error("the text holds half a character (a lone surrogate)") from None
        return self.data

    def choice(self, *words: str) -> str:
        """Return the text, which must be one of the given words."""
        if not isinstance(self.data, str) or self.data not in words:
            raise self.error(f"{_short(self.data)} is not one of {', '.join(words)}")
        return self.data

    def boolean(self) -> bool:
        """Return the value, which must be true or false."""
        if not isinstance(self.data, bool):
            raise self._unexpected("true or false")
        return self.data

    def _object(self) -> dict[str, Any]:
        if not isinstance(self.data, dict):
            raise self._unexpected("an object")
        return self.data

    def _member(self, key: str, data: Any) -> Value:
        simple = key.isidentifier() and len(key) <= 60
        step = f".{key}" if simple else f"[{_short(key)}]"
        return Value(data, self.file, f"{self.path}{step}".removeprefix("."))

    def _unexpected(self, wanted: str) -> ModelError:
        return self.error(f"expected {wanted}, found {_kind(self.data)}")


@contextlib.contextmanager
def locating_errors(value: Value) -> Iterator[None]:
    """Adds the position in the file to errors raised by the data model."""
    try:
        yield
    except ModelError as error:
        if str(error).startswith(f"{value.file}: "):
            raise  # it has its position already
        raise value.error(str(error)) from error


def optional_member(value: Value | None, key: str) -> Value | None:
    """Return member `key` of a value that may be missing itself."""
    return None if value is None else value.get(key)


def _kind(data: Any) -> str:
    if data is None:
        return "null"
    if isinstance(data, dict):
        return "an object"
    if isinstance(data, list):
        return f"a list of {len(data)}"
    return _short(data)


def _short(data: Any) -> str:
    if isinstance(data, dict | list):
        return _kind(data)
    if isinstance(data, int) and not isinstance(data, bool) and abs(data) >= 10**40:
        return "a huge number"
    text = ascii(data)
    return text if len(text) <= 60 else text[:57] + "..."
