"""Tables of errors, in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import fba
from fba.face import FaceModel
from fba.parameters import faps
from fba_conformance.captures.marked_actor import as_face, record
from fba_conformance.captures.marker_files import MAKERS
from fba_conformance.captures.measurement import (
    Errors,
    measure_animation,
    measure_marker_file,
    worst,
)
from fba_conformance.captures.performances import speech
from fba_conformance.captures.point_files import LAYOUTS
from fba_conformance.captures.shaped_face import FACE_FILES, encode_file
from fba_conformance.captures.tracked_actor import film

RATE = 100


NOT_TOLD = "–"


def faps_table(errors: Mapping[str, Mapping[int, float | None]]) -> str:
    """Return a row for each FAP and a column for each kind of capture, whose errors are given by FAP.

    Left and right share a row, with the larger error. None is a FAP that is told, without a number.
    """
    rows = [["FAP", *errors]]
    for fap in faps()[2:]:
        mate = fap.left_right_mate or fap.number
        if mate < fap.number:
            continue
        both = f"{fap.number}, {mate}" if mate != fap.number else str(fap.number)
        degrees = ", degrees" if fap.unit == "AU" else ""
        digits = 2 if degrees else 1
        cells = []
        for each in errors.values():
            told = [each[number] for number in {fap.number, mate} if number in each]
            numbers = [error for error in told if error is not None]
            cells.append(f"{max(numbers):.{digits}f}" if numbers else "yes" if told else NOT_TOLD)
        name = fap.name.replace("_l_", "_?_").replace("_lm", "_?m") if mate != fap.number else fap.name
        rows.append([f"{both} `{name}`{degrees}", *cells])
    return as_markdown(rows)


def files_table(folder: Path, head: FaceModel, seconds: float) -> str:
    """Return a row for each kind of file: the FAP that is off most, percent of FAPU; turns, degrees."""
    rows = [["file", "FAP that is off most, % of FAPU", "head and eyes, degrees"]]
    take = record(head, speech(round(seconds * RATE), RATE), RATE)
    for name in MAKERS:
        errors, _ = measure_marker_file(folder, name, take)
        rows.append([f"`{name}`", *_worst_cells(errors)])
    seen = film(head, 478, frames=round(seconds * 30), share=True)
    for name in LAYOUTS:
        (folder / name).write_bytes(LAYOUTS[name](seen.motion))
        found = fba.read(folder / name, fps=30, aspect=16 / 9, neutral="first")
        errors = measure_animation(found, as_face(seen.faps, 30))
        rows.append([f"points: `{name}`", *_worst_cells(errors)])
    for name in FACE_FILES:
        errors = measure_animation(*encode_file(folder, name, seconds))
        rows.append([f"`{name}`", *_worst_cells(errors)])
    return as_markdown(rows)


def _worst_cells(errors: Errors) -> list[str]:
    return [f"{worst(errors, turns=turns):.2f}" for turns in (False, True)]


def as_markdown(rows: Iterable[list[str]]) -> str:
    """Return a table whose first row is its head."""
    lines = [f"| {' | '.join(row)} |" for row in rows]
    lines.insert(1, "|" + "---|" * (lines[0].count("|") - 1))
    return "\n".join(lines)
