"""The figures that come with the library, by name: `fba.figures.face("ruth")`, `fba.figures.body("ruth")`.

The first is the built-in head and person. Of the others, a file holds what differs (`tools/figure` makes it):
positions of vertices and joints, the picture of the skin, colours. They share triangles, weights and
FaceDefTables with the first.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from importlib.resources import as_file, files
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np

from fba.body.builtin import default as default_body
from fba.errors import ModelError
from fba.face.builtin import default as default_face
from fba.face.calibration import rebuild_part, reshape
from fba.face.model import shape_key

if TYPE_CHECKING:
    from fba.arrays import Float64, Floating
    from fba.body import BodyModel, BodyPart
    from fba.face import FaceModel, Part

AnyPart = TypeVar("AnyPart", "Part", "BodyPart")
__all__ = ["FIGURES", "STEP", "body", "face"]

FIGURES = MappingProxyType({"alex": "a young man", "ruth": "a woman of about sixty-five"})
"""Who they are, by name."""
STEP = 2e-6
"""Metres: unit of the stored moves."""


@cache
def face(name: str = "alex") -> FaceModel:
    """Return the face of a figure, read on first use. ModelError for an unknown name."""
    head = default_face()
    if name == next(iter(FIGURES)):
        return head
    data = _read(name)
    if str(data["face"]) != shape_key(head.parts):
        raise ModelError(
            f"the figure {name!r} was made from another built-in head; run python -m tools.remake figures"
        )
    made = reshape(head, head.vertices + data["face_moves"] * STEP, data["points"].astype(np.float64))
    parts = []
    for part, tint in zip(made.parts, data["face_tints"], strict=True):
        own = replace(part, colours=data["eye"]) if part.kind == "eye" else part
        if part.kind == "skin":
            own = replace(part, material=replace(part.material, texture=data["picture"].tobytes()))
        parts.append(_tint(own, tint))
    levels = []
    for level in made.levels:
        coarse = [
            _tint(replace(part, material=full.material), tint)
            for part, full, tint in zip(level.model.parts, parts, data["face_tints"], strict=True)
        ]
        levels.append(replace(level, model=replace(level.model, parts=tuple(coarse))))
    return replace(made, parts=tuple(parts), levels=tuple(levels), name=name)


@cache
def body(name: str = "alex") -> BodyModel:
    """Return the body of a figure without its head, read on first use. ModelError for an unknown name."""
    person = default_body()
    if name == next(iter(FIGURES)):
        return person
    data = _read(name)
    if str(data["body"]) != shape_key(person.parts):  # type: ignore[arg-type]
        raise ModelError(
            f"the figure {name!r} was made from another built-in body; run python -m tools.remake figures"
        )
    moved = person.vertices + data["body_moves"] * STEP
    parts = []
    for part, tint in zip(person.parts, data["body_tints"], strict=True):
        start = person.starts[part.name]
        placed = rebuild_part(cast("Part", part), moved[start : start + len(part.vertices)])
        parts.append(_tint(cast("BodyPart", placed), tint))
    bind, skull = data["body_bind"], person.skeleton.number("skullbase")
    eyes = cast("Float64", person.eyes) + (bind - person.bind)[skull, :3, 3]
    skeleton = replace(person.skeleton, centres=data["body_centres"].astype(np.float64))
    return replace(person, parts=tuple(parts), skeleton=skeleton, bind=bind, eyes=eyes, name=name)


def _read(name: str) -> dict[str, np.ndarray]:
    """Return what a figure's file holds."""
    if name not in FIGURES:
        raise ModelError(f"there is no figure {name!r}; there are {', '.join(FIGURES)}")
    with as_file(files(__package__) / f"{name}.npz") as path, np.load(path) as data:
        return dict(data)


def _tint(part: AnyPart, tint: Floating) -> AnyPart:
    """Return a part whose colours and gloss are multiplied by a tint (4,)."""
    if part.colours is None or (tint == 1).all():
        return part
    return replace(part, colours=np.clip(part.colours * tint, 0.0, 1.0).astype(np.float32))
