"""Vertex normals of a triangulated surface."""

from fba.mesh.meshes import vertex_normals

__all__ = ["vertex_normals"]
