"""Tables of errors, in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

import fba
from fba.arrays import Float64
from fba.capture import ShapeMotion, from_blendshapes, to_blendshapes
from fba.face import FaceModel, arkit_names
from fba.formats import format_of
from fba.formats.face_tables import _livelink_csv as livelink_csv
from fba.formats.face_tables import livelink_udp
from fba.parameters import faps
from tools.captures.marked_actor import as_face, record
from tools.captures.marker_files import MAKERS
from tools.captures.measurement import Errors, measure_animation, measure_marker_file, worst
from tools.captures.performances import speech
from tools.captures.point_files import LAYOUTS
from tools.captures.shaped_face import FACE_FILES, encode_file
from tools.captures.tracked_actor import film

RATE = 100


NOT_TOLD = "–"
STILL = 1e-6
"""Sum of the squares of weights that do not move."""


def faps_table(errors: Mapping[str, Mapping[int, float | None]]) -> str:
    """Return a row for each FAP and a column for each kind of capture, whose errors are given by FAP.

    Left and right share a row, with the larger error. None: a FAP that is shown, without a number.
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
        found = fba.read(folder / name, source_rate=30, aspect=16 / 9, neutral="first")
        errors = measure_animation(found, as_face(seen.faps, 30))
        rows.append([f"points: `{name}`", *_worst_cells(errors)])
    for name in FACE_FILES:
        errors = measure_animation(*encode_file(folder, name, seconds))
        rows.append([f"`{name}`", *_worst_cells(errors)])
    return as_markdown(rows)


def shapes_table(recordings: Iterable[Path]) -> str:
    """Return a row for each of ARKit's shapes: its correlation with itself after FAPs, its largest weight.

    Means of each recording do not count. Shapes that a recording does not move have no correlation.
    """
    before: list[Float64] = []
    after: list[Float64] = []
    largest = np.zeros(len(arkit_names()))
    for path in recordings:
        motion = read_shapes(path)
        animation = from_blendshapes(motion)
        seen, at = motion.seen, animation.index / float(animation.rate)
        weights = np.zeros((len(at), len(arkit_names())))
        for name, values in zip(motion.names, motion.weights[seen].T, strict=True):
            if name in arkit_names():
                weights[:, arkit_names().index(name)] = np.interp(at, motion.times[seen], values)
        largest = np.maximum(largest, weights.max(axis=0))
        before.append(weights - weights.mean(axis=0))
        back = to_blendshapes(animation).weights
        after.append(back - back.mean(axis=0))
    one, other = np.concatenate(before), np.concatenate(after)
    powers = np.sqrt((one**2).sum(axis=0) * (other**2).sum(axis=0))
    rows = [["shape", "correlation", "largest weight"]]
    for number, name in enumerate(arkit_names()):
        power = float(powers[number])
        told = f"{float(one[:, number] @ other[:, number]) / power:.3f}" if power > STILL else NOT_TOLD
        rows.append([name, told, f"{largest[number]:.2f}"])
    return as_markdown(rows)


def read_shapes(path: Path) -> ShapeMotion:
    """Return what a table of Live Link Face or its datagrams hold. Raises FbaError."""
    if format_of(path).name == "livelink-udp":
        return livelink_udp.read_face(path)
    return livelink_csv.read_face(path)


def _worst_cells(errors: Errors) -> list[str]:
    return [f"{worst(errors, turns=turns):.2f}" for turns in (False, True)]


def as_markdown(rows: Iterable[list[str]]) -> str:
    """Return a table whose first row is its head."""
    lines = [f"| {' | '.join(row)} |" for row in rows]
    lines.insert(1, "|" + "---|" * (lines[0].count("|") - 1))
    return "\n".join(lines)
