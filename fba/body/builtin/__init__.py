"""The built-in person: `body.glb`, made by `tools/figure/make_body.py`; see NOTICE.txt for its origin."""

from __future__ import annotations

from functools import cache
from importlib.resources import as_file, files
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fba.body._model import BodyModel


@cache
def default() -> BodyModel:
    """Return the built-in person; read on first use."""
    from fba.body._storage import load

    with as_file(files(__package__) / "body.glb") as path:
        return load(path)
