"""Motion capture to BAPs: matched joints, aligned rest poses, turned bones, planted feet, measured errors.
Captured faces to FAPs: blendshapes, action units, markers, tracked points.

May use: parameters, face and body, and the modules of `fba` itself.
"""

from fba.capture._conversion import FaceCapture, capture_options, make_animation
from fba.capture._report import BoneError, FeetError, RetargetReport, measure_bones, retarget_report
from fba.capture._skeleton import Captured, SkeletonOptions, from_skeleton, retarget_motion
from fba.capture.blendshapes import (
    ActionUnitMotion,
    ShapeMotion,
    from_action_units,
    from_blendshapes,
    shape_faps,
    shown_weights,
    to_blendshapes,
)
from fba.capture.markers._faces import from_markers
from fba.capture.markers._motion import MarkerMotion
from fba.capture.motion import SkeletonMotion
from fba.capture.points import PointMotion, from_points

__all__ = [
    "ActionUnitMotion",
    "BoneError",
    "Captured",
    "FaceCapture",
    "FeetError",
    "MarkerMotion",
    "PointMotion",
    "RetargetReport",
    "ShapeMotion",
    "SkeletonMotion",
    "SkeletonOptions",
    "capture_options",
    "from_action_units",
    "from_blendshapes",
    "from_markers",
    "from_points",
    "from_skeleton",
    "make_animation",
    "measure_bones",
    "retarget_motion",
    "retarget_report",
    "shape_faps",
    "shown_weights",
    "to_blendshapes",
]
