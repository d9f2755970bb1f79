"""Ctrl-C that Python raises where nothing can be raised: inside a callback of C code, or a finalizer.

There, Python prints "Exception ignored in" and goes on. While compiled loops are being loaded that is
likely (a tenth of a second in each two), so such an interruption is kept and comes again.
"""

from __future__ import annotations

import _thread
import sys
import time
from types import TracebackType
from typing import Protocol

AGAIN_AFTER = 0.05
"""Seconds until it comes again: by then the callback has returned."""


class _Unraisable(Protocol):
    exc_type: type[BaseException]
    exc_value: BaseException | None
    exc_traceback: TracebackType | None
    err_msg: str | None
    object: object


class KeptInterruptions:
    """While it lasts, no Ctrl-C is lost."""

    def __init__(self) -> None:
        self._lost = False

    def __enter__(self) -> KeptInterruptions:
        self._before = sys.unraisablehook
        sys.unraisablehook = self._unraisable
        return self

    def __exit__(self, *_: object) -> None:
        sys.unraisablehook = self._before

    def made(self, error: BaseException) -> bool:
        """Whether it is for an interruption that there is this error: by its causes, or by what was lost."""
        cause: BaseException | None = error
        while cause is not None:
            if isinstance(cause, KeyboardInterrupt):
                return True
            cause = cause.__cause__ or cause.__context__
        return self._lost

    def _unraisable(self, unraisable: _Unraisable) -> None:
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            self._before(unraisable)
            return
        self._lost = True
        _thread.start_new_thread(_again, ())


def _again() -> None:
    time.sleep(AGAIN_AFTER)
    _thread.interrupt_main()
