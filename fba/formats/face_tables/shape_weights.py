"""Names and weights of shapes, as files and live captures have them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np

from fba.arrays import Float64
from fba.capture.blendshapes.shape_table import key_of
from fba.errors import FormatError
from fba.face.shape_names import arkit_names, arkit_of
from fba.source import Path

MAX_WEIGHT = 4.0
"""Largest weight; more is no share of a shape."""


@cache
def shape_of(name: str) -> str | None:
    """Return ARKit's name of a shape, from a name in any case; None if it is not one of the 52."""
    return _shapes().get(key_of(name)) or arkit_of(name)


@cache
def _shapes() -> dict[str, str]:
    return {key_of(name): name for name in arkit_names()}


def check_weights(
    weights: Float64, names: Sequence[str], path: Path, lines: Sequence[int] | None = None
) -> None:
    """Raise FormatError for weights (T, N) that are no shares of 1. lines: (T,), where the file has lines."""
    far = np.abs(weights) > MAX_WEIGHT
    if not far.any():
        return
    row, column = np.argwhere(far)[0]
    value = float(weights[row, column])
    hint = "; are these percent?" if np.nanmax(np.abs(weights)) <= 100 else ""
    place = f"frame {row}: " if lines is None else ""
    raise FormatError(
        f"{place}{names[column]} has the weight {value:g}; expected 0 to 1{hint}",
        path=path,
        line=None if lines is None else lines[row],
    )
