"""Meshes with fewer triangles: memoryless collapses over several poses, and quadrics beside them."""

from fba.mesh.simplify._memoryless import (
    Level,
    Simplification,
    place_on_level,
    place_on_triangles,
    simplify,
)
from fba.mesh.simplify._quadrics import TOLERANCES, DetailLevels, simplify_by_quadrics

__all__ = [
    "TOLERANCES",
    "DetailLevels",
    "Level",
    "Simplification",
    "place_on_level",
    "place_on_triangles",
    "simplify",
    "simplify_by_quadrics",
]
