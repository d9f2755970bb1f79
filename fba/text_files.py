"""Text files of importers: opened, read by lines and words, numbers parsed, sizes limited."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path
from typing import BinaryIO

from fba.errors import FormatError, ModelError
from fba.source import open_source

MAX_VERTICES = 2_000_000
"""Most vertices of one file; a head worth animating has some ten thousand."""
MAX_FACES = 4_000_000
"""Most polygons of one file."""
MAX_CORNERS = 16_000_000
"""Most polygon corners of one file."""
MAX_LINE = 1 << 20
"""Longest line of a text file, in bytes."""
MAX_TEXT = 1 << 26
"""Largest file of feature points, weights or settings, in bytes."""


def read_lines(path: str | os.PathLike[str]) -> Iterator[tuple[int, str]]:
    """Yield line numbers from 1 and lines of a text file, without their ends, read one by one.

    UTF-8, else Latin-1. Raises ModelError as `open_source` raises FormatError, for a line beyond `MAX_LINE`,
    for UTF-16 with a byte order mark, and for zero bytes, which no text has.
    """
    name = os.fspath(path)
    file, size = _opened(name)
    with file:
        number, left = 0, size
        while left > 0:
            try:
                raw = file.readline(min(MAX_LINE, left))
            except OSError as error:
                raise ModelError(f"{name}: cannot be read: {error.strerror or error}") from error
            if not raw:
                return
            left -= len(raw)
            number += 1
            if len(raw) >= MAX_LINE:
                raise ModelError(f"{name}:{number}: the line is longer than {MAX_LINE} bytes; is this text?")
            if number == 1 and raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
                raise ModelError(f"{name}: is UTF-16 text; save it as UTF-8")
            if b"\0" in raw:
                raise ModelError(f"{name}:{number}: holds zero bytes; this is no text file")
            try:
                text = raw.decode("utf-8-sig" if number == 1 else "utf-8")
            except UnicodeDecodeError:
                text = raw.decode("latin-1")
            yield number, text.rstrip("\r\n")


def read_words(path: str | os.PathLike[str]) -> Iterator[tuple[str, list[str]]]:
    """Yield each line's position for messages, and its words without comments (#). Errors as `read_lines`."""
    for line, text in read_lines(path):
        tokens = text.split("#", 1)[0].split()
        if tokens:
            yield f"{os.fspath(path)}:{line}", tokens


def packaged_rows(package: str, name: str) -> list[dict[str, str]]:
    """Return the rows of a CSV file that comes with a package of ours, cells by the titles of columns."""
    with (files(package) / name).open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _opened(name: str) -> tuple[BinaryIO, int]:
    try:
        return open_source(name)
    except FormatError as error:
        raise ModelError(str(error)) from error


def read_bytes(path: str | os.PathLike[str], limit: int = MAX_TEXT) -> bytes:
    """Return all bytes of a file; ModelError where it cannot be read or is larger than `limit`."""
    name = os.fspath(path)
    file, size = _opened(name)
    with file:
        if size > limit:
            raise ModelError(f"{name}: is {size} bytes long, more than the {limit} that can be read")
        try:
            return file.read(size)
        except OSError as error:
            raise ModelError(f"{name}: cannot be read: {error.strerror or error}") from error


def parse_number(token: str, where: str, what: str) -> float:
    """Return a finite number, else ModelError naming the place."""
    try:
        value = float(token)
    except ValueError:
        value = float("nan")
    if not abs(value) < 1e30:
        raise ModelError(f"{where}: {what} must be a finite number, not {token[:40]!r}")
    return value


def parse_integer(token: str, where: str, what: str) -> int:
    """Return a whole number, else ModelError naming the place."""
    try:
        # int() takes underscores, other scripts' digits and numbers of any length; 18 digits fit an int64
        if len(token) <= 18 and token.isascii() and "_" not in token:
            return int(token)
    except ValueError:
        pass
    raise ModelError(f"{where}: {what} must be a whole number, not {token[:40]!r}")


def find_beside(path: str | os.PathLike[str], name: str) -> Path | None:
    """Return the path of a file that another file names, in the same folder; None if there is no such file.

    Names come from untrusted files: folders in them are dropped, so none reaches outside.
    """
    plain = name.replace("\\", "/").rsplit("/", 1)[-1]
    if not plain or plain in (".", "..") or "\0" in plain:
        return None
    candidate = Path(path).parent / plain
    try:
        return candidate if candidate.is_file() else None
    except (OSError, ValueError):  # too long a name, or a lone surrogate
        return None
