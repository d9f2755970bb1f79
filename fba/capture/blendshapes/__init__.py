"""Captured faces to FAPs: weights of ARKit's 52 shapes and of others with known names, and action units.

May use: parameters, the face, and what `fba.capture` says of times.
"""

from fba.capture.blendshapes._inversion import shown_weights, to_blendshapes
from fba.capture.blendshapes._motion import ActionUnitMotion, ShapeMotion
from fba.capture.blendshapes.conversion import from_action_units, from_blendshapes
from fba.capture.blendshapes.shape_table import shape_faps

__all__ = [
    "ActionUnitMotion", "ShapeMotion", "from_action_units", "from_blendshapes", "shape_faps",
    "shown_weights", "to_blendshapes",
]  # fmt: skip
