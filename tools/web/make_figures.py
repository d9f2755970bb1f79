"""Pack the built-in head and person for the web player: `python tools/web/make_figures.py`."""

from __future__ import annotations

import gzip
from pathlib import Path

from fba.body import BodyModel
from fba.cache import make_key
from fba.face import FaceModel
from fba_player._figure.face import build_figure
from fba_player._figure.person import build_person
from fba_player.web._packing import VERSION, pack_figure

TARGET = Path(__file__).parents[2] / "player" / "fba_player" / "web" / "dist"


def source_of(face: FaceModel, body: BodyModel | None = None) -> str:
    """Return a digest of the models that a figure is made of."""
    arrays = [VERSION, face.vertices, *(part.triangles for part in face.parts)]
    arrays += [mesh.displacements for table in face.tables for mesh in table.meshes]
    if body is not None:
        arrays += [body.vertices, body.triangles, body.weights]
    return make_key("figure", *arrays)


def make_figures() -> dict[str, bytes]:
    """Return the files by name."""
    face, body = FaceModel.default(), BodyModel.default()
    figure = build_figure(face)
    packed = {
        "head.fbam": pack_figure(figure, None, source=source_of(face)),
        "person.fbam": pack_figure(figure, build_person(body, figure), source=source_of(face, body)),
    }
    return {name: gzip.compress(each.data, 9, mtime=0) for name, each in packed.items()}


if __name__ == "__main__":
    for name, data in make_figures().items():
        (TARGET / name).write_bytes(data)
