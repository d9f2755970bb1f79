"""Disk cache of compiled functions: numba's cache, but with files that are checked.

Numba trusts its index and its files of machine code: a truncated file breaks the program, and a flipped bit
may crash it. Here a file contains everything for a signature, and begins with a digest of its content and of
all that the content depends on. If the digest does not match, the function is compiled again and the file
replaced. Failures to write are ignored.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
from collections.abc import Callable, Iterator
from functools import cache, cached_property
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
from numba.core.caching import FunctionCache, NullCache
from numba.core.runtime import rtsys
from numba.core.serialize import dumps
from numba.cpython import hashing  # noqa: F401  # names the symbols that machine code may refer to

from fba import __version__
from fba.atomic import atomic
from fba.errors import FormatError

DIGEST_BYTES = 32
"""Bytes of the digest at the start of a file."""


class MachineCode(NullCache):  # type: ignore[misc]  # numba has no types here
    """Loads and saves the machine code of a function, in the folders that numba uses.

    before_compiling: called if there is no such code, so that the function must be compiled.
    """

    def __init__(self, function: FunctionType, before_compiling: Callable[[], None]) -> None:
        self._function = function
        self._before_compiling = before_compiling

    @cached_property
    def _numba(self) -> Any:
        """Numba's cache with checked files, or None without a folder for them."""
        try:
            cache = FunctionCache(self._function)
        except (OSError, RuntimeError):
            return None
        cache._cache_file = CodeFiles(cache.cache_path, cache._impl.filename_base, self._function)
        return cache

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return the compiled function, or None."""
        loaded = None
        if self._numba is not None:
            # A file with the right digest was made by the same versions of everything, and should load. If it
            # does not, for whatever reason, the function is compiled.
            with contextlib.suppress(Exception):
                # Numba's `load_overload` first loads all that it can compile, which takes longer than the rest.
                rtsys.initialize(target)
                loaded = self._numba._load_overload(signature, target)
        if loaded is None:
            self._before_compiling()
        return loaded

    def save_overload(self, signature: Any, compiled: Any) -> None:
        """Save a compiled function."""
        if self._numba is not None:
            self._numba.save_overload(signature, compiled)


class CodeFiles:
    """The files of a function, one for each key; replaces numba's `IndexDataCacheFile`."""

    def __init__(self, folder: str, name: str, function: FunctionType) -> None:
        self._folder, self._name, self._function = Path(folder), name, function

    def load(self, key: Any) -> Any:
        """Return the data saved for a key, or None if it is missing or damaged."""
        try:
            content = self._path(key).read_bytes()
        except OSError:
            return None
        if content[:DIGEST_BYTES] != self._digest(content[DIGEST_BYTES:]):
            return None
        saved_key, data = pickle.loads(content[DIGEST_BYTES:])
        return data if saved_key == key else None

    def save(self, key: Any, data: Any) -> None:
        """Save data for a key; ignore a full disk and missing permission."""
        content = dumps((key, data))
        with contextlib.suppress(OSError, FormatError), atomic(self._path(key)) as file:
            file.write(self._digest(content) + content)

    def _path(self, key: Any) -> Path:
        digest = hashlib.blake2b(f"{key!r} {_variant()}".encode(), digest_size=12)
        return self._folder / f"{self._name}.{digest.hexdigest()}.fbc"

    def _digest(self, content: bytes) -> bytes:
        return hashlib.blake2b(content, digest_size=DIGEST_BYTES, key=self._stamp).digest()

    @cached_property
    def _stamp(self) -> bytes:
        """Digest of everything that the machine code depends on, apart from the key."""
        versions = f"{numba.__version__} {__version__} {_variant()}"
        digest = hashlib.blake2b(versions.encode(), digest_size=DIGEST_BYTES)
        for function in _called_functions(self._function):
            digest.update(_source(function.__code__.co_filename))
            for name in function.__code__.co_names:
                value = function.__globals__.get(name)
                if isinstance(value, int | float | tuple):  # constants in the code, also imported ones
                    digest.update(f"{name}={value!r}".encode())
        return digest.digest()


def _variant() -> str:
    """Return the settings of numba that change machine code but are not in numba's key.

    With `NUMBA_BOUNDSCHECK=1`, code checks the bounds of every access; code without these checks must not be
    loaded then.
    """
    return f"bounds={int(numba.config.BOUNDSCHECK or 0)} optimise={int(numba.config.OPT)}"


def _called_functions(function: FunctionType) -> Iterator[FunctionType]:
    """Yield a function and all compiled functions that it calls, directly or through others."""
    functions = [function]
    for caller in functions:
        yield caller
        for name in caller.__code__.co_names:
            called = getattr(caller.__globals__.get(name), "py_func", None)
            if called is not None and called not in functions:
                functions.append(called)


@cache
def _source(path: str) -> bytes:
    """Return a digest of a source file, or its path if it cannot be read, as in a zip archive."""
    try:
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").digest()
    except OSError:
        return os.fsencode(path)
