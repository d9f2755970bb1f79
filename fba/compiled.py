"""Compile plain functions over NumPy arrays to machine code, with numba.

If numba is missing, or `NUMBA_DISABLE_JIT=1` is set, the same source runs as Python: slower, with the same
results. Compiled functions therefore cast NumPy scalars with `int()` before they do arithmetic
on them: NumPy's integers overflow differently in Python.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial
from types import FunctionType
from typing import Any, TypeVar, cast

Function = TypeVar("Function", bound=Callable[..., Any])

_listeners: list[Callable[[], None]] = []


@cache
def _numba() -> Any:
    """Return the package numba, imported for the first compiled function; None if it is missing.

    `fba --help` imports this module and compiles nothing: importing numba would double its time.
    """
    try:
        import numba
    except ImportError:  # the codec runs wherever Python and NumPy run
        return None
    return numba if hasattr(numba, "njit") else None  # the folder of an uninstalled numba may still be there


def compiled(function: Function) -> Function:
    """Compile on first call, cache the machine code on disk, release the GIL while running."""
    return _compiled(function)


def inlined(function: Function) -> Function:
    """Like `compiled`, for small helpers that only compiled functions call: Python cannot."""
    return _compiled(function, forceinline=True, no_cpython_wrapper=True)


def _compiled(function: Function, **options: bool) -> Function:
    numba = _numba()
    if numba is None:
        return function
    # No C code calls these functions: numba's wrapper for C took a quarter of the time to compile.
    dispatcher: Any = numba.njit(nogil=True, error_model="numpy", no_cfunc_wrapper=True, **options)(function)
    if not numba.config.DISABLE_JIT:
        from fba._numba_cache import MachineCode

        dispatcher._cache = MachineCode(cast(FunctionType, function), announce_compilation)
        dispatcher.get_call_template = partial(_call_by_type, dispatcher)
    result: Function = dispatcher
    return result


def _call_by_type(dispatcher: Any, arguments: Any, named: Any) -> Any:
    """Return the template by which compiled functions call this function, chosen by argument types alone.

    Otherwise numba would compile it again for each constant that is passed to it.
    """
    from numba.types import unliteral

    plain = [unliteral(argument) for argument in arguments]
    named = {key: unliteral(argument) for key, argument in named.items()}
    return type(dispatcher).get_call_template(dispatcher, plain, named)


def is_compiled() -> bool:
    """Return whether the hot loops run as machine code in this process."""
    numba = _numba()
    return numba is not None and not numba.config.DISABLE_JIT


@contextmanager
def compilation_listener(listener: Callable[[], None] | None) -> Iterator[None]:
    """Call the listener, unless it is None, before each function that is compiled while the block runs."""
    if listener is None:
        yield
        return
    _listeners.append(listener)
    try:
        yield
    finally:
        _listeners.remove(listener)


def announce_compilation() -> None:
    """Call every listener: a function is about to be compiled, which takes seconds the first time."""
    for listener in tuple(_listeners):
        listener()
