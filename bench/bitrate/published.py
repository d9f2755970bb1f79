"""Published rates of others, on other data: for orientation, not measured again here."""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files
from typing import NamedTuple


class Published(NamedTuple):
    """A published rate.

    what: codec or protocol; short: its name in plots, "" where it is not drawn. kind: "face" or "body". low,
    high: kilobits a second, without packet headers. max_mm: largest error, None where unknown. conditions,
    error: in words.
    """

    what: str
    short: str
    kind: str
    low: float
    high: float
    max_mm: float | None
    conditions: str
    error: str


@cache
def published_rates() -> tuple[Published, ...]:
    """Return all published rates."""
    text = (files("bench.bitrate") / "published.csv").read_text(encoding="utf-8")
    return tuple(
        Published(
            row["what"],
            row["short"],
            row["kind"],
            float(row["low"]),
            float(row["high"]),
            float(row["max_mm"]) if row["max_mm"] else None,
            row["conditions"],
            row["error"],
        )
        for row in csv.DictReader(text.splitlines())
    )
