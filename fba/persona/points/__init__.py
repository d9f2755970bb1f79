"""What a tracker sees of a face, and the control mask of 86 vertices that is made of it.

May use: the face, and what `fba.capture.points` says of trackers.
"""

from fba.persona.points.adaptation import from_point_motion
from fba.persona.points.distances import hausdorff_distance, mask_distance
from fba.persona.points.procrustes import fit_face_points
from fba.persona.points.registration import Registered, register
from fba.persona.points.tracked import TrackedFace

__all__ = [
    "Registered",
    "TrackedFace",
    "fit_face_points",
    "from_point_motion",
    "hausdorff_distance",
    "mask_distance",
    "register",
]
