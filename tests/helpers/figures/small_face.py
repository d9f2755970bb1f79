"""A face of a few hundred vertices, quick to make and to draw: an egg with two balls in it."""

import numpy as np

from fba.face._tables import FaceDefMesh, FaceDefTables
from fba.face.model import FaceModel, Part
from fba.parameters import point_rows
from fba_player._mesh.primitives import sphere_mesh


def small_face(*kinds: str, scale: float = 1.0) -> FaceModel:
    """Parts of the kinds skin and eye, or those asked for.

    Feature points are those of the built-in head, bound to nothing but the chin. FAPs 3, 23..26 and 48..50
    move it. scale: how many times as large as a person.
    """
    head = FaceModel.default()
    sphere, inwards = sphere_mesh(10, 16)
    triangles = inwards[:, ::-1]
    skin = sphere * (0.075, 0.115, 0.095) + (0.0, -0.01, -0.03)
    chin = head.points[point_rows()["2.1"]]
    lowest = int(skin[:, 1].argmin())
    skin[lowest] = chin
    parts = [Part("skin", "skin", (skin * scale).astype(np.float32), triangles)]
    for name in ("eye_left", "eye_right"):
        part = head.part(name)
        middle = (part.vertices.min(axis=0) + part.vertices.max(axis=0)) / 2
        ball = sphere * (np.ptp(part.vertices[:, 1]) / 2) + middle
        parts.append(Part(name, "eye", (ball * scale).astype(np.float32), triangles))
    if kinds:
        parts = [part for part in parts if part.kind in kinds]
    bound = np.full(len(head.points), -1)
    if parts[0].kind == "skin":
        bound[point_rows()["2.1"]] = lowest
    names = {part.name for part in parts} | {"head"}
    tables = []
    for number in (23, 24, 25, 26, 48, 49, 50):
        moved = head.table_of[number].transforms
        kept = [
            type(one)(one.part, one.kind, one.amount, tuple(float(v) * scale for v in one.centre))  # type: ignore[arg-type]
            for one in moved
            if one.part in names
        ]
        if kept:
            tables.append(FaceDefTables(number, (), tuple(kept)))
    if parts[0].kind == "skin":
        low = np.flatnonzero(skin[:, 1] < -0.07)
        down = np.tile(np.array([[0.0, -1.0, 0.0]], dtype=np.float32), (len(low), 1))[:, None]
        borders = np.array([0, 1], dtype=np.int32)
        tables.append(FaceDefTables(3, (FaceDefMesh("skin", borders, low.astype(np.int32), down),)))
    return FaceModel(tuple(parts), head.points * scale, bound, tuple(tables), name="egg")
