"""Write the names and shapes of the page, as JavaScript: `python tools/web/make_page_tables.py`."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from fba.capture import shape_faps
from fba.capture.blendshapes._inversion import SHARED_WEIGHT, _metres
from fba.capture.blendshapes.combination import CLOSED, JAW
from fba.face import FaceModel, arkit_names
from fba.parameters import EXPRESSIONS, VISEMES, baps, faps

WEB = Path(__file__).parents[2] / "player" / "fba_player" / "web"


def make_names() -> str:
    """Return the module of the names of ISO/IEC 14496-2."""
    return "\n".join(
        [
            "/** Names of ISO/IEC 14496-2, made by tools/web/make_page_tables.py. */",
            f"export const FAP_NAMES = {json.dumps([fap.name for fap in faps()])};",
            f"export const FAP_UNITS = {json.dumps([fap.unit for fap in faps()])};",
            f"export const BAP_NAMES = {json.dumps([bap.name for bap in baps()])};",
            f"export const VISEMES = {json.dumps(list(VISEMES))};",
            f"export const EXPRESSIONS = {json.dumps(list(EXPRESSIONS))};",
            "",
        ]
    )


def make_shapes() -> str:
    """Return the module of ARKit's shapes."""
    rows = {}
    for name in arkit_names():
        amounts = shape_faps(name)
        assert amounts is not None
        rows[name] = {int(column) + 1: float(amounts[column]) for column in np.flatnonzero(amounts)}
    metres = [float(f"{metre:.6g}") for metre in _metres(arkit_names())]
    return "\n".join(
        [
            "/** ARKit's 52 shapes as FAPs, made by tools/web/make_page_tables.py. */",
            "/** FAPs of each shape at a weight of 1. @type {Record<string, Record<string, number>>} */",
            f"export const SHAPES = {json.dumps(rows)};",
            "/** Metres that one unit of FAPs 1 to 68 moves an adult's face; 0 where no shape does. */",
            f"export const METRES = {json.dumps(metres)};",
            "/** Metres of error that count as much as a weight of 1. */",
            f"export const SHARED_WEIGHT = {SHARED_WEIGHT};",
            f"export const [JAW, CLOSED] = {json.dumps([JAW, CLOSED])};",
            "",
        ]
    )


def make_definitions() -> str:
    """Return the module of the built-in head's visemes and expressions."""
    definitions = FaceModel.default().definitions
    rows = [
        [{int(column) + 1: float(row[column]) for column in np.flatnonzero(row)} for row in each[1:]]
        for each in (definitions.visemes, definitions.expressions)
    ]
    return "\n".join(
        [
            "/** Visemes and expressions as FAPs, made by tools/web/make_page_tables.py. */",
            f"export const DEFINITIONS = {json.dumps(rows)};",
            "",
        ]
    )


if __name__ == "__main__":
    (WEB / "page" / "names.js").write_text(make_names(), encoding="utf-8")
    (WEB / "loader" / "shapes.js").write_text(make_shapes(), encoding="utf-8")
    (WEB / "loader" / "definitions.js").write_text(make_definitions(), encoding="utf-8")
