"""Write a file whole or not at all: a temporary file beside the target, renamed over it at the end."""

from __future__ import annotations

import atexit
import contextlib
import os
import secrets
import stat
from collections.abc import Iterator
from typing import BinaryIO

from fba.errors import FbaError, FormatError

Path = str | os.PathLike[str]

_unfinished: set[str] = set()
"""Temporary files that may exist now, noted before they are made: Ctrl-C may come between any two steps."""


@contextlib.contextmanager
def atomic(path: Path) -> Iterator[BinaryIO]:
    """A binary file to write to; the target appears, or changes, only when the block ends well.

    Whatever leaves the block early (an exception, Ctrl-C) removes the temporary file and leaves an
    old target as it was. An existing target keeps its permissions, a link is written through, and a
    device or a pipe with a reader (`/dev/null`, `>(program)`) is written to directly. Raises
    FormatError where the target cannot be written.
    """
    name = os.fspath(path)
    try:
        target = os.path.realpath(name)
        mode = os.stat(target).st_mode
    except FileNotFoundError:
        mode = None  # the folder may be missing too: creating the temporary file will tell
    except (OSError, ValueError) as error:
        raise FormatError(f"cannot be written: {_reason(error)}", path=name) from error
    if mode is not None and stat.S_ISDIR(mode):
        raise FormatError("is a folder; give the name of a file to write", path=name)
    if mode is not None and not stat.S_ISREG(mode):
        with _directly(name, target) as file:
            yield file
        return
    if mode is not None and not os.access(target, os.W_OK):
        raise FormatError(
            "is write-protected; make it writable (chmod u+w) or choose another name", path=name
        )
    with temporary_beside(target, ".tmp", name) as (temporary, handle):
        try:
            with os.fdopen(handle, "wb") as file:
                yield file
            if mode is not None:
                os.chmod(temporary, stat.S_IMODE(mode))
            os.replace(temporary, target)
        except FbaError:
            raise  # some are also OSErrors, and say more than "could not be written"
        except OSError as error:
            raise FormatError(f"could not be written: {_reason(error)}", path=name) from error


@contextlib.contextmanager
def temporary_beside(target: str, suffix: str, name: Path) -> Iterator[tuple[str, int]]:
    """A new file in the target's folder, and its open handle: gone when the block ends, unless renamed.

    A block that never ends, because Ctrl-C came while it was being entered, leaves it to the end of the
    program. Raises FormatError, which gives the name as the user wrote it, where it cannot be made.
    """
    temporary = os.path.join(os.path.dirname(target), f".fba-{secrets.token_hex(6)}{suffix}")
    _unfinished.add(temporary)
    try:
        # created with the permissions that a plain open() would give, as the umask wants them
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
    except (OSError, ValueError) as error:
        _unfinished.discard(temporary)
        raise FormatError(f"cannot be written: {_reason(error)}", path=name) from error
    try:
        yield temporary, handle
    finally:
        _remove(temporary)


def _remove(temporary: str) -> None:
    with contextlib.suppress(OSError):
        os.unlink(temporary)
    _unfinished.discard(temporary)


@atexit.register
def _remove_unfinished() -> None:
    for temporary in tuple(_unfinished):
        _remove(temporary)


@contextlib.contextmanager
def _directly(name: str, target: str) -> Iterator[BinaryIO]:
    """A device or a pipe, which must not be replaced by a file."""
    try:
        # without O_NONBLOCK, opening a pipe that nobody reads would wait for ever
        handle = os.open(target, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0))
        os.set_blocking(handle, True)
        with os.fdopen(handle, "wb") as file:
            yield file
    except FbaError:
        raise
    except OSError as error:
        raise FormatError(f"could not be written: {_reason(error)}", path=name) from error


def _reason(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
