"""The one door to numba: `compiled` turns a plain function over NumPy arrays into machine code.

Where numba is missing, or `NUMBA_DISABLE_JIT=1` is set, the same source runs as Python: slower, with
the same results. Functions behind this door therefore keep to integers and floats that behave alike
in both worlds: they cast NumPy scalars with `int()` before doing arithmetic on them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

try:
    from numba import config, njit
except ImportError:  # the codec runs anywhere Python and NumPy run
    config = njit = None

Function = TypeVar("Function", bound=Callable[..., Any])


def compiled(function: Function) -> Function:
    """Compile on first call, cache the machine code on disk, release the GIL while running."""
    return _compiled(function)


def inlined(function: Function) -> Function:
    """Like `compiled`, for small helpers that only compiled functions call."""
    return _compiled(function, inline="always")


def _compiled(function: Function, **options: str) -> Function:
    if njit is None:
        return function
    result: Function
    try:
        result = njit(cache=True, nogil=True, error_model="numpy", **options)(function)
    except RuntimeError:  # no folder to keep machine code in: neither beside the source nor in a home
        result = njit(nogil=True, error_model="numpy", **options)(function)
    return result


def is_compiled() -> bool:
    """Whether the hot loops run as machine code in this process."""
    return njit is not None and not config.DISABLE_JIT
