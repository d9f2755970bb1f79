"""Programs that a test starts and that end with it, whatever happens."""

import subprocess
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any


@contextmanager
def started(
    command: Sequence[str], *, seconds: float = 300.0, **options: Any
) -> Iterator[subprocess.Popen[str]]:
    """Start a program for a `with` statement, which kills it at its end, or after so many seconds.

    Whoever reads its output without a limit then sees the end of it instead of waiting for ever. options:
    those of `subprocess.Popen`; standard error is a pipe of text.
    """
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, **options) as program:
        guard = threading.Timer(seconds, program.kill)
        guard.daemon = True
        guard.start()
        try:
            yield program
        finally:
            guard.cancel()
            program.kill()
