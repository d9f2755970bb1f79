"""Motion capture to BAPs: matched joints, aligned rest poses, turned bones, planted feet, measured errors.
Captured faces to FAPs: blendshapes.

May use: parameters, face and body, and the modules of `fba` itself.
"""

from fba.capture._report import BoneError, FeetError, RetargetReport, retarget_report
from fba.capture.blendshapes import ShapeMotion, from_blendshapes, to_blendshapes
from fba.capture.motion import SkeletonMotion
from fba.capture.skeleton import from_skeleton

__all__ = [
    "BoneError",
    "FeetError",
    "RetargetReport",
    "ShapeMotion",
    "SkeletonMotion",
    "from_blendshapes",
    "from_skeleton",
    "retarget_report",
    "to_blendshapes",
]
