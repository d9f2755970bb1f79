"""Vertices and normals of a face for given FAPs: compiled loops over a model's tables."""
