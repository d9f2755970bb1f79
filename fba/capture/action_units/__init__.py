"""Action units of a captured face to FAPs, by the shapes that they stand for.

May use: parameters, the face, and blendshapes.
"""

from fba.capture.action_units._motion import ActionUnitMotion
from fba.capture.action_units.conversion import from_action_units

__all__ = ["ActionUnitMotion", "from_action_units"]
