"""Setup of the `fba` command before its imports: Ctrl-C without a traceback, fewer garbage collections.

It imports little, as Ctrl-C is not handled before this module is loaded.
"""

from __future__ import annotations

import atexit
import gc
import os
import signal

INTERRUPTED = 130
"""Exit code of a process that Ctrl-C ended, as shells have it."""
TEXT = "fba: interrupted"


def leave_on_interrupt() -> None:
    """Let Ctrl-C end this process at once, without a traceback; to be called in the main thread.

    For the imports before a command and the shutdown after it, when there is nothing to clean up;
    `Interruptions` handles Ctrl-C in between. A process that was started to ignore Ctrl-C still ignores it.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, leave)


def leave(_number: int, _frame: object) -> None:
    """End the process at once with a line on standard error: a signal handler."""
    os.write(2, f"{TEXT}\n".encode())  # sys.stderr may be in use
    os._exit(INTERRUPTED)


def collect_less() -> None:
    """Let the garbage collector run less often in this process, which runs one command.

    Python's threshold of 700 objects costs a third of a second while numba is imported, one of 100,000 a 15th
    of the time to compile, and the search of all objects at the end is useless.
    """
    gc.set_threshold(300_000)
    atexit.register(gc.freeze)
