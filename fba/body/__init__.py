"""The body: its skeleton, and the solver between body animation parameters and joint matrices."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fba.body._definition import BodyDefinition
    from fba.body._model import BodyModel, BodyPart
    from fba.body._skeleton import ROOT, SIDES, Skeleton
    from fba.body.footing import GroundedPoser
    from fba.body.head_attachment import AttachedHead, attach_head
    from fba.body.solve.conventions import convention_names
    from fba.body.solve.limits import Excess, JointLimit, JointLimits
    from fba.body.solve.solver import BapSolver, wrapped
    from fba.body.stance import find_stance

_NAMES = {
    "_definition": ("BodyDefinition",),
    "footing": ("GroundedPoser",),
    "head_attachment": ("AttachedHead", "attach_head"),
    "_model": ("BodyModel", "BodyPart"),
    "_skeleton": ("ROOT", "SIDES", "Skeleton"),
    "solve.conventions": ("convention_names",),
    "solve.limits": ("Excess", "JointLimit", "JointLimits"),
    "solve.solver": ("BapSolver", "wrapped"),
    "stance": ("find_stance",),
}
"""Public names by the module that they are imported from, on first use."""

__all__ = [
    "ROOT", "SIDES", "AttachedHead", "BapSolver", "BodyDefinition", "BodyModel", "BodyPart", "Excess",
    "GroundedPoser", "JointLimit", "JointLimits", "Skeleton", "attach_head", "convention_names",
    "find_stance", "wrapped",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    if name == "gait":
        return import_module("fba.body.gait")
    module = next((module for module, names in _NAMES.items() if name in names), None)
    if module is None:
        raise AttributeError(f"module 'fba.body' has no attribute {name!r}")
    globals()[name] = value = getattr(import_module(f"fba.body.{module}"), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
