"""Points that a tracker finds on a face in a film, to FAPs: size and depth made good, places on the face.

May use: parameters, the face, markers, and the modules of `fba` itself.
"""

from fba.capture.points._conversion import find_point_face, from_points
from fba.capture.points._motion import PointMotion

__all__ = ["PointMotion", "find_point_face", "from_points"]
