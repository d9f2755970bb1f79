"""Motion capture to BAPs: matched joints, aligned rest poses, turned bones, planted feet, measured errors.
Captured faces to FAPs: blendshapes, action units, markers, tracked points.

May use: parameters, face and body, and the modules of `fba` itself.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fba.capture._conversion import capture_options, make_animation
    from fba.capture._faces import FaceCapture
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
    from fba.capture.markers import MarkerMotion, from_markers
    from fba.capture.motion import SkeletonMotion
    from fba.capture.points import PointMotion, from_points

_NAMES = {
    "_conversion": ("capture_options", "make_animation"),
    "_faces": ("FaceCapture",),
    "_report": ("BoneError", "FeetError", "RetargetReport", "measure_bones", "retarget_report"),
    "_skeleton": ("Captured", "SkeletonOptions", "from_skeleton", "retarget_motion"),
    "blendshapes": (
        "ActionUnitMotion", "ShapeMotion", "from_action_units", "from_blendshapes", "shape_faps",
        "shown_weights", "to_blendshapes",
    ),
    "markers": ("MarkerMotion", "from_markers"),
    "motion": ("SkeletonMotion",),
    "points": ("PointMotion", "from_points"),
}  # fmt: skip
"""Public names by the module that they are imported from, on first use."""

__all__ = [
    "ActionUnitMotion", "BoneError", "Captured", "FaceCapture", "FeetError", "MarkerMotion", "PointMotion",
    "RetargetReport", "ShapeMotion", "SkeletonMotion", "SkeletonOptions", "capture_options",
    "from_action_units", "from_blendshapes", "from_markers", "from_points", "from_skeleton",
    "make_animation", "measure_bones", "retarget_motion", "retarget_report", "shape_faps", "shown_weights",
    "to_blendshapes",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    module = next((module for module, names in _NAMES.items() if name in names), None)
    if module is None:
        raise AttributeError(f"module 'fba.capture' has no attribute {name!r}")
    globals()[name] = value = getattr(import_module(f"fba.capture.{module}"), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
