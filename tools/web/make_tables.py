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
    faps = fap_steps()[2:]
    iso, visage = (bap_steps(name)[:BAP_STANDARD_COUNT] for name in ("iso", "visage"))
    steps = sorted({0, *faps.tolist(), *iso.tolist(), *visage.tolist()})
    iso_places, visage_places = (_digits(map(steps.index, table.tolist())) for table in (iso, visage))
    replaced = f"{steps.index(64)}{steps.index(128)}"
    common = str(steps.index(170))
    last = visage_places[-7:-1]
    derived = iso_places[1:-7].translate(str.maketrans(replaced, common * 2)) + last
    assert visage_places[1:-1] == derived
    face_steps = _face("0010101", _digits(map(steps.index, faps.tolist())))
    face_limits = [_face("0" * 7, _digits(limits[which, FAPS])) for which in (0, 2)]
    return "\n".join(
        [
            "/** Tables of ISO/IEC 14496-2, from tools/web/make_tables.py: digits in base 36. */",
            "",
            "/** Groups of FAPs 1 to 68 and of BAPs 1 to 296, from 0. */",
            f"export const FAP_GROUPS = {_groups(fap_groups())};",
            f"export const BAP_GROUPS = {_groups(bap_groups())};",
            f"const FACE_STEPS = {face_steps};",
            f"const ISO_STEPS = {iso_places};",
            "/** Quantiser steps; of a select, which has none, 0. */",
            f"export const STEPS = {steps};",
            "/** The steps of all slots, up to that of BAP 186, as places in the list above; else 1. */",
            "export const STEP_PLACES = {",
            "  iso: FACE_STEPS + ISO_STEPS,",
            f'  visage: FACE_STEPS + ISO_STEPS.slice(0, -6).replace(/[{replaced}]/g, "{common}") + "{last}",',
            "};",
            f"const I_FACE = {face_limits[0]};",
            f"const P_BOTH = {face_limits[1][:-1]}{_digits(p_max)[1:]};",
            "/** Default limits of all slots up to BAP 186, in units of 60: I max, I min, P max, P min. */",
            "export const LIMITS = [",
            f"  I_FACE + {_digits(i_max)},",
            f"  I_FACE + {_digits(i_min)},",
            "  P_BOTH,",
            "  P_BOTH,",
            "];",
            "",
        ]
    )


def _face(before: str, digits: str) -> str:
    """Return a table of the slots of a face: visemes and expressions, FAPs 3 to 68, and the flags."""
    return f'"{before}{digits[1:-1]}000"'


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
