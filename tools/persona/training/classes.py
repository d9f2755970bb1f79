"""The 35 classes that are recognised, as FAPs: action units, three pairs of them, six emotions, the neutral
face.

`classes.csv` says what each is made of, and what it makes mouth, eyes and brows to be examples of: a name,
several joined by +, or nothing where that is open. They are those of the Bosphorus database, by its names,
apart from LFAU_12LW, a slight LFAU_12, in whose place UFAU_5 stands, wide eyes.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from importlib.resources import files

import numpy as np

from fba.arrays import Bool, Float64
from fba.capture import ActionUnitMotion, ShapeMotion, from_blendshapes
from fba.capture.blendshapes.conversion import to_shapes
from fba.face import Definitions, resolve
from fba.parameters import FAP_COUNT
from fba.persona.points.layout import PARTS

NEUTRAL = "NEUTRAL"


@dataclass(frozen=True)
class FaceClass:
    """A class. recipe: its components. labels: part -> names of the classes of which it is an example."""

    name: str
    recipe: str
    labels: dict[str, tuple[str, ...]]
    what: str


@cache
def face_classes() -> tuple[FaceClass, ...]:
    """Return the 35 classes, the neutral face first."""
    text = (files(__package__) / "classes.csv").read_text(encoding="utf-8")
    columns = {
        "mouth": "mouth",
        "left_eye": "eyes",
        "right_eye": "eyes",
        "left_brow": "brows",
        "right_brow": "brows",
    }
    return tuple(
        FaceClass(
            row["name"],
            row["recipe"],
            {part: tuple(filter(None, row[columns[part]].split("+"))) for part in PARTS},
            row["what"],
        )
        for row in csv.DictReader(text.splitlines())
    )


@cache
def part_classes(part: str) -> tuple[str, ...]:
    """Return the classes of a part's network."""
    return tuple(dict.fromkeys(name for one in face_classes() for name in one.labels[part]))


@cache
def class_labels(part: str) -> Bool:
    """Return bool (35, C): of which of `part_classes` each class is an example."""
    known = part_classes(part)
    return np.array([[name in one.labels[part] for name in known] for one in face_classes()])


@cache
def class_faps() -> Float64:
    """Return the FAPs (35, 68) of each class at full intensity."""
    faps = np.zeros((len(face_classes()), FAP_COUNT))
    for row, one in enumerate(face_classes()):
        if one.recipe.startswith("expression="):
            faps[row] = Definitions.default().expressions[int(one.recipe.partition("=")[2])]
        elif one.recipe:
            faps[row] = _recipe_faps(one.recipe)
    faps[:, 22:26] = 0.0  # eyes look ahead
    faps.flags.writeable = False
    return faps


def _recipe_faps(recipe: str) -> Float64:
    """Return FAPs (68,) of a recipe such as "AU26 AU12=0.4" or "eyeSquint?=1", ? for both sides."""
    weights: dict[str, float] = {}
    for entry in recipe.split():
        name, _, text = entry.partition("=")
        share = float(text or 1)
        if name.startswith("AU"):
            unit = ActionUnitMotion((int(name[2:]),), np.array([[share]]), np.zeros(1), Fraction(30))
            shapes = to_shapes(unit)
            added = dict(zip(shapes.names, shapes.weights[0].tolist(), strict=True))
        else:
            sides = ("Left", "Right") if "?" in name else ("",)
            added = {name.replace("?", side): share for side in sides}
        for shape, weight in added.items():
            weights[shape] = weights.get(shape, 0.0) + weight
    motion = ShapeMotion(tuple(weights), np.array([list(weights.values())]), np.zeros(1), Fraction(30))
    track = from_blendshapes(motion).face
    assert track is not None
    return np.asarray(resolve(track)[0], dtype=np.float64)
