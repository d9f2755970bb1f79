"""Faces with fewer triangles that FAPs still move: simplified with all that they carry."""

from fba.face.simplification._faces import FaceSimplification, level_sizes, simplify_face

__all__ = ["FaceSimplification", "level_sizes", "simplify_face"]
