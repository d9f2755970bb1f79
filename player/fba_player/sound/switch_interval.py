"""Threads that must not wait long for their turn."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable

TURN = 0.0005
"""Seconds after which a thread that works hands over to one that waits: a tenth of Python's own choice."""


class PromptThreads:
    """While it is entered, once or several times, from any thread, Python's threads take turns more often.

    A thread that encodes asks for its turn four times a picture: at 5 ms each it would be slower than the
    drawing, with a processor idle. read, change: the seconds of a turn, which are the whole process's.
    """

    def __init__(
        self,
        read: Callable[[], float] = sys.getswitchinterval,
        change: Callable[[float], None] = sys.setswitchinterval,
    ) -> None:
        self._read, self._change = read, change
        self._lock = threading.Lock()
        self._users = 0
        self._before = 0.0

    def __enter__(self) -> PromptThreads:
        with self._lock:
            if not self._users:
                self._before = self._read()
                self._change(min(TURN, self._before))
            self._users += 1
        return self

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._users -= 1
            if not self._users:
                self._change(self._before)


PROMPT_THREADS = PromptThreads()
"""The process's own."""
