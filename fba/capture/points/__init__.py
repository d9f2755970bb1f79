"""Points that a tracker finds on a face in a film, to FAPs: size and depth made good, places on the face.

May use: parameters, the face, markers, and the modules of `fba` itself.
"""

from fba.capture.points.conversion import from_points
from fba.capture.points.motion import PointMotion

__all__ = ["PointMotion", "from_points"]
