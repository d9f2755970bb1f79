"""What a tracker sees of a face, and the control mask of 86 vertices that is made of it.

May use: the face, and what `fba.capture.points` says of trackers.
"""

from fba.persona.points._adaptation import from_point_motion
from fba.persona.points._distances import hausdorff_distance, mask_distance
from fba.persona.points._procrustes import fit_similarity
from fba.persona.points._registration import Registered, register
from fba.persona.points._tracked import TrackedFace

__all__ = [
    "Registered",
    "TrackedFace",
    "fit_similarity",
    "from_point_motion",
    "hausdorff_distance",
    "mask_distance",
    "register",
]
