"""Files to be read: opened, with a clear error if they cannot be read, and named in errors."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import PurePath
from typing import BinaryIO

from fba.errors import (
    BitstreamError,
    FormatError,
    LimitError,
    ModelError,
    OptionError,
    RangeError,
    UnsupportedError,
)

Path = str | os.PathLike[str]

_BYTES = bytes | bytearray | memoryview

HEAD_BYTES = 65536
"""Bytes of a file that are read to find its format."""
MAX_WHOLE_FILE = 1 << 31
"""Largest file, in bytes, that is read in one piece; at FBA bit rates, months of animation."""


def open_source(path: Path) -> tuple[BinaryIO, int]:
    """Return the file, opened for binary reading, and its size in bytes when it was opened.

    Readers stop at that size, even if the file grows meanwhile. Raises FormatError for a missing
    file, a folder, a pipe or device, an empty or unreadable file; OptionError for other values.
    """
    if not isinstance(path, str | os.PathLike):
        hint = (
            "fba.decode(data) decodes the bytes of a stream" if isinstance(path, _BYTES) else "give its name"
        )
        raise OptionError(f"the name of a file is needed, not {type(path).__name__}; {hint}")
    name = os.fspath(path)
    try:
        # opening a pipe that nobody writes to would block
        mode = os.stat(name).st_mode
        if stat.S_ISDIR(mode):
            raise FormatError("is a folder; give the name of a file in it", path=name)
        if not stat.S_ISREG(mode):
            raise FormatError(
                "is a pipe or a device, not a regular file; save its content to a file first", path=name
            )
        file = open(name, "rb")  # noqa: SIM115 - handed to the caller, who closes it
        size = os.fstat(file.fileno()).st_size
    except FileNotFoundError as error:
        raise FormatError("there is no such file; check the name and the folder", path=name) from error
    except (OSError, ValueError) as error:
        reason = (error.strerror if isinstance(error, OSError) else None) or str(error)
        if isinstance(error, FormatError):
            raise
        raise FormatError(f"cannot be read: {reason}", path=name) from error
    if not size:
        file.close()
        raise FormatError("is empty (0 bytes); was it fully copied or written?", path=name)
    return file, size


def stem_of(path: Path) -> str:
    """Return the name of a file without its folder and its suffix."""
    return PurePath(path).stem


def read_head(path: Path) -> bytes:
    """Return up to `HEAD_BYTES` from the beginning of a file; FormatError as `open_source`."""
    file, _ = open_source(path)
    with file:
        return _read(file, HEAD_BYTES, path)


def read_whole(path: Path) -> bytes:
    """Return all bytes of a file; FormatError as `open_source`, or beyond `MAX_WHOLE_FILE` bytes."""
    file, size = open_source(path)
    with file:
        if size > MAX_WHOLE_FILE:
            raise FormatError(
                f"is {size} bytes long, more than the {MAX_WHOLE_FILE} that can be read in one piece; "
                "feed it to fba.Decoder chunk by chunk",
                path=path,
            )
        return _read(file, size, path)


def _read(file: BinaryIO, count: int, path: Path) -> bytes:
    try:
        return file.read(count)
    except OSError as error:
        raise FormatError(f"cannot be read: {error.strerror or error}", path=path) from error


@contextmanager
def naming_file(path: Path) -> Iterator[None]:
    """Put a file's name before errors about its content that do not have it.

    A ModelError becomes a FormatError; all others keep their type and attributes.
    """
    name = os.fspath(path)
    try:
        yield
    except ModelError as error:
        finding = error.finding.removeprefix(f"{os.path.basename(name)}: ")
        raise FormatError(finding, path=path).with_remedies(*error.remedies) from error
    except (BitstreamError, FormatError, LimitError, RangeError, UnsupportedError) as error:
        if isinstance(error, FormatError):
            named, error.path = error.path is not None, error.path or name
        else:
            named = error.finding.startswith(f"{name}: ")
        if not named:
            error.args = (f"{name}: {error.finding}",)
        raise
