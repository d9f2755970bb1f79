"""The built-in head: `head.glb`, made by `tools/figure/make_head.py`; see NOTICE.txt for its origin."""

from __future__ import annotations

from functools import cache
from importlib.resources import as_file, files
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fba.face.model import FaceModel


@cache
def default() -> FaceModel:
    """Return the built-in head; read on first use."""
    from dataclasses import replace

    from fba.face._expressions import Definitions
    from fba.face.gltf._storage import load

    with as_file(files(__package__) / "head.glb") as path:
        # The current definitions, so that visemes can be tuned without a new head.glb.
        return replace(load(path), definitions=Definitions.default())
