"""Mistakes that a decoder may have: each as a change of the independent decoder's source."""

from __future__ import annotations

import tomllib
from functools import cache
from pathlib import Path
from typing import NamedTuple


class Mistake(NamedTuple):
    """A mistake: what a decoder with it does, and the text in a module that becomes another text.

    found_by: a vector that must find it; `fba_conformance.suite.broken` lists all that do.
    """

    name: str
    does: str
    found_by: str
    module: str
    old: str
    new: str


@cache
def mistakes() -> tuple[Mistake, ...]:
    """Return all mistakes, from mistakes.toml."""
    text = Path(__file__).with_name("mistakes.toml").read_text(encoding="utf-8")
    return tuple(Mistake(**row) for row in tomllib.loads(text)["mistake"])
