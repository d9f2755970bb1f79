"""Meshes with fewer triangles: memoryless collapses over several poses, and quadrics beside them."""

from fba.mesh.simplify._memoryless import (
    Level,
    Simplification,
    carry_parts,
    part_looks,
    part_starts,
    place_on_full,
    place_on_level,
    simplify,
)
from fba.mesh.simplify._quadrics import TOLERANCES, DetailLevels, simplify_by_quadrics

__all__ = [
    "TOLERANCES",
    "DetailLevels",
    "Level",
    "Simplification",
    "carry_parts",
    "part_looks",
    "part_starts",
    "place_on_full",
    "place_on_level",
    "simplify",
    "simplify_by_quadrics",
]
