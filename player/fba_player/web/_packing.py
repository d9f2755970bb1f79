"""Packs the models that the web player shows."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fba.arrays import Int64
from fba.body import BodyModel
from fba.face import FaceModel
from fba_player._figure.face import FaceFigure, build_figure
from fba_player._figure.model_units import prepare_model
from fba_player._figure.person import Person, build_person
from fba_player.view._view import FaceShape
from fba_player.web._body_packing import pack_body_parts
from fba_player.web._container import Container
from fba_player.web._face_packing import Chosen, pack_face_parts
from fba_player.web._look_packing import pack_relief

VERSION = 2


class Packed(NamedTuple):
    """A packed figure, and the vertices of its face and its body that stay, (W,) each, in their new order."""

    data: bytes
    face_rows: Int64
    body_rows: Int64


def pack_face(model: FaceModel) -> bytes:
    """Return a face as the web player reads it, with all vertices, moved within a tenth of a millimetre."""
    return pack_figure(build_figure(prepare_model(model)), None).data


def pack_body(body: BodyModel, face: FaceModel | None = None) -> bytes:
    """Return a person as the web player reads it: a body with a face on it, by default the built-in head.

    A body without a place for a face keeps its own head, whose shapes FAPs mix.
    """
    figure = build_figure(prepare_model(face or FaceModel.default()))
    return pack_figure(figure, build_person(body, figure)).data


def pack_figure(figure: FaceFigure, person: Person | None, *, source: str = "") -> Packed:
    """Return a head, or the person that it is the head of. source: of what it is made, for its header."""
    container, header = Container(), dict[str, Any](version=VERSION, source=source)
    body_rows = np.zeros(0, dtype=np.int64)
    shapes = figure.shapes if person is None else person.face_shapes
    with_eyes = person is None or person.head is not None
    header["face"], face_rows = pack_face_parts(container, figure, _choose(figure, shapes, eyes=with_eyes))
    if person is not None:
        header["body"], body_rows = pack_body_parts(container, person, face_rows)
        shapes = {**shapes, **person.body_shapes}
    if any(shape.fine[0] > 0 for shape in shapes.values()):
        header["relief"] = pack_relief(container)
    return Packed(container.finish(header), face_rows, body_rows)


def _choose(figure: FaceFigure, shapes: dict[str, FaceShape], *, eyes: bool) -> list[Chosen]:
    """Return the parts of a face that are shown. eyes: whether eyeballs are."""
    model, balls = figure.model, {part.name for part, _ in figure.eyeballs if eyes}
    chosen: list[Chosen] = []
    for part in model.parts:
        shape = shapes.get(part.name)
        if shape is not None or part.name in balls:
            triangles = part.triangles if shape is None else shape.triangles
            chosen.append((part, triangles, model.starts[part.name], shape))
    return [each for each in chosen if len(each[1])]
