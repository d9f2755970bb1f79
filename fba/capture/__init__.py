"""Motion capture to BAPs: matched joints, aligned rest poses, turned bones, planted feet, measured errors.
Captured faces to FAPs: blendshapes, action units, markers, tracked points.

May use: parameters, face and body, and the modules of `fba` itself.
"""

from fba.capture._report import BoneError, FeetError, RetargetReport, retarget_report
from fba.capture.action_units import ActionUnitMotion, from_action_units
from fba.capture.blendshapes import ShapeMotion, from_blendshapes, to_blendshapes
from fba.capture.markers import MarkerMotion, from_markers
from fba.capture.motion import SkeletonMotion
from fba.capture.points import PointMotion, from_points
from fba.capture.skeleton import from_skeleton

__all__ = [
    "ActionUnitMotion",
    "BoneError",
    "FeetError",
    "MarkerMotion",
    "PointMotion",
    "RetargetReport",
    "ShapeMotion",
    "SkeletonMotion",
    "from_action_units",
    "from_blendshapes",
    "from_markers",
    "from_points",
    "from_skeleton",
    "retarget_report",
    "to_blendshapes",
]
