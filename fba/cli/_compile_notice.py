"""Says, once, why a command takes longer the first time."""

from __future__ import annotations

import click

MANY = 5
"""So many functions that are to be compiled are worth a word: fewer take less than about two seconds."""
SECONDS = {"info": 8, "stats": 5, "decode": 5, "bench": 8, "encode": 13, "convert": 13}
"""About how long everything that a command may need takes to compile, in seconds of one core."""
OTHERWISE = 35


class Notice:
    """Writes one line to standard error when a command is about to compile for seconds."""

    def __init__(self, command: str) -> None:
        self._seconds = SECONDS.get(command, OTHERWISE)
        self._functions = 0

    def __call__(self) -> None:
        """A function is about to be compiled."""
        self._functions += 1
        if self._functions == MANY:
            click.echo(f"fba: compiling, once (up to about {self._seconds} s)", err=True)
