"""Words in the names of joints: which part of the body they name, and which side; see bone_words.csv."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache

from fba.text_files import packaged_rows

MAX_NAME_LENGTH = 200
"""Largest number of characters of a name that are read, from its end."""
JOINED_WORDS = {
    ("upper", "arm"): "upperarm",
    ("upper", "leg"): "thigh",
    ("lower", "arm"): "forearm",
    ("fore", "arm"): "forearm",
    ("lower", "leg"): "shank",
    ("collar", "bone"): "collar",
    ("fore", "foot"): "toe",
    ("shoulder", "blade"): "clavicle",
    ("toe", "base"): "toe",
    ("up", "arm"): "upperarm",
    ("up", "leg"): "thigh",
    ("low", "arm"): "forearm",
    ("low", "leg"): "shank",
}
"""Pairs of words that mean the same as a single word."""


@dataclass(frozen=True)
class Meaning:
    """What a name says.

    side: "l", "r" or "". parts: part -> 2 if named for certain, 1 if perhaps. numbers: the name's numbers, in
    order. helper: whether it names something that is no bone of a body, such as a twist bone, an end or an
    eye. unknown: count of letters that no word explains.
    """

    side: str
    parts: dict[str, int]
    numbers: tuple[int, ...]
    helper: bool
    unknown: int


@cache
def _words() -> dict[str, tuple[str, ...]]:
    """Return word -> what it means."""
    return {row["word"]: tuple(row["means"].split()) for row in packaged_rows(__package__, "bone_words.csv")}


def read(name: str) -> Meaning:
    """Return the meaning of a name: "mixamorig:LeftUpLeg", "thigh_l", "rshldr", "Bip01 R Calf"."""
    plain = re.split(r"[:|]", name[-MAX_NAME_LENGTH:])[-1]
    pieces = re.findall(r"[A-Z]+(?![a-zß-ÿ])|[A-Z]?[a-zß-ÿ]+|[0-9]+|[^\W\d_A-Za-zß-ÿ]+", plain)
    words: list[str] = []
    numbers: list[int] = []
    unknown = 0
    for piece in pieces:
        if piece.isascii() and piece.isdigit():
            numbers.append(int(piece[:9]))
            continue
        split = _split(piece.lower())
        if split is None:
            unknown += len(piece)
        else:
            words.extend(split)
    joined: list[str] = []
    for word in words:
        if joined and (joined[-1], word) in JOINED_WORDS:
            joined[-1] = JOINED_WORDS[joined[-1], word]
        else:
            joined.append(word)
    side, parts, helper = "", dict[str, int](), False
    for word in joined:
        for meaning in _words()[word]:
            part = meaning.removeprefix("?")
            if part in ("left", "right"):
                side = side or part[0]
            elif part == "helper":
                helper = True
            elif part != "neutral":
                parts[part] = max(parts.get(part, 0), 1 if meaning.startswith("?") else 2)
    return Meaning(side, parts, tuple(numbers), helper, unknown)


def _split(piece: str) -> list[str] | None:
    """Return the fewest words of the table that make up a piece; None if none do.

    The single letter of a side counts only at either end: "rhand", "lthighbend", but not "br-l-ow".
    """
    words = _words()
    best: list[list[str] | None] = [[]]
    for end in range(1, len(piece) + 1):
        shortest: list[str] | None = None
        for begin in range(end):
            before, word = best[begin], piece[begin:end]
            if before is None or word not in words:
                continue
            if len(word) == 1 and word.isascii() and not (len(piece) == 1 or begin == 0 or end == len(piece)):
                continue
            if shortest is None or len(before) + 1 < len(shortest):
                shortest = [*before, word]
        best.append(shortest)
    return best[-1]
