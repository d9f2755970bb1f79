"""Vertex normals of a triangulated surface."""

from fba.mesh import vertex_normals

__all__ = ["vertex_normals"]
