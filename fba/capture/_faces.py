"""The kinds of captured faces, and what makes an animation of each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from fba.capture.blendshapes import ActionUnitMotion, ShapeMotion, from_action_units, from_blendshapes
from fba.capture.markers import MarkerMotion, from_markers
from fba.capture.points import PointMotion, from_points

FaceCapture = ShapeMotion | ActionUnitMotion | MarkerMotion | PointMotion
CONVERSIONS: Mapping[type[FaceCapture], Callable[..., Any]] = {
    ShapeMotion: from_blendshapes,
    ActionUnitMotion: from_action_units,
    MarkerMotion: from_markers,
    PointMotion: from_points,
}
