"""The machine code of one function on disk: numba's own cache, but with files that are checked.

Numba reads an index and a file of machine code for each signature, and believes both: a file that was cut
breaks the program, and a flipped bit may crash it. Here a file holds all that belongs to one signature, and
begins with a digest of its content and of everything that the content depends on. Whatever does not match is
compiled again and replaced; where nothing can be written, nothing is.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
from collections.abc import Iterator
from functools import cache, cached_property
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
from numba.core.caching import FunctionCache, NullCache
from numba.core.serialize import dumps

from fba import __version__
from fba.atomic import atomic
from fba.compilation import announce
from fba.errors import FormatError

DIGEST = 32
"""Bytes of the digest at the start of a file."""


class MachineCode(NullCache):  # type: ignore[misc]  # numba has no types here
    """Finds and keeps the machine code of a function, in the folders where numba does.

    It says so when there is none and the function has to be compiled.
    """

    def __init__(self, function: FunctionType) -> None:
        self._function = function

    @cached_property
    def _numba(self) -> Any:
        """Numba's cache with checked files, or None where there is no folder for them."""
        try:
            found = FunctionCache(self._function)
        except (OSError, RuntimeError):
            return None
        found._cache_file = CodeFiles(found.cache_path, found._impl.filename_base, self._function)
        return found

    def load_overload(self, signature: Any, target: Any) -> Any:
        """The compiled function, or None."""
        found = None
        if self._numba is not None:
            # A file with the right digest was made by the same versions of everything, and loads. Should it
            # not, for whatever reason, the function is compiled.
            with contextlib.suppress(Exception):
                found = self._numba.load_overload(signature, target)
        if found is None:
            announce()
        return found

    def save_overload(self, signature: Any, compiled: Any) -> None:
        if self._numba is not None:
            self._numba.save_overload(signature, compiled)


class CodeFiles:
    """The files of one function, in place of numba's `IndexDataCacheFile`: one for each key."""

    def __init__(self, folder: str, name: str, function: FunctionType) -> None:
        self._folder, self._name, self._function = Path(folder), name, function

    def load(self, key: Any) -> Any:
        """What was saved for a key, or None where that is missing or damaged."""
        try:
            content = self._path(key).read_bytes()
        except OSError:
            return None
        if content[:DIGEST] != self._digest(content[DIGEST:]):
            return None
        kept, data = pickle.loads(content[DIGEST:])
        return data if kept == key else None

    def save(self, key: Any, data: Any) -> None:
        """Keep data for a key, where there is room and permission for it."""
        content = dumps((key, data))
        with contextlib.suppress(OSError, FormatError), atomic(self._path(key)) as file:
            file.write(self._digest(content) + content)

    def _path(self, key: Any) -> Path:
        return (
            self._folder
            / f"{self._name}.{hashlib.blake2b(repr(key).encode(), digest_size=12).hexdigest()}.fbc"
        )

    def _digest(self, content: bytes) -> bytes:
        return hashlib.blake2b(content, digest_size=DIGEST, key=self._stamp).digest()

    @cached_property
    def _stamp(self) -> bytes:
        """Changes with everything that the machine code depends on, apart from the key."""
        digest = hashlib.blake2b(f"{numba.__version__} {__version__}".encode(), digest_size=DIGEST)
        for function in _reached(self._function):
            digest.update(_source(function.__code__.co_filename))
            for name in function.__code__.co_names:
                value = function.__globals__.get(name)
                if isinstance(value, int | float | tuple):  # compiled into the code, wherever they come from
                    digest.update(f"{name}={value!r}".encode())
        return digest.digest()


def _reached(function: FunctionType) -> Iterator[FunctionType]:
    """A function and all compiled functions that it calls, by whatever way."""
    found = [function]
    for one in found:
        yield one
        for name in one.__code__.co_names:
            called = getattr(one.__globals__.get(name), "py_func", None)
            if called is not None and called not in found:
                found.append(called)


@cache
def _source(path: str) -> bytes:
    """A digest of a source file; of none where it cannot be read (a zip archive: its version tells)."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").digest()
    except OSError:
        return os.fsencode(path)
