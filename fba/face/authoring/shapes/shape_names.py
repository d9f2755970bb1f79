"""Names of shapes (morph targets, blendshapes) as programs write them, and ARKit's names for them.

"eyeBlinkLeft", "eyeBlink_L", "Left_Eye_Blink" and "blendShape1.eyeBlink_L" are one shape. Known are
ARKit's 52 names with synonyms (`arkit.csv`) and the names of the FAPs, as this project's own files use
them.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable
from functools import cache
from importlib.resources import files

from fba.parameters import FIRST_LOW_LEVEL_FAP, faps

SIDES = {"l": "left", "r": "right", "lft": "left", "rgt": "right"}
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")


@cache
def arkit_names() -> tuple[str, ...]:
    """The 52 names of ARKit's blendshapes, sorted."""
    return tuple(row["shape"] for row in _rows())


def fap_of(name: str) -> int | None:
    """Number of the FAP that a shape is named after, 3..68, or None."""
    return _faps().get(name.strip().lower())


def arkit_of(name: str) -> str | None:
    """ARKit's name for a shape, or None where it is none of the 52."""
    known = _synonyms()
    return known.get(_words(name)) or known.get(_words(re.split(r"[.:|/]", name)[-1]))


def canonical_names(names: Iterable[str]) -> dict[str, str]:
    """ARKit's name -> the name that a file uses for it; of several ARKit's own, else the first."""
    used: dict[str, str] = {}
    for name in names:
        shape = arkit_of(name)
        if shape is not None and (shape not in used or _words(name) == _words(shape)):
            used[shape] = name
    return used


@cache
def _rows() -> tuple[dict[str, str], ...]:
    with (files(__package__) / "arkit.csv").open(encoding="utf-8") as file:
        return tuple(csv.DictReader(file))


@cache
def _synonyms() -> dict[frozenset[str], str]:
    shapes: dict[frozenset[str], str] = {}
    for row in _rows():
        for name in (row["shape"], *filter(None, row["synonyms"].split(";"))):
            shapes.setdefault(_words(name), row["shape"])
    return shapes


@cache
def _faps() -> dict[str, int]:
    return {fap.name.lower(): fap.number for fap in faps() if fap.number >= FIRST_LOW_LEVEL_FAP}


def _words(name: str) -> frozenset[str]:
    """The words of a name without their order: writers put the side first or last."""
    return frozenset(SIDES.get(word.lower(), word.lower()) for word in WORD.findall(name))
