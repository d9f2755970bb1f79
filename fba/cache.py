"""Disk cache for slow, deterministic results."""

from __future__ import annotations

import contextlib
import hashlib
import math
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from fba.arrays import Array

Cached = TypeVar("Cached", bound=Array)

MAX_FILES = 96
"""Most files in the cache; those unused for the longest time are deleted first."""
DIGEST_BYTES = 32
"""Bytes of the digest at the start of a file, which shows whether the rest is undamaged."""


def make_key(name: str, *parts: npt.ArrayLike) -> str:
    """Return a key for `load_or_make`: the name and a digest of arrays or numbers, with dtypes and shapes."""
    digest = hashlib.sha256()
    for part in parts:
        array = np.ascontiguousarray(part)
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(array.data)
    return f"{name}-{digest.hexdigest()[:32]}"


def load_or_make(
    key: str, shapes: tuple[tuple[int, ...], ...], make: Callable[[], list[Cached]], kind: Any = np.float16
) -> list[Cached]:
    """Return the arrays that `make` returned for this key, from the disk if they are there.

    key: of letters and digits, different for different input, see `make_key`. shapes: of the arrays. kind:
    the dtype of all, or a list with the dtype of each. If the cache cannot be used (no home folder, full
    disk, damaged file) the arrays are made again, silently. Loaded arrays have the right shapes and finite
    numbers, but a file may have been tampered with: check indices before using them.
    """
    kinds = [np.dtype(each) for each in (kind if isinstance(kind, list) else [kind] * len(shapes))]
    folder = _folder()
    path = None if folder is None else folder / f"{key}.fbk"
    if path is not None:
        cached: list[Cached] | None = _read(path, shapes, kinds)
        if cached is not None:
            return cached
    made = make()
    if path is not None:
        _write(path, made)
    return made


def _folder() -> Path | None:
    """Return the folder of the cache in the user's cache folder; None if there is no home folder."""
    named = os.environ.get("FBA_CACHE") or os.environ.get("XDG_CACHE_HOME")
    try:
        if named:
            base = Path(named)
        elif sys.platform == "win32":
            base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
        elif sys.platform == "darwin":
            base = Path.home() / "Library" / "Caches"
        else:
            base = Path.home() / ".cache"
    except RuntimeError:
        return None
    return base / "fba"


def _read(
    path: Path, shapes: tuple[tuple[int, ...], ...], kinds: Sequence[np.dtype[Any]]
) -> list[Any] | None:
    """Return the arrays of a file, or None if it is missing or damaged."""
    size = DIGEST_BYTES + sum(
        kind.itemsize * math.prod(shape) for shape, kind in zip(shapes, kinds, strict=True)
    )
    try:
        if path.stat().st_size != size:
            return None
        content = path.read_bytes()
        with contextlib.suppress(OSError):  # another user's file cannot be marked as used
            os.utime(path)
    except OSError:
        return None
    if content[:DIGEST_BYTES] != _digest(content[DIGEST_BYTES:], path.stem, kinds, shapes):
        return None
    arrays, offset = [], DIGEST_BYTES
    for shape, kind in zip(shapes, kinds, strict=True):
        count = math.prod(shape)
        arrays.append(np.frombuffer(content, kind, count, offset).reshape(shape).copy())
        offset += kind.itemsize * count
        if not np.isfinite(arrays[-1]).all():
            return None
    return arrays


def _digest(
    content: bytes, key: str, kinds: Sequence[np.dtype[Any]], shapes: Sequence[tuple[int, ...]]
) -> bytes:
    """Return a digest of the content of a file: numbers, key, dtypes and shapes."""
    about = f"{key} {[kind.str for kind in kinds]} {list(shapes)} "
    return hashlib.blake2b(about.encode() + content, digest_size=DIGEST_BYTES).digest()


def _write(path: Path, arrays: list[Cached]) -> None:
    """Write arrays to a file, and delete the files unused for the longest time; ignore failures."""
    from fba.atomic import atomic
    from fba.errors import FormatError

    with contextlib.suppress(OSError, ValueError, FormatError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic(path) as file:
            content = b"".join(array.tobytes() for array in arrays)
            kinds, shapes = [array.dtype for array in arrays], [array.shape for array in arrays]
            file.write(_digest(content, path.stem, kinds, shapes) + content)
        for old in sorted(path.parent.glob("*.fbk"), key=lambda file: file.stat().st_mtime)[:-MAX_FILES]:
            old.unlink(missing_ok=True)
