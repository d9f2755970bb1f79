"""Action units of a captured face to FAPs, by the shapes that they stand for.

May use: parameters, the face, and blendshapes.
"""

from fba.capture.action_units.conversion import from_action_units
from fba.capture.action_units.motion import ActionUnitMotion

__all__ = ["ActionUnitMotion", "from_action_units"]
