"""`from_action_units`: action units as FAPs."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import cache

import numpy as np

from fba.animation import Animation
from fba.capture.blendshapes._motion import ActionUnitMotion, ShapeMotion
from fba.capture.blendshapes.conversion import from_blendshapes
from fba.errors import ModelError
from fba.face import arkit_names
from fba.limits import DEFAULT_LIMITS, Limits
from fba.text_files import packaged_rows


def from_action_units(
    motion: ActionUnitMotion, rate: Fraction | int | str | None = None, *, limits: Limits = DEFAULT_LIMITS
) -> Animation:
    """Return the FAPs of a face whose action units were tracked.

    `unit_shapes.csv` says, from the definitions of FACS, which of ARKit's shapes an action unit of full
    intensity is; where several units use a shape, it has their sum, at most 1. `from_blendshapes` does the
    rest, and has the same arguments and errors. Raises ModelError if no action unit is known.
    """
    return from_blendshapes(to_shapes(motion), rate, limits=limits)


def to_shapes(motion: ActionUnitMotion) -> ShapeMotion:
    """Return the weights of ARKit's shapes for action units; ModelError if none is known."""
    known = [unit for unit in motion.units if unit in unit_shapes()]
    if not known:
        units = ", ".join(map(str, motion.units)) or "no unit"
        raise ModelError(f"no action unit is known here: {units}")
    used = [name for name in arkit_names() if any(name in unit_shapes()[unit] for unit in known)]
    weights = np.zeros((len(motion), len(used)))
    for column, unit in enumerate(motion.units):
        for name, share in unit_shapes().get(unit, {}).items():
            weights[:, used.index(name)] += share * motion.intensities[:, column]
    return ShapeMotion(
        tuple(used), np.minimum(weights, 1.0), motion.times, motion.rate,
        head=motion.head, eyes=motion.eyes, name=motion.name, findings=motion.findings,
    )  # fmt: skip


@cache
def unit_shapes() -> dict[int, Mapping[str, float]]:
    """Return weights of ARKit's shapes by name, for each action unit at full intensity, by its number."""
    table: dict[int, Mapping[str, float]] = {}
    for row in packaged_rows(__package__, "unit_shapes.csv"):
        shapes = {}
        for entry in row["shapes"].split():
            name, _, share = entry.partition("=")
            for side in ("Left", "Right") if "?" in name else ("",):
                shapes[name.replace("?", side)] = float(share)
        table[int(row["unit"])] = shapes
    return table
