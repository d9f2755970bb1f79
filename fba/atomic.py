"""Atomic writing: a temporary file in the same folder is renamed over the target when it is complete."""

from __future__ import annotations

import atexit
import contextlib
import errno
import os
import re
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, NamedTuple

from fba.errors import FbaError, FormatError

PathLike = str | os.PathLike[str]

_OPEN_FILE = re.compile(r"/(?:dev|proc/self)/fd/(\d{1,9})")
_STANDARD = {"/dev/stdin": 0, "/dev/stdout": 1, "/dev/stderr": 2}

_unfinished: set[str] = set()
"""Temporary files that may exist now, added before they are made: Ctrl-C may come between any two steps."""


@contextlib.contextmanager
def atomic(path: PathLike) -> Iterator[BinaryIO]:
    """Open a binary file to write; the target appears, or changes, only if the block ends without an error.

    If an exception or Ctrl-C ends the block, the temporary file is removed and an old target stays as it was.
    An existing target keeps its permissions. If it is a link, the file that it points to is written. A
    device, a pipe with a reader and an open file by its number (`/dev/null`, `>(program)`, `/dev/stdout`) are
    written directly. Raises FormatError if the target cannot be written.
    """
    name = os.fspath(path)
    target, mode, direct = check_target(name)
    if direct:
        with _open_directly(name) as file:
            yield file
        return
    with temporary_beside(target, ".tmp", name) as (temporary, handle):
        try:
            with os.fdopen(handle, "wb") as file:
                yield file
            if mode is not None:
                os.chmod(temporary, stat.S_IMODE(mode))
            os.replace(temporary, target)
        except FbaError:
            raise  # some are also OSErrors, with a better message
        except OSError as error:
            raise FormatError(f"could not be written: {_reason(error)}", path=name) from error


@contextlib.contextmanager
def atomic_path(path: PathLike) -> Iterator[Path]:
    """Yield the path of a temporary file, for encoders that need a name instead of an open file.

    It lies in the folder of the target. It is renamed to the target if the block ends without an error, and
    removed otherwise. Raises FormatError if the target cannot be written, or is a device or a pipe.
    """
    name, mode, direct = check_target(path)
    if direct:
        raise FormatError("is a device or a pipe; give the name of a file to write", path=path)
    target = Path(name)
    with temporary_beside(name, target.suffix, path) as (temporary_name, handle):
        os.close(handle)
        temporary = Path(temporary_name)
        yield temporary
        try:
            if mode is not None:
                temporary.chmod(stat.S_IMODE(mode))
            temporary.replace(target)
        except OSError as error:
            raise write_error(path, error) from error


def write_error(path: PathLike, error: BaseException, what: str = "could not be written") -> FbaError:
    """Return the error for failed writing: `what`, the reason, and what to do if the disk is full."""
    if isinstance(error, FbaError):
        return error
    reason = _reason(error) or type(error).__name__
    if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EDQUOT):
        reason += "; make room, or write to another disk"
    return FormatError(f"{what}: {reason}", path=path)


class Target(NamedTuple):
    """A file to write.

    path: its name with links followed. mode: st_mode; None if it does not exist yet. direct: whether it is
    written in place, because no other file can replace it: a device, a pipe, an open file.
    """

    path: str
    mode: int | None
    direct: bool


def check_target(path: PathLike) -> Target:
    """Follow links, and check that a file of that name can be written.

    Raises FormatError for a folder, a write-protected file or folder, and a folder that does not exist.
    """
    name = os.fspath(path)
    number = _descriptor(name)
    try:
        if number is not None:
            return Target(name, os.fstat(number).st_mode, True)
        target = os.path.realpath(name)
        mode = os.stat(name).st_mode
    except FileNotFoundError:
        mode = None
    except (OSError, ValueError) as error:
        raise FormatError(f"cannot be written: {_reason(error)}", path=name) from error
    if mode is None:
        _check_folder(os.path.dirname(target), name)
    elif stat.S_ISDIR(mode):
        raise FormatError("is a folder; give the name of a file to write", path=name)
    elif stat.S_ISREG(mode):
        if not os.access(target, os.W_OK):
            raise FormatError(
                "is write-protected; make it writable (chmod u+w) or choose another name", path=name
            )
        _check_folder(os.path.dirname(target), name)
    return Target(target, mode, mode is not None and not stat.S_ISREG(mode))


def _check_folder(folder: str, name: str) -> None:
    """Raise FormatError if no file can be made in a folder. name: of the file, as the user wrote it."""
    try:
        os.stat(os.path.join(folder, ""))
    except FileNotFoundError as error:
        raise FormatError(
            f"cannot be written: {_reason(error)}; make the folder {folder} first", path=name
        ) from error
    except OSError as error:
        raise FormatError(f"cannot be written: {_reason(error)}", path=name) from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise FormatError(
            f"cannot be written: Permission denied: no files can be made in the folder {folder}", path=name
        )


def _descriptor(name: str) -> int | None:
    """Return the descriptor of an open file by its name, 1 for `/dev/stdout`; None for other names."""
    match = _OPEN_FILE.fullmatch(name)
    return int(match[1]) if match else _STANDARD.get(name)


@contextlib.contextmanager
def temporary_beside(target: str, suffix: str, name: PathLike) -> Iterator[tuple[str, int]]:
    """Make a new file in the target's folder; yield its name and open handle, and remove it at the end.

    If Ctrl-C comes while the block is being entered, the file is removed when the program ends. Raises
    FormatError, with the name as the user wrote it, if the file cannot be made.
    """
    temporary = os.path.join(os.path.dirname(target), f".fba-{secrets.token_hex(6)}{suffix}")
    _unfinished.add(temporary)
    try:
        # with the permissions that open() gives, by the umask
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
def _open_directly(name: str) -> Iterator[BinaryIO]:
    """Open a target that a file cannot replace: a device, a pipe, an open file."""
    number = _descriptor(name)
    try:
        if number is not None:
            handle = os.dup(number)
        else:
            # without O_NONBLOCK, opening a pipe without a reader would wait for ever
            handle = os.open(name, os.O_WRONLY | getattr(os, "O_NONBLOCK", 0))
            os.set_blocking(handle, True)
        with os.fdopen(handle, "wb") as file:
            yield file
    except FbaError:
        raise
    except OSError as error:
        reason = "nobody reads from this pipe" if error.errno == errno.ENXIO else _reason(error)
        raise FormatError(f"could not be written: {reason}", path=name) from error


def _reason(error: BaseException) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error)
