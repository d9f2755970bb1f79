"""`make_animation`: captures of any kind become animations here, whatever file they come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from fba.capture._skeleton import Captured, SkeletonOptions, retarget_motion
from fba.capture.motion import SkeletonMotion
from fba.errors import warn
from fba.limits import DEFAULT_LIMITS, Limits
from fba.source import Path, naming_file

if TYPE_CHECKING:
    from fba.capture._faces import FaceCapture

_MARKERS = ("rate", "markers", "neutral", "gaze", "head_path")
_OPTIONS: Mapping[str, tuple[str, ...]] = {
    "skeleton": ("rate", *(field.name for field in fields(SkeletonOptions))),
    "shapes": ("rate",),
    "markers": _MARKERS,
    "points": (*_MARKERS, "aspect"),
}


def capture_options(kind: str) -> tuple[str, ...]:
    """Return the options of `make_animation` for a kind of capture; none for an unknown one.

    kind: "skeleton", "shapes" (also for action units), "markers" or "points".
    """
    return _OPTIONS.get(kind, ())


def make_animation(
    capture: SkeletonMotion | FaceCapture,
    rate: Fraction | int | str | None = None,
    *,
    path: Path,
    limits: Limits = DEFAULT_LIMITS,
    **options: Any,
) -> Captured:
    """Return the animation of a capture, together with the capture.

    rate: frames per second; None for that of the capture. path: its file, for messages. options: of a
    skeleton the fields of `SkeletonOptions`, of faces the options of `from_markers` and `from_points`. Warns
    (FbaWarning) of what the reader repaired. Raises FormatError where no animation can be made, and the
    errors of these functions.
    """
    for finding in getattr(capture, "findings", ()):
        warn(f"{path}: {finding}", stacklevel=4)
    with naming_file(path):
        if isinstance(capture, SkeletonMotion):
            return retarget_motion(capture, rate, SkeletonOptions(**options), limits=limits)
        from fba.capture._faces import CONVERSIONS  # a third of a second that a skeleton can do without

        return Captured(CONVERSIONS[type(capture)](capture, rate, limits=limits, **options), capture)
