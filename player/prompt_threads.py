"""Threads that must not wait long for their turn."""

from __future__ import annotations

import contextlib
import sys
import threading
from collections.abc import Iterator

TURN = 0.0005
"""Seconds after which a thread that works hands over to one that waits: a tenth of Python's own choice."""

_lock = threading.Lock()
_users = 0
_before = 0.0


@contextlib.contextmanager
def prompt_threads() -> Iterator[None]:
    """While it lasts, in any thread, Python's threads take turns more often.

    One that encodes asks for its turn four times a picture: at 5 ms each, it would be slower than the
    drawing, with a processor idle.
    """
    global _users, _before  # noqa: PLW0603 - as process-wide as what it sets
    with _lock:
        if not _users:
            _before = sys.getswitchinterval()
            sys.setswitchinterval(min(TURN, _before))
        _users += 1
    try:
        yield
    finally:
        with _lock:
            _users -= 1
            if not _users:
                sys.setswitchinterval(_before)
