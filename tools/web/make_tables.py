"""Write the tables of the decoder and of the figure in JavaScript: `python tools/web/make_tables.py`."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from fba.codec._plane.coder_state import default_limits
from fba.codec._plane.slots import BAPS, FAPS
from fba.codec.settings import RANGE_UNIT
from fba.face.mates import donors
from fba.parameters import BAP_STANDARD_COUNT, BAP_STEP_TABLES, bap_groups, bap_steps, fap_groups, fap_steps

WEB = Path(__file__).parents[2] / "player" / "fba_player" / "web"
TARGET = WEB / "decoder" / "tables.js"
FIGURE_TARGET = WEB / "figure" / "tables.js"


def make_tables() -> str:
    """Return the JavaScript module."""
    limits = default_limits() // RANGE_UNIT
    baps = [limits[which, BAPS][:BAP_STANDARD_COUNT] for which in range(4)]
    steps = ", ".join(f"{name}: {_list(bap_steps(name))}" for name in BAP_STEP_TABLES)
    return "\n".join(
        [
            "/** Tables of ISO/IEC 14496-2, made by tools/web/make_tables.py. Limits are in units of 60. */",
            f"export const FAP_GROUPS = {json.dumps(fap_groups())};",
            f"export const BAP_GROUPS = {json.dumps(bap_groups())};",
            "/** Quantiser steps of FAPs 3 to 68. */",
            f"export const FAP_STEPS = {_list(fap_steps()[2:])};",
            "/** Quantiser steps of BAPs 1 to 296. */",
            f"export const BAP_STEPS = {{ {steps} }};",
            "/** Default limits of FAPs 3 to 68, up and down, in I planes and in P planes. */",
            f"export const FAP_LIMITS = [{_list(limits[0, FAPS])}, {_list(limits[2, FAPS])}];",
            "/** Default limits of BAPs 1 to 186: I max, I min, P max, P min, as magnitudes. */",
            f"export const BAP_LIMITS = [{', '.join(map(_list, baps))}];",
            "",
        ]
    )


def make_figure_tables() -> str:
    """Return the JavaScript module of the figure."""
    columns = ",\n  ".join(_list(column) for column in donors())
    return (
        "/** Tables of ISO/IEC 14496-2, made by tools/web/make_tables.py. */\n"
        "/** Columns of the FAPs that each FAP copies: its mate, its lip mate, and the mate of that. */\n"
        f"export const DONORS = [\n  {columns},\n];\n"
    )


def _list(values: Iterable[int]) -> str:
    return json.dumps([int(value) for value in values])


if __name__ == "__main__":
    TARGET.write_text(make_tables(), encoding="utf-8")
    FIGURE_TARGET.write_text(make_figure_tables(), encoding="utf-8")
