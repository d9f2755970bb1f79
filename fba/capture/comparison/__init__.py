"""A captured motion beside the person that a decoder shows: measures, and a verdict.

The source's bones come from its forward kinematics, those of the result from BAPs. What retargeting assumes
of rest poses is not used, so that a wrong rest pose shows.

May use: parameters, the body, and captured motion.
"""

from fba.capture.comparison._figure import Figure, find_up, source_figure
from fba.capture.comparison._measurement import compare, source_scale
from fba.capture.comparison._stick import Stick, find_sticks
from fba.capture.comparison._verdict import GRADES, Bounds, Comparison, Difference, bounds

__all__ = [
    "GRADES", "Bounds", "Comparison", "Difference", "Figure", "Stick", "bounds", "compare", "find_sticks",
    "find_up", "source_figure", "source_scale",
]  # fmt: skip
