"""Output of commands: JSON, times, frame rates, tables, and progress bars."""

from __future__ import annotations

import json
import os
import shutil
import sys
import textwrap
import time
from collections.abc import Collection, Sequence
from datetime import timedelta
from fractions import Fraction
from itertools import zip_longest
from threading import Event, Thread
from typing import TextIO

import click

MIN_WIDTH = 12
"""Characters of a column below which it is not folded."""
BAR_WIDTH = 30
"""Characters of a progress bar."""
BAR_PERIOD = 0.1
"""Seconds after which a progress bar is drawn again."""


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
    """Return text in the colour of a grade, "good", "fair" or "poor", unless the environment forbids colours.

    `click.echo` removes colours from files.
    """
    if os.environ.get("NO_COLOR") or os.environ.get("TERM") == "dumb":
        return text
    return click.style(text, fg={"good": "green", "fair": "yellow", "poor": "red"}[grade])


def print_table(columns: Sequence[str], rows: Sequence[Sequence[str]], first: str = "file") -> None:
    """Print rows of a file and its cells. columns: names of the cells. first: name of the first column.

    On a terminal, long names are folded; for a program, every row is on one line.
    """
    width = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    click.echo(
        "\n".join(table_lines([first, *columns], rows, to_right=range(1, 1 + len(columns)), width=width))
    )


def table_lines(
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    to_right: Collection[int] = (),
    width: int | None = None,
    gap: int = 2,
) -> list[str]:
    """Return the lines of a table, its columns `gap` spaces apart.

    to_right: numbers of the columns, from 0, whose cells are aligned right. width: most characters of a line;
    cells are folded to keep it, those of the widest columns first.
    """
    table = [head, *rows]
    sizes = [max(map(len, column)) for column in zip(*table, strict=True)]
    while width is not None and sum(sizes) + gap * (len(sizes) - 1) > width and max(sizes) > MIN_WIDTH:
        sizes[sizes.index(max(sizes))] -= 1
    lines = []
    for row in table:
        cells = [textwrap.wrap(cell, size) or [""] for cell, size in zip(row, sizes, strict=True)]
        for parts in zip_longest(*cells, fillvalue=""):
            padded = [
                part.rjust(size) if column in to_right else part.ljust(size)
                for column, (part, size) in enumerate(zip(parts, sizes, strict=True))
            ]
            lines.append((" " * gap).join(padded).rstrip())
    return lines


class Progress:
    """A progress bar on standard error, if that is a terminal; for a `with` statement.

    total: number of steps. While it is None, only the seconds so far are shown. unit: of the steps, "files";
    then their number in a second is shown, too.
    """

    def __init__(self, label: str, total: int | None, unit: str = "") -> None:
        self._label, self._total, self._done, self._unit = label, total, 0, unit
        self._over = Event()
        self._drawing: Thread | None = None

    def __enter__(self) -> Progress:
        if sys.stderr.isatty():
            self._drawing = Thread(target=self._draw, args=(sys.stderr, time.monotonic()), daemon=True)
            self._drawing.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._drawing is not None:
            self._over.set()
            self._drawing.join()

    def advance(self, count: int = 1) -> None:
        """Show that more steps are done."""
        self._done += count

    def show(self, done: int, total: int | None) -> None:
        """Show the number of steps done, and the total."""
        self._done, self._total = done, total

    def _draw(self, terminal: TextIO, begun: float) -> None:
        """Draw the bar again and again, and remove it at the end.

        The cursor stays at the beginning of the line, so that messages are written over the bar.
        """
        blank = " " * (shutil.get_terminal_size().columns - 1)
        while True:
            terminal.write(f"{self._line(time.monotonic() - begun)}{blank}"[: len(blank)] + "\r")
            terminal.flush()
            if self._over.wait(BAR_PERIOD):
                break
        terminal.write(blank + "\r")
        terminal.flush()

    def _line(self, seconds: float) -> str:
        done, total = self._done, self._total
        if total is None:
            return f"{self._label}  {timedelta(seconds=int(seconds))}"
        share = min(done / max(total, 1), 1.0)
        left = f"  {timedelta(seconds=round(seconds / share - seconds))} left" if share else ""
        rate = f"  {done / seconds:.3g} {self._unit}/s" if self._unit and seconds else ""
        return f"{self._label}  [{'#' * round(share * BAR_WIDTH):<{BAR_WIDTH}}]  {done}/{total}{rate}{left}"
