"""Delay Ctrl-C at moments when Python cannot handle it.

Compiled loops are loaded by LLVM, which calls Python back while it does so. An error raised in there is
printed ("Exception ignored in") and lost, or leaves LLVM with half a function: the program then crashes.
moderngl's C code crashes, too, where what it calls back fails. In such a moment, and in any other callback or
finalizer, an interruption waits, and is raised again soon.
"""

from __future__ import annotations

import _thread
import contextlib
import signal
import sys
import time
from types import FrameType, TracebackType
from typing import Any, Protocol

from fba.cli.startup import leave

RETRY_AFTER = 0.05
"""Seconds until a delayed interruption comes again."""
FRAGILE = (
    "llvmlite.",
    "numba.core.caching",
    "numba.core.codegen",
    "numba.core.runtime",
    "moderngl",
    "_moderngl",
)
"""Beginnings of names of modules that must not be interrupted; none of their calls takes long."""


class _Unraisable(Protocol):
    exc_type: type[BaseException]
    exc_value: BaseException | None
    exc_traceback: TracebackType | None
    err_msg: str | None
    object: object


class Interruptions:
    """Makes Ctrl-C safe while the `with` statement lasts; for the main thread, which alone gets signals."""

    def __init__(self) -> None:
        self._lost = False
        self._handler: Any = None

    def __enter__(self) -> Interruptions:
        self._hook = sys.unraisablehook
        sys.unraisablehook = self._unraisable
        if signal.getsignal(signal.SIGINT) in (signal.default_int_handler, leave):
            with contextlib.suppress(ValueError):  # not the main thread
                self._handler = signal.signal(signal.SIGINT, self._interrupt)
        return self

    def __exit__(self, *_: object) -> None:
        sys.unraisablehook = self._hook
        if self._handler is not None:
            signal.signal(signal.SIGINT, self._handler)

    def caused(self, error: BaseException) -> bool:
        """Whether Ctrl-C caused an error: by the error's own causes, or because an interruption was lost."""
        cause: BaseException | None = error
        while cause is not None:
            if isinstance(cause, KeyboardInterrupt):
                return True
            cause = cause.__cause__ or cause.__context__
        return self._lost

    def _interrupt(self, _number: int, frame: FrameType | None) -> None:
        while frame is not None:
            if str(frame.f_globals.get("__name__", "")).startswith(FRAGILE):
                _thread.start_new_thread(_interrupt_later, ())
                return
            frame = frame.f_back
        raise KeyboardInterrupt

    def _unraisable(self, unraisable: _Unraisable) -> None:
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            self._hook(unraisable)
            return
        self._lost = True
        _thread.start_new_thread(_interrupt_later, ())


def _interrupt_later() -> None:
    time.sleep(RETRY_AFTER)
    _thread.interrupt_main()
