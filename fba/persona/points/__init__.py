"""The tracked points of a face, and the control mask of 86 vertices that is computed from them.

May use: the face, and `fba.capture.points`, which knows the trackers.
"""

from fba.persona.points._tracked import Registered, TrackedFace, fit_face_points, from_point_motion, register
from fba.persona.points.layout import mask_distance

__all__ = ["Registered", "TrackedFace", "fit_face_points", "from_point_motion", "mask_distance", "register"]
