"""Packs the models that the web player shows."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fba.arrays import Int64
from fba.body import BodyModel
from fba.face import FaceModel
from fba_player._figure._face_parts import detail_levels
from fba_player._figure.face import FaceFigure, build_figure
from fba_player._figure.model_units import prepare_model
from fba_player._figure.person import Person, build_person
from fba_player.view._view import FaceShape
from fba_player.web._body_packing import pack_body_parts
from fba_player.web._container import Container
from fba_player.web._face_packing import Chosen, fewer_triangles, pack_face_parts

VERSION = 1
DETAIL = 0.0
"""Error of surfaces in metres, for a face of an adult's size."""
EYE_DETAIL = 0.25
"""That of eyeballs, as a share: they are looked at most."""


class Packed(NamedTuple):
    """A packed figure, and the vertices of its face and its body that stay, (W,) each, in their new order."""

    data: bytes
    face_rows: Int64
    body_rows: Int64


def pack_face(model: FaceModel, *, detail: float = DETAIL) -> bytes:
    """Return a face as the web player reads it.

    detail: error of the surface in metres up to which triangles are left out, for a face of an adult's size;
    0 for none. Vertices that stay are moved as in the model, within a tenth of a millimetre.
    """
    return pack_figure(build_figure(prepare_model(model)), None, detail).data


def pack_body(body: BodyModel, face: FaceModel | None = None, *, detail: float = DETAIL) -> bytes:
    """Return a person as the web player reads it: a body with a face on it, by default the built-in head.

    A body without a place for a face keeps its own head, whose shapes FAPs mix. detail: see `pack_face`.
    """
    figure = build_figure(prepare_model(face or FaceModel.default()))
    return pack_figure(figure, build_person(body, figure), detail).data


def pack_figure(
    figure: FaceFigure, person: Person | None, detail: float = DETAIL, *, source: str = ""
) -> Packed:
    """Return a head, or the person that it is the head of. source: of what it is made, for its header."""
    container, header = Container(), dict[str, Any](version=VERSION, source=source)
    body_rows = np.zeros(0, dtype=np.int64)
    shapes = figure.shapes if person is None else person.face_shapes
    with_eyes = person is None or person.head is not None
    chosen = _choose(figure, shapes, detail, eyes=with_eyes)
    header["face"], face_rows = pack_face_parts(container, figure, chosen)
    if person is not None:
        header["body"], body_rows = pack_body_parts(container, person, face_rows, detail)
    return Packed(container.finish(header), face_rows, body_rows)


def _choose(figure: FaceFigure, shapes: dict[str, FaceShape], detail: float, *, eyes: bool) -> list[Chosen]:
    """Return the parts of a face that are shown, with fewer triangles. eyes: whether eyeballs are."""
    model, balls = figure.model, {part.name for part, _ in figure.eyeballs if eyes}
    error = detail * figure.scale
    chosen: list[Chosen] = []
    for part in model.parts:
        shape, triangles = shapes.get(part.name), part.triangles
        if shape is not None:
            triangles = fewer_triangles(shape, error)
        elif part.name in balls:
            fewer = detail_levels(part, [part.vertices]).triangles_within(EYE_DETAIL * error)
            triangles = triangles if fewer is None else fewer
        else:
            continue
        chosen.append((part, triangles, model.starts[part.name], shape))
    return [each for each in chosen if len(each[1])]
