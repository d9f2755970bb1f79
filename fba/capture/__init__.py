"""Motion capture -> FAPs and BAPs."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fba.capture.motion import SkeletonMotion
    from fba.capture.skeleton import from_skeleton

_PLACES = {"SkeletonMotion": "fba.capture.motion", "from_skeleton": "fba.capture.skeleton"}

__all__ = ["SkeletonMotion", "from_skeleton"]


def __getattr__(name: str) -> Any:
    if name not in _PLACES:
        raise AttributeError(f"module 'fba.capture' has no attribute {name!r}")
    value = getattr(import_module(_PLACES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
