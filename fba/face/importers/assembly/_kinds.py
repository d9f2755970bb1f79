"""Guesses the kind of a part from its names: "EyeLeft_Mat" is an eye, "Wolf3D_Teeth" teeth."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping
from functools import cache
from importlib.resources import files

from fba.errors import OptionError
from fba.face.model import PART_KINDS

DROPPED = "none"
"""Kind of parts that are left out: transparent shells before the eye, which would hide it."""


@cache
def _words() -> tuple[tuple[str, str], ...]:
    with (files(__package__) / "kinds.csv").open(encoding="utf-8") as file:
        return tuple((row["word"], row["kind"]) for row in csv.DictReader(file))


def kind_of(*names: str) -> str | None:
    """The kind of a part by its names, the most specific first; None where no name is known.

    The first word of `kinds.csv` that is in a name decides; "ear" and "hat" must be words of their own,
    as they are inside "pearl" and "that".
    """
    for name in names:
        parts = {part.lower() for part in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)}
        plain = re.sub(r"[^a-z]", "", name.lower())
        for word, kind in _words():
            if word in parts or word + "s" in parts or (len(word) > 4 and word in plain):
                return kind
    return None


def checked_kinds(kinds: Mapping[str, str] | None) -> dict[str, str]:
    """The kinds that a user gave by name; OptionError for one that does not exist."""
    for name, kind in (kinds or {}).items():
        if kind not in PART_KINDS and kind != DROPPED:
            raise OptionError(f"kind of {name!r}: {kind!r} is none of {', '.join((*PART_KINDS, DROPPED))}")
    return dict(kinds or {})
