"""What commands print: JSON, times, frame rates, and progress bars."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import click

LONGEST_ROW = 1 << 16
"""Characters of a row: names of files are shorter."""


def print_json(value: object) -> None:
    """Print a report for programs."""
    click.echo(json.dumps(value, indent=2))


def seconds_text(value: Fraction | float) -> str:
    """Return "12.34 s"."""
    return f"{float(value):.2f} s"


def clock_text(seconds: float) -> str:
    """Return a time of day in seconds as "18:48:59.66"."""
    minutes, rest = divmod(round(seconds % 86_400, 2), 60)
    return f"{int(minutes) // 60 % 24:02}:{int(minutes) % 60:02}:{rest:05.2f}"


def rate_text(rate: Fraction) -> str:
    """Return a frame rate as "25", "30.5", or "29.97" for 30000/1001."""
    return f"{float(rate):.3f}".rstrip("0").rstrip(".")


def colour_grade(text: str, grade: str) -> str:
    """Return text in the colour of a grade, where colours are wanted; `click.echo` drops it for files.

    grade: "good", "fair" or "poor".
    """
    if os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return text
    return click.style(text, fg={"good": "green", "fair": "yellow", "poor": "red"}[grade])


def print_table(columns: Sequence[str], rows: Sequence[Sequence[str]], first: str = "file") -> None:
    """Print rows of a file and cells, under the names of the columns behind that of the file.

    first: what the first column has, if it is no file.
    """
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False)
    table.add_column(first, overflow="fold")
    for column in columns:
        table.add_column(column, justify="right")
    for row in rows:
        table.add_row(*row)
    wide = Console(width=LONGEST_ROW)
    # On a terminal, long names are folded; a program that reads it finds every row on one line.
    console = Console(width=None if wide.is_terminal else max(160, wide.measure(table).maximum))
    with console.capture() as text:  # rich, as it prints, would exit with 1 where a pipe is closed
        console.print(table)
    click.echo(text.get(), nl=False)


class Progress:
    """A progress bar on standard error, if that is a terminal; for a `with` statement.

    total: number of steps. While it is None, the bar only moves, and shows the seconds so far.
    """

    def __init__(self, label: str, total: int | None) -> None:
        self._label, self._total = label, total
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> Progress:
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import (
                BarColumn,
                MofNCompleteColumn,
                Task,
                TextColumn,
                TimeElapsedColumn,
                TimeRemainingColumn,
            )
            from rich.progress import Progress as Bar
            from rich.text import Text

            class Steps(MofNCompleteColumn):
                def render(self, task: Task) -> Text:
                    return Text() if task.total is None else super().render(task)  # not "0/?"

            class Time(TimeRemainingColumn):
                def render(self, task: Task) -> Text:
                    return TimeElapsedColumn().render(task) if task.total is None else super().render(task)

            columns = (
                TextColumn("{task.description}"),
                BarColumn(),
                Steps(),
                Time(),
            )
            self._bar = Bar(*columns, console=Console(stderr=True), transient=True)
            self._bar.start()
            self._task = self._bar.add_task(self._label, total=self._total)
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def advance(self, count: int = 1) -> None:
        """Show that more steps are done."""
        if self._bar is not None:
            self._bar.update(self._task, advance=count)

    def show(self, done: int, total: int) -> None:
        """Show the number of steps done, and the total."""
        if self._bar is not None:
            self._bar.update(self._task, completed=done, total=total)
