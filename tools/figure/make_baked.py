"""Makes what the player need not compute of the figures that come with it: light and coarse meshes.

    python -m tools.figure.make_baked

To be run after each change of `head.glb`, `levels.glb` or `body.glb` (`make_figures.py` does).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fba import figures
from fba.arrays import Array
from fba.body import BodyModel
from fba_player._figure._face_parts import cast_coarsely
from fba_player._figure.baked_shapes import FOLDER, file_name, pack
from fba_player._figure.body_light import build_body_light
from fba_player._figure.face import FaceFigure, build_figure
from fba_player._figure.far_head import find_collapses
from fba_player._figure.person import body_shape


def bake_face(figure: FaceFigure) -> dict[str, Array]:
    """Return the arrays of a face's file, by name."""
    arrays = figure.light.bake().pack()
    for name, shape in figure.shapes.items():
        outer = cast_coarsely(shape, figure.model.part(name), {}).outer
        if outer is not None:
            arrays[f"{name}/outer"] = outer.astype(np.uint16)
        if shape.levels:
            far = find_collapses(figure, figure.model.part(name), shape.levels[-1])
            arrays[f"{name}/far"] = far.astype(np.uint16)
    return arrays


def bake_body(body: BodyModel) -> dict[str, Array]:
    """Return the arrays of a body's file, by name."""
    arrays = pack(build_body_light(body).bake()[:, None])
    for part in body.parts:
        levels = body_shape(part, len(body.skeleton), {}).coarser
        assert levels is not None
        onto, first = levels.collapses
        arrays |= {f"{part.name}/onto": onto.astype(np.uint16), f"{part.name}/first": first.astype(np.uint8)}
    return arrays


def main() -> None:
    """Write the files and say how large they are."""
    folder = Path(str(FOLDER))
    folder.mkdir(exist_ok=True)
    for path in folder.glob("*.npz"):
        path.unlink()
    for name in figures.FIGURES:
        face, body = figures.face(name), figures.body(name)
        for model, arrays in ((face, bake_face(build_figure(face))), (body, bake_body(body))):
            path = folder / file_name(model.parts)
            np.savez_compressed(path, **arrays)
            print(f"{path}: {path.stat().st_size} bytes, of {name}")


if __name__ == "__main__":
    main()
