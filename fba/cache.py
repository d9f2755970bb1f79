"""What takes long to work out and depends on its input alone, kept on disk for the next time."""

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

Kept = TypeVar("Kept", bound=Array)

MOST_FILES = 96
"""So many are kept; the longest unused goes first."""
DIGEST = 32
"""Bytes at the start of a file that tell whether the rest is as it was written."""


def key_of(name: str, *parts: npt.ArrayLike) -> str:
    """A key for `kept`: the name, and a digest of these arrays and numbers, their kinds and shapes."""
    digest = hashlib.sha256()
    for part in parts:
        array = np.ascontiguousarray(part)
        digest.update(f"{array.dtype.str}{array.shape}".encode())
        digest.update(array.data)
    return f"{name}-{digest.hexdigest()[:32]}"


def kept(
    key: str, shapes: tuple[tuple[int, ...], ...], make: Callable[[], list[Kept]], kind: Any = np.float16
) -> list[Kept]:
    """The arrays of `shapes` that `make` gave for this key, now or some time before.

    key: names everything that they depend on; letters and digits. kind: the dtype of all, or a list with that
    of each. Where nothing can be kept (no home, no room, a file that somebody damaged) they are made anew,
    silently. What is found may have been tampered with: numbers of rows are to be checked.
    """
    kinds = [np.dtype(one) for one in (kind if isinstance(kind, list) else [kind] * len(shapes))]
    folder = _folder()
    path = None if folder is None else folder / f"{key}.fbk"
    if path is not None:
        found: list[Kept] | None = _read(path, shapes, kinds)
        if found is not None:
            return found
    made = make()
    if path is not None:
        _write(path, made)
    return made


def _folder() -> Path | None:
    """The user's folder for what may be thrown away."""
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
    size = DIGEST + sum(kind.itemsize * math.prod(shape) for shape, kind in zip(shapes, kinds, strict=True))
    try:
        if path.stat().st_size != size:
            return None
        content = path.read_bytes()
        with contextlib.suppress(
            OSError
        ):  # the longest unused goes first: somebody else's file stays as it is
            os.utime(path)
    except OSError:
        return None
    if content[:DIGEST] != _digest(content[DIGEST:], path.stem, kinds, shapes):
        return None
    found, place = [], DIGEST
    for shape, kind in zip(shapes, kinds, strict=True):
        count = math.prod(shape)
        found.append(np.frombuffer(content, kind, count, place).reshape(shape).copy())
        place += kind.itemsize * count
        if not np.isfinite(found[-1]).all():
            return None
    return found


def _digest(
    content: bytes, key: str, kinds: Sequence[np.dtype[Any]], shapes: Sequence[tuple[int, ...]]
) -> bytes:
    """Of the numbers of all arrays, and of what they are."""
    about = f"{key} {[kind.str for kind in kinds]} {list(shapes)} "
    return hashlib.blake2b(about.encode() + content, digest_size=DIGEST).digest()


def _write(path: Path, arrays: list[Kept]) -> None:
    from fba.atomic import atomic
    from fba.errors import FormatError

    with contextlib.suppress(OSError, ValueError, FormatError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic(path) as file:
            content = b"".join(array.tobytes() for array in arrays)
            kinds, shapes = [array.dtype for array in arrays], [array.shape for array in arrays]
            file.write(_digest(content, path.stem, kinds, shapes) + content)
        for old in sorted(path.parent.glob("*.fbk"), key=lambda one: one.stat().st_mtime)[:-MOST_FILES]:
            old.unlink(missing_ok=True)
