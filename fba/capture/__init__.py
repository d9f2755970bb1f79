"""Motion capture to BAPs: matched joints, aligned rest poses, turned bones, planted feet, measured errors.

May use: parameters, the body, and the modules of `fba` itself.
"""

from fba.capture._report import BoneError, FeetError, RetargetReport, retarget_report
from fba.capture.motion import SkeletonMotion
from fba.capture.skeleton import from_skeleton

__all__ = [
    "BoneError",
    "FeetError",
    "RetargetReport",
    "SkeletonMotion",
    "from_skeleton",
    "retarget_report",
]
