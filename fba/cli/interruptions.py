"""Clean end on Ctrl-C, `kill` and a closed terminal, at a moment when Python can clean up.

LLVM loads compiled loops, and calls Python back meanwhile. An error in such a callback is printed ("Exception
ignored in") and lost, or leaves LLVM with half a function, and the program crashes. moderngl's C code crashes
as well if a callback fails. In such a moment, and in any other callback or finalizer, an interruption waits,
and is raised again soon.
"""

from __future__ import annotations

import _thread
import contextlib
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from types import FrameType, TracebackType
from typing import Any, Protocol

from fba.cli.startup import INTERRUPTED, leave

CHECK_AFTER = 1.0
"""Seconds after which an interruption is repeated, if an `except:` of a library swallowed it."""
RETRY_AFTER = 0.05
"""Seconds until a delayed interruption is raised again."""
FRAGILE = (
    "llvmlite.", "numba.core.caching", "numba.core.codegen", "numba.core.runtime", "moderngl", "_moderngl"
)  # fmt: skip
"""Beginnings of names of modules that must not be interrupted; their calls are short."""


class _Unraisable(Protocol):
    exc_type: type[BaseException]
    exc_value: BaseException | None
    exc_traceback: TracebackType | None
    err_msg: str | None
    object: object


_ENDING = [getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""Signals besides Ctrl-C that ask a program to end; Windows has no SIGHUP."""


_delayed: list[int] = []
"""The signal that waits until a fragile moment is over; at most one."""


def raise_delayed() -> None:
    """Raise KeyboardInterrupt if an interruption waits for the end of a fragile moment.

    To be called before a signal gets another meaning.
    """
    if _delayed:
        _delayed.clear()
        raise KeyboardInterrupt


@contextlib.contextmanager
def stopping(stop: Callable[[], None]) -> Iterator[None]:
    """Let Ctrl-C, `kill` and a closed terminal call a function; a second one interrupts as usual."""
    before: dict[int, Any] = {}

    def handle(number: int, _frame: object) -> None:
        signal.signal(number, before[number])
        stop()

    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if (
            number is not None
            and threading.current_thread() is threading.main_thread()
            and signal.getsignal(number) is not signal.SIG_IGN
        ):
            before[number] = signal.getsignal(number)
            signal.signal(number, handle)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class Interruptions:
    """Safe Ctrl-C within a `with` statement, for the main thread, which alone gets signals.

    SIGTERM and SIGHUP, unless they are ignored, interrupt as Ctrl-C does, so that no temporary file stays.
    exit_code: of an interrupted process: 128 plus the number of the signal.
    """

    def __init__(self) -> None:
        self.exit_code = INTERRUPTED
        self._lost = False
        self._raised = self._checking = self._over = False
        self._handlers: dict[int, Any] = {}

    def __enter__(self) -> Interruptions:
        _delayed.clear()
        self._hook = sys.unraisablehook
        sys.unraisablehook = self._unraisable
        with contextlib.suppress(ValueError):  # not the main thread
            if signal.getsignal(signal.SIGINT) in (signal.default_int_handler, leave):
                self._handlers[signal.SIGINT] = signal.signal(signal.SIGINT, self._interrupt)
            for number in _ENDING:
                if signal.getsignal(number) is signal.SIG_DFL:
                    self._handlers[number] = signal.signal(number, self._interrupt)
        return self

    def __exit__(self, *_: object) -> None:
        self._over = True
        sys.unraisablehook = self._hook
        for number, handler in self._handlers.items():
            signal.signal(number, handler)

    def caused(self, error: BaseException) -> bool:
        """Whether Ctrl-C caused an error, which its causes show; also if an interruption was lost."""
        return _is_interruption(error) or self._lost

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        self.exit_code = 128 + number
        while frame is not None:
            if str(frame.f_globals.get("__name__", "")).startswith(FRAGILE):
                _delay(number)
                return
            frame = frame.f_back
        _delayed.clear()
        if self._checking:
            self._checking = False
            if _is_interruption(sys.exception()):
                return  # the program is cleaning up
        if not self._raised:
            self._raised = True
            _thread.start_new_thread(self._check, (number,))
        raise KeyboardInterrupt

    def _check(self, number: int) -> None:
        """Interrupt again and again until the program ends: a library may have swallowed an interruption."""
        while True:
            time.sleep(CHECK_AFTER)
            if self._over:
                return
            self._checking = True
            _interrupt_main(number)

    def _unraisable(self, unraisable: _Unraisable) -> None:
        if not issubclass(unraisable.exc_type, KeyboardInterrupt):
            self._hook(unraisable)
            return
        self._lost = True
        _delay(self.exit_code - 128)


def _is_interruption(error: BaseException | None) -> bool:
    """Whether an error is, or was caused by, a KeyboardInterrupt."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False


def _delay(number: int) -> None:
    _delayed[:] = [number]
    _thread.start_new_thread(_interrupt_later, (number,))


def _interrupt_later(number: int) -> None:
    time.sleep(RETRY_AFTER)
    if _delayed:  # not raised meanwhile
        _interrupt_main(number)


def _interrupt_main(number: int) -> None:
    """Interrupt the main thread, where possible also while it waits."""
    if sys.platform == "win32":
        _thread.interrupt_main(signal.Signals(number))
    else:
        signal.pthread_kill(threading.main_thread().ident or 0, number)
