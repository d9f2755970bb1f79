"""Blendshapes of a captured face to FAPs: the weights of ARKit's 52 shapes and of others with known names.

May use: parameters, the face, and what `fba.capture` says of times.
"""

from fba.capture.blendshapes._inversion import to_blendshapes
from fba.capture.blendshapes._motion import ShapeMotion
from fba.capture.blendshapes.conversion import from_blendshapes

__all__ = ["ShapeMotion", "from_blendshapes", "to_blendshapes"]
