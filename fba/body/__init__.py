"""The body: its skeleton, and the solver between body animation parameters and joint matrices."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fba.body._definition import BodyDefinition
    from fba.body.head_attachment import attach_head
    from fba.body.model import BodyModel
    from fba.body.skeleton import SIDES, Skeleton
    from fba.body.solve.conventions import convention_names
    from fba.body.solve.limits import Excess, JointLimit, JointLimits
    from fba.body.solve.solver import BapSolver, wrapped

_MODULE_OF = {
    "SIDES": "fba.body.skeleton",
    "BapSolver": "fba.body.solve.solver",
    "BodyDefinition": "fba.body._definition",
    "BodyModel": "fba.body.model",
    "Excess": "fba.body.solve.limits",
    "JointLimit": "fba.body.solve.limits",
    "JointLimits": "fba.body.solve.limits",
    "Skeleton": "fba.body.skeleton",
    "attach_head": "fba.body.head_attachment",
    "convention_names": "fba.body.solve.conventions",
    "wrapped": "fba.body.solve.solver",
}

__all__ = [
    "SIDES",
    "BapSolver",
    "BodyDefinition",
    "BodyModel",
    "Excess",
    "JointLimit",
    "JointLimits",
    "Skeleton",
    "attach_head",
    "convention_names",
    "wrapped",
]


def __getattr__(name: str) -> Any:
    if name == "gait":
        return import_module("fba.body.gait")
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'fba.body' has no attribute {name!r}")
    value = getattr(import_module(_MODULE_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
