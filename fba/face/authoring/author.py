"""From any head mesh and its 84 feature points to a face model with tables for every FAP."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy.typing as npt

from fba.face.expressions import Definitions
from fba.face.model import FaceModel, Part

if TYPE_CHECKING:
    from fba.face.interpolation_table import InterpolationTable


def author(
    parts: Sequence[Part],
    points: npt.ArrayLike,
    *,
    bound: npt.ArrayLike | None = None,
    name: str = "",
    definitions: Definitions | None = None,
    fit: InterpolationTable | None = None,
    notes: Mapping[str, str] | None = None,
) -> FaceModel:
    """A face whose tables are made from the shape of the mesh alone."""
    raise NotImplementedError("being written")
