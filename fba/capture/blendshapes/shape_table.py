"""What shapes mean: FAPs of each at weight 1, from `shape_faps.csv`.

The table has ARKit's 52 shapes, the expressions of VRM, the visemes of Oculus, and some of VRoid's. The
amplitudes are those of an adult's face, in FAPUs, so that the motion fits every face. "viseme10" and
"expression1" stand for the FAPs of a viseme or an expression at full intensity. Shapes that are named after
FAPs have the amplitude that this project's own files use.
"""

from __future__ import annotations

import re
from functools import cache

import numpy as np

from fba.arrays import Bool, Float64
from fba.face import Definitions, arkit_of
from fba.face.gltf.morphs import morph_values
from fba.face.shape_names import fap_of
from fba.name_maps import both_sides, key_of
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, fap_numbers, faps
from fba.text_files import packaged_rows


@cache
def shape_faps(name: str) -> Float64 | None:
    """Return FAPs (68,) of the shape of this name at weight 1; None for an unknown name."""
    number = fap_of(name)
    if number is not None:
        amounts = np.zeros(FAP_COUNT)
        amounts[number - 1] = morph_values().get(number, 0)
        return amounts
    table = _table()
    plain = re.split(r"[.:|/]", name)[-1]
    shape = arkit_of(name) or plain
    return next((table[key_of(word)] for word in (name, plain, shape) if key_of(word) in table), None)


@cache
def largest_amounts() -> Float64:
    """Return the largest value (68,) of each FAP that a shape of the table has; read-only."""
    largest: Float64 = np.abs(list(_table().values())).max(axis=0)
    largest.flags.writeable = False
    return largest


def with_mates(sent: Bool) -> Bool:
    """Return a mask (68,) with the other side of each FAP, too; a decoder would otherwise copy this side."""
    result = np.array(sent)
    for fap in faps():
        if fap.left_right_mate is not None and sent[fap.left_right_mate - 1]:
            result[fap.number - 1] = True
    return result


@cache
def _table() -> dict[str, Float64]:
    """Return FAPs (68,) at weight 1 by the key of each shape's name."""
    table: dict[str, Float64] = {}
    for row in packaged_rows(__package__, "shape_faps.csv"):
        for side, name in both_sides(row["shape"]):
            table[key_of(name)] = _amounts((row["faps"] or "").replace("?", side))
    return table


def _amounts(text: str) -> Float64:
    """Return FAPs (68,) from text such as "open_jaw=500 viseme10=1"."""
    amounts = np.zeros(FAP_COUNT)
    definitions = Definitions.default()
    for entry in text.split():
        name, _, value = entry.partition("=")
        group = re.fullmatch(r"(viseme|expression)(\d+)", name)
        if group is None:
            amounts[fap_numbers()[name] - 1] += float(value)
            continue
        rows = definitions.visemes if group[1] == "viseme" else definitions.expressions
        amounts += float(value) * rows[int(group[2])].astype(np.float64)
    amounts[: FIRST_LOW_LEVEL_FAP - 1] = 0
    return amounts
