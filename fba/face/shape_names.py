"""Names of shapes (morph targets, blendshapes) as programs write them, and ARKit's names for them.

"eyeBlinkLeft", "eyeBlink_L", "Left_Eye_Blink" and "blendShape1.eyeBlink_L" are one shape. Known are
ARKit's 52 names with synonyms (`arkit.csv`) and the names of the FAPs, as this project's own files use
them.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from functools import cache, lru_cache

from fba.parameters import FIRST_LOW_LEVEL_FAP, faps
from fba.text_files import packaged_rows

SIDES = {"l": "left", "r": "right", "lft": "left", "rgt": "right"}
MOST_COMMON_WORDS = 3
"""Largest number of words before all names of a file that are left out."""
FEWEST_ALIKE = 4
"""Fewer names than this never count as beginning alike."""
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")


@cache
def arkit_names() -> tuple[str, ...]:
    """Return the 52 names of ARKit's blendshapes in the order of its own and Live Link Face's data."""
    return tuple(row["shape"] for row in packaged_rows(__package__, "arkit.csv"))


def fap_of(name: str) -> int | None:
    """Return the number of the FAP that a shape is named after, 3..68, or None."""
    return _faps().get(name.strip().lower())


@lru_cache(1024)  # live captures ask for the same names with every datagram
def arkit_of(name: str) -> str | None:
    """Return ARKit's name for a shape, or None if it is not one of the 52."""
    known = _synonyms()
    return known.get(_words(name)) or known.get(_words(re.split(r"[.:|/]", name)[-1]))


def canonical_names(names: Iterable[str]) -> dict[str, str]:
    """Return ARKit's name -> the name that a file uses for it; of several ARKit's own, else the first.

    Where no name is known, words with which most begin are left out: "head_eyeBlink_L", "A14_Eye_Blink_Left".
    """
    written = list(names)
    known = {name: shape for name in written if (shape := arkit_of(name)) is not None}
    for count in range(1, MOST_COMMON_WORDS + 1):
        if known or not _begin_alike(written, count):
            break
        for name in written:
            rest = " ".join(WORD.findall(name)[count:])
            if (shape := arkit_of(rest)) is not None:
                known[name] = shape
    used: dict[str, str] = {}
    for name, shape in known.items():
        if shape not in used or _words(name) == _words(shape):
            used[shape] = name
    return used


def _begin_alike(names: Sequence[str], count: int) -> bool:
    """Return whether more than half of several names begin with the same words, as many as `count`."""
    starts = Counter(tuple(WORD.findall(name.lower())[:count]) for name in names)
    return len(names) >= FEWEST_ALIKE and 2 * max(starts.values()) > len(names)


@cache
def _synonyms() -> dict[frozenset[str], str]:
    shapes: dict[frozenset[str], str] = {}
    for row in packaged_rows(__package__, "arkit.csv"):
        for name in (row["shape"], *filter(None, row["synonyms"].split(";"))):
            shapes.setdefault(_words(name), row["shape"])
    return shapes


@cache
def _faps() -> dict[str, int]:
    return {fap.name.lower(): fap.number for fap in faps() if fap.number >= FIRST_LOW_LEVEL_FAP}


def _words(name: str) -> frozenset[str]:
    """Return the words of a name without their order: writers put the side first or last."""
    return frozenset(SIDES.get(word.lower(), word.lower()) for word in WORD.findall(name))
