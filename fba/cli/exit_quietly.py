"""Ctrl-C before the command line is imported, and after it is done: an end without a traceback.

Imports next to nothing, since what is imported first is not yet protected.
"""

from __future__ import annotations

import os
import signal

INTERRUPTED = 130
"""Exit code of what Ctrl-C ended, as a shell has it."""
TEXT = "fba: interrupted"


def leave_on_interrupt() -> None:
    """From now on, Ctrl-C ends this process at once, wherever it is; call it in the main thread.

    For the times when nothing is to be cleared up; `Interruptions` takes over in between. A process that was
    started to ignore Ctrl-C goes on ignoring it.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, leave)


def leave(_number: int, _frame: object) -> None:
    """A signal handler: says that it was interrupted, and ends the process without any clearing up."""
    os.write(2, f"{TEXT}\n".encode())  # sys.stderr may be in use
    os._exit(INTERRUPTED)
