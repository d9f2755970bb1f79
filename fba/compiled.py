"""The one door to numba: `compiled` turns a plain function over NumPy arrays into machine code.

Where numba is missing, or `NUMBA_DISABLE_JIT=1` is set, the same source runs as Python: slower, with
the same results. Functions behind this door therefore keep to integers and floats that behave alike
in both worlds: they cast NumPy scalars with `int()` before doing arithmetic on them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from types import FunctionType
from typing import Any, TypeVar, cast

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
    return _compiled(function, forceinline=True)


def _compiled(function: Function, **options: bool) -> Function:
    if njit is None:
        return function
    # Nobody calls these through C: numba's wrapper for that took a quarter of the time to compile.
    dispatcher: Any = njit(nogil=True, error_model="numpy", no_cfunc_wrapper=True, **options)(function)
    if not config.DISABLE_JIT:
        from fba._numba_cache import MachineCode

        dispatcher._cache = MachineCode(cast(FunctionType, function))
        dispatcher.get_call_template = partial(_call_by_type, dispatcher)
    result: Function = dispatcher
    return result


def _call_by_type(dispatcher: Any, arguments: Any, named: Any) -> Any:
    """How another compiled function calls this one: by the types of the arguments alone.

    Numba would compile it once more for each constant that is passed to it.
    """
    from numba.types import unliteral

    plain = [unliteral(one) for one in arguments]
    return type(dispatcher).get_call_template(
        dispatcher, plain, {key: unliteral(one) for key, one in named.items()}
    )


def is_compiled() -> bool:
    """Whether the hot loops run as machine code in this process."""
    return njit is not None and not config.DISABLE_JIT
