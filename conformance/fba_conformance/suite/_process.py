"""Run the program under test, with limits on its time and output."""

from __future__ import annotations

import contextlib
import os
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import IO

OUTPUT_LIMIT = 64 << 20
"""Bytes of output at which a program is stopped; the longest listing of the suite has 0.3 million."""
_POLL = 0.02
"""Seconds between two checks of the size of the output."""
_TAIL = 4096
"""Bytes of standard error that are kept."""
_SHOWN = 200
"""Characters of it that a message shows."""


@dataclass(frozen=True)
class Run:
    """How a program ended.

    exit_status: negative for the signal that killed it, None if it was stopped. stopped: why, "" if it was
    not. said: the last line that it wrote to standard error.
    """

    exit_status: int | None
    stopped: str = ""
    said: str = ""

    @property
    def crash(self) -> str:
        """How it crashed or why it was stopped; "" if it ended by itself."""
        if self.stopped:
            return self.stopped
        assert self.exit_status is not None
        if self.exit_status >= 0:
            return ""
        name = str(-self.exit_status)
        with contextlib.suppress(ValueError):
            name = signal.Signals(-self.exit_status).name
        return f"crashed (signal {name})"

    @property
    def failure(self) -> str:
        """How it crashed, or its exit status and what it said; "" for exit status 0."""
        text = self.crash or (f"ended with exit status {self.exit_status}" if self.exit_status else "")
        return f"{text}: {self.said}" if text and self.said else text


def split_command(command: str) -> list[str]:
    """Return the words of a command line. Raises ValueError for open quotes and for no word at all."""
    words = shlex.split(command, posix=sys.platform != "win32")
    if not words:
        raise ValueError("the command is empty")
    return words


def fill_in(words: list[str], values: Mapping[str, str]) -> list[str]:
    """Return words with values in place of "{name}"."""
    filled = []
    for word in words:
        for name, value in values.items():
            word = word.replace(f"{{{name}}}", value)  # noqa: PLW2901
        filled.append(word)
    return filled


def run_program(words: list[str], output: Path, seconds: float) -> Run:
    """Run a program; stop it, and all that it started, when its time is over.

    output: a file that it writes; if that grows beyond `OUTPUT_LIMIT`, the program is stopped, too. Its
    standard output is thrown away. Raises OSError if it cannot be started.
    """
    process = subprocess.Popen(
        words,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=os.name == "posix",
    )
    assert process.stderr is not None
    tail = bytearray()
    reader = threading.Thread(target=_keep_tail, args=(process.stderr, tail), daemon=True)
    reader.start()
    stopped = ""
    try:
        stopped = _wait(process, output, seconds)
    finally:
        _stop(process)
        reader.join(1)  # takes longer only if something that it started has left its session
    return Run(None if stopped else process.returncode, stopped, _last_line(bytes(tail)))


def _wait(process: subprocess.Popen[bytes], output: Path, seconds: float) -> str:
    """Wait for a program; return why it must be stopped, "" if it has ended."""
    end = time.monotonic() + seconds
    while True:
        try:
            process.wait(min(_POLL, max(end - time.monotonic(), 0)))
        except subprocess.TimeoutExpired:
            pass
        else:
            return ""
        if time.monotonic() >= end:
            return f"took longer than {seconds:g} s and was stopped"
        with contextlib.suppress(OSError):
            if output.stat().st_size > OUTPUT_LIMIT:
                return f"wrote more than {OUTPUT_LIMIT >> 20} MB and was stopped"


def _stop(process: subprocess.Popen[bytes]) -> None:
    """End a program, if it still runs, and what it started."""
    if os.name == "posix":
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process.pid, signal.SIGKILL)
    elif process.poll() is None:
        process.kill()
    process.wait()


def _keep_tail(source: IO[bytes], tail: bytearray) -> None:
    """Read until the end, and keep the last bytes."""
    with contextlib.suppress(OSError, ValueError):
        while chunk := os.read(source.fileno(), _TAIL):
            tail += chunk
            del tail[:-_TAIL]
        source.close()


def _last_line(said: bytes) -> str:
    """Return the last line of text that is not empty."""
    lines = [line.strip() for line in said.decode("utf-8", "replace").splitlines() if line.strip()]
    return lines[-1][:_SHOWN] if lines else ""
