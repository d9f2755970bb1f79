"""The built-in head: `head.glb`, made by `tools/figure/make_head.py`; see NOTICE.txt for its origin.

`levels.glb`, made by `tools/figure/make_levels.py`, holds its levels of detail.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import as_file, files
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fba.face.model import FaceModel


@cache
def default() -> FaceModel:
    """Return the built-in head with its levels of detail, which have no tables; read on first use."""
    from dataclasses import replace

    from fba.face._expressions import Definitions
    from fba.face.gltf._storage import load

    folder = files(__package__)
    with as_file(folder / "head.glb") as path, as_file(folder / "levels.glb") as levels_path:
        head, levels = load(path), []
        for level in load(levels_path).levels:  # with the materials of the head, which has the pictures
            parts = [replace(part, material=head.part(part.name).material) for part in level.model.parts]
            levels.append(replace(level, model=replace(level.model, parts=tuple(parts))))
        # The current definitions, so that visemes can be tuned without a new head.glb.
        return replace(head, definitions=Definitions.default(), levels=tuple(levels))
