"""Write the tables of the decoder and of the figure in JavaScript: `python tools/web/make_tables.py`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from fba.codec._plane.coder_state import default_limits
from fba.codec._plane.slots import BAPS, FAPS
from fba.codec.settings import RANGE_UNIT
from fba.parameters import (
    BAP_STANDARD_COUNT,
    BAP_STEP_TABLES,
    bap_groups,
    bap_steps,
    fap_groups,
    fap_steps,
    mate_columns,
)

WEB = Path(__file__).parents[2] / "player" / "fba_player" / "web"
TARGET = WEB / "decoder" / "tables.js"
FIGURE_TARGET = WEB / "figure" / "tables.js"


def make_tables() -> str:
    """Return the JavaScript module."""
    limits = default_limits() // RANGE_UNIT
    i_max, i_min, p_max, p_min = (limits[which, BAPS][:BAP_STANDARD_COUNT] for which in range(4))
    assert np.array_equal(p_max, p_min)
    assert all((bap_steps(name)[BAP_STANDARD_COUNT:] == 1).all() for name in BAP_STEP_TABLES)
    standard = {name: bap_steps(name)[:BAP_STANDARD_COUNT] for name in BAP_STEP_TABLES}
    faps = fap_steps()[2:]
    steps = sorted({int(step) for table in (faps, *standard.values()) for step in table})
    bap_tables = ",\n".join(
        f"  {name}: {_digits(map(steps.index, table.tolist()))}" for name, table in standard.items()
    )
    return "\n".join(
        [
            "/** Tables of ISO/IEC 14496-2, from tools/web/make_tables.py: digits in base 36. */",
            "",
            "/** Groups of FAPs 1 to 68 and of BAPs 1 to 296, from 0. */",
            f"export const FAP_GROUPS = {_groups(fap_groups())};",
            f"export const BAP_GROUPS = {_groups(bap_groups())};",
            "/** Quantiser steps of FAPs 3 to 68 and BAPs 1 to 186, as places in this list; else 1. */",
            f"export const STEPS = {steps};",
            f"export const FAP_STEPS = {_digits(map(steps.index, faps.tolist()))};",
            f"export const BAP_STEPS = {{\n{bap_tables},\n}};",
            "/** Default limits of FAPs 3 to 68, up and down, in units of 60: in I planes, in P planes. */",
            f"export const FAP_LIMITS = [{_digits(limits[0, FAPS])}, {_digits(limits[2, FAPS])}];",
            "/** Those of BAPs 1 to 186, as magnitudes: in I planes up and down, in P planes both. */",
            f"export const BAP_LIMITS = [{', '.join(map(_digits, (i_max, i_min, p_max)))}];",
            "",
        ]
    )


def make_figure_tables() -> str:
    """Return the JavaScript module of the figure."""
    columns = ",\n  ".join(str(column.tolist()) for column in mate_columns())
    return (
        "/** Tables of ISO/IEC 14496-2, made by tools/web/make_tables.py. */\n"
        "/** Columns of the FAPs that each FAP copies: its mate, its lip mate, and the mate of that. */\n"
        f"export const DONORS = [\n  {columns},\n];\n"
    )


def _groups(groups: Sequence[Sequence[int]]) -> str:
    assert all(list(group) == sorted(group) for group in groups)
    group_of = {number: place for place, group in enumerate(groups) for number in group}
    return _digits(group_of[number] for number in sorted(group_of))


def _digits(values: Iterable[int]) -> str:
    return '"' + "".join("0123456789abcdefghijklmnopqrstuvwxyz"[value] for value in values) + '"'


if __name__ == "__main__":
    TARGET.write_text(make_tables(), encoding="utf-8")
    FIGURE_TARGET.write_text(make_figure_tables(), encoding="utf-8")
