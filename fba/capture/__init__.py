"""Motion capture -> FAPs and BAPs."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fba.capture._report import BoneError, FeetError, RetargetReport, retarget_report
    from fba.capture.motion import SkeletonMotion
    from fba.capture.skeleton import from_skeleton

_MODULE_OF = {
    "BoneError": "fba.capture._report",
    "FeetError": "fba.capture._report",
    "RetargetReport": "fba.capture._report",
    "SkeletonMotion": "fba.capture.motion",
    "from_skeleton": "fba.capture.skeleton",
    "retarget_report": "fba.capture._report",
}

__all__ = [
    "BoneError",
    "FeetError",
    "RetargetReport",
    "SkeletonMotion",
    "from_skeleton",
    "retarget_report",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'fba.capture' has no attribute {name!r}")
    value = getattr(import_module(_MODULE_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
