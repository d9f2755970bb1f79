"""Published rates of others, on data of their own: anchors, which nobody here has measured again."""

from __future__ import annotations

import csv
from functools import cache
from importlib.resources import files
from typing import NamedTuple


class Published(NamedTuple):
    """A published rate.

    what: codec or protocol. kind: "face" or "body". low, high: kilobits a second. conditions, error: words.
    """

    what: str
    kind: str
    low: float
    high: float
    conditions: str
    error: str


@cache
def published_rates() -> tuple[Published, ...]:
    """Return all published rates."""
    text = (files("fba.study") / "published.csv").read_text(encoding="utf-8")
    return tuple(
        Published(
            row["what"], row["kind"], float(row["low"]), float(row["high"]), row["conditions"], row["error"]
        )
        for row in csv.DictReader(text.splitlines())
    )
