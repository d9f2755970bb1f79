"""The main results in a few rows of Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from bench.bitrate.choices import Comparison, best_within, compare, group_results
from bench.bitrate.results import Result
from bench.bitrate.subjects import BODY, FACE
from bench.bitrate.tables import error_text, rate_text

HEADER = ("what", "error", "FBA live", "smallest other, live", "FBA file", "smallest other, file")
LIMITS = {FACE: 0.5, BODY: 10.0}
"""Millimetres of error of the second row of a kind."""


def summary_lines(results: Sequence[Result]) -> list[str]:
    """Return a table of the streams without loss and with a small one, of faces and bodies."""
    lines = [f"| {' | '.join(HEADER)} |", "|---|---|---|---|---|---|"]
    for group in group_results(results):
        if compared := compare(group):
            rows = dict.fromkeys((compared[0], best_within(group, LIMITS[group[0].kind])))
            lines += [f"| {' | '.join(_row(one))} |" for one in rows]
    return lines


def subjects_text(one: Result) -> str:
    """Return "24 faces, 177 s"."""
    names = {FACE: ("face", "faces"), BODY: ("body", "bodies")}[one.kind]
    return f"{one.subjects} {names[one.subjects != 1]}, {one.seconds:.0f} s"


def _row(one: Comparison) -> list[str]:
    own = one.own
    error = "none" if own.max_mm == 0 else f"at most {error_text(own.max_mm)} mm"
    return [
        f"{own.data}: {subjects_text(own)}", error, f"{rate_text(own.live_rate)} kbit/s",
        f"{rate_text(one.live.live_rate)} ({one.live.method})", f"{rate_text(own.file_rate)} kbit/s",
        f"{rate_text(one.file.file_rate)} ({one.file.method})",
    ]  # fmt: skip
