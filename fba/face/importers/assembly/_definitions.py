"""Visemes and expressions (FAPs 1 and 2) of a head as its sculptor made them, by its feature points."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from fba.arrays import Float64, Floating
from fba.face._expressions import EXPRESSION_NAMES, VISEME_NAMES, Definitions
from fba.face.authoring.surface._motion_limits import human_range
from fba.face.deform._deformer import Deformer
from fba.face.model import FaceModel
from fba.face.points import DIRECTIONS, OPEN_JAW
from fba.parameters import FAP_COUNT, faps, point_rows
from fba.text_files import packaged_rows

MOUTH = (OPEN_JAW, *range(4, 14), 16, 17, *range(51, 61))
"""FAPs by which a viseme is shown."""
FACE = (*MOUTH, *range(19, 23), *range(31, 43))
"""FAPs by which an expression is shown."""
ROUNDS = 4
"""Number of times that the rest is measured: motions of the jaw and of lids are not straight."""
SCALINGS = 3
"""Number of times that a shape is made smaller, until all points reach what it asks for."""
COUNTED_SHARE = 0.5
"""Share of the largest motion above which a point counts."""
REACHED_SHARE = 0.75
"""Share of its motion that such a point must reach."""
MIN_SCALE = 0.7
"""Least factor by which a shape is made smaller at once."""
MIN_MOTION = 0.004
"""Motion of a point, in distances of the pupils, from which a shape shows something."""
IGNORED_MOTION = 0.001
"""Motion of a point, in distances of the pupils, below which it does not count."""
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")


def define_by_shapes(model: FaceModel, morphs: Mapping[str, Mapping[str, Floating]]) -> FaceModel:
    """Return the model whose visemes and expressions are those that shapes of these names show; others stay.

    morphs: displacements (V, 3) at weight 1, metres, by shape and part. Both sides get the mean of both, so
    that a symmetric head stays so. What no FAP moves, and teeth and tongue, do not count.
    """
    shapes = named_shapes(morphs)
    if not shapes:
        return model
    deform = Deformer(model)
    tables = {
        "viseme": np.array(model.definitions.visemes, dtype=np.float64),
        "expression": np.array(model.definitions.expressions, dtype=np.float64),
    }
    used = []
    for (kind, select), name in shapes.items():
        values = _measure(model, deform, morphs[name], MOUTH if kind == "viseme" else FACE)
        if values is None:
            continue
        own = MOUTH if kind == "viseme" else FACE
        tables[kind][select, np.array(own) - 1] = values[np.array(own) - 1]
        used.append((VISEME_NAMES if kind == "viseme" else EXPRESSION_NAMES)[select])
    if not used:
        return model
    definitions = Definitions(tables["viseme"].astype(np.float32), tables["expression"].astype(np.float32))
    note = f"of the head's own shapes: {', '.join(used)}"
    return replace(model, definitions=definitions).with_notes({"visemes and expressions": note})


def named_shapes(names: Iterable[str]) -> dict[tuple[str, int], str]:
    """Return the first shape named after each viseme and expression: (kind, select) -> name."""
    result: dict[tuple[str, int], str] = {}
    for name in names:
        key = _synonyms().get(_words(name)) or _synonyms().get(_words(re.split(r"[.:|/]", name)[-1]))
        if key is not None:
            result.setdefault(key, name)
    return dict(sorted(result.items()))


def _measure(
    model: FaceModel, deform: Deformer, shape: Mapping[str, Floating], numbers: tuple[int, ...]
) -> Float64 | None:
    """Return (68,) values of FAPs that move their points as a shape does; None if it moves hardly any."""
    apart = model.fapu.ES * 1024
    moved = np.full((len(model.points), 3), np.nan)
    for part, field in shape.items():
        start = model.starts[part]
        own = np.flatnonzero((model.bound >= start) & (model.bound < start + len(field)))
        moved[own] = field[model.bound[own] - start]
    entries = [faps()[number - 1] for number in numbers if number in model.table_of]
    known = [entry for entry in entries if np.isfinite(moved[point_rows()[entry.feature_points[0]]]).all()]
    rows = [point_rows()[entry.feature_points[0]] for entry in known]
    ways = np.array([DIRECTIONS[entry.positive] for entry in known], dtype=np.float64)
    units = np.array([model.fapu[entry.unit] for entry in known])
    if not known or np.linalg.norm(moved[rows], axis=1).max() < MIN_MOTION * apart:
        return None
    target = np.einsum("ij,ij->i", moved[rows], ways)
    target[np.abs(target) < IGNORED_MOTION * apart] = 0.0
    numbers_known = np.array([entry.number for entry in known])
    sides = np.zeros(FAP_COUNT)
    sides[numbers_known - 1] = target
    target = _even(sides)[numbers_known - 1]
    rest = deform.feature_points(np.zeros(FAP_COUNT))[rows]
    large = np.abs(target) > COUNTED_SHARE * np.abs(target).max()
    if not large.any():  # it moves no point in the direction of any FAP
        return None
    values = np.zeros(FAP_COUNT)
    for _ in range(SCALINGS):
        values = np.zeros(FAP_COUNT)
        for _ in range(ROUNDS):
            now = np.einsum("ij,ij->i", deform.feature_points(values)[rows] - rest, ways)
            values[numbers_known - 1] += (target - now) / units
            values = _within_limits(_even(values))
        now = np.einsum("ij,ij->i", deform.feature_points(values)[rows] - rest, ways)
        reached = float((now[large] / target[large]).min())
        if reached > REACHED_SHARE:
            break
        # where one point stops early, a smaller motion of all keeps the form
        target *= max(reached, MIN_SCALE)
    return np.round(values)


def _even(values: Float64) -> Float64:
    """Return the values (68,) with the mean of both sides on each."""
    result = values.copy()
    for entry in faps():
        if entry.left_right_mate is not None:
            result[entry.number - 1] = (values[entry.number - 1] + values[entry.left_right_mate - 1]) / 2
    return result


def _within_limits(values: Float64) -> Float64:
    """Return the values (68,), none larger than on human faces, jaw and lids within their ranges."""
    result = values.copy()
    for entry in faps():
        low, high = human_range(entry.number)
        if entry.i_limits is not None:
            low, high = min(low, -entry.i_limits[0] * entry.step), min(high, entry.i_limits[1] * entry.step)
        result[entry.number - 1] = np.clip(values[entry.number - 1], -low, high)
    return result


@cache
def _synonyms() -> dict[frozenset[str], tuple[str, int]]:
    return {
        _words(name): (row["kind"], int(row["select"]))
        for row in packaged_rows(__package__, "visemes.csv")
        for name in row["names"].split(";")
    }


def _words(name: str) -> frozenset[str]:
    return frozenset(word.lower() for word in WORD.findall(name))
