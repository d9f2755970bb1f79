"""Vertex normals of a triangulated surface."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Float32 = npt.NDArray[np.float32]


def vertex_normals(vertices: npt.NDArray[np.floating], triangles: npt.NDArray[np.integer]) -> Float32:
    """Unit normals weighted by area: float32 (V, 3); +z where no triangle touches a vertex."""
    corners = np.asarray(vertices, dtype=np.float64)[triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    summed = np.zeros((len(vertices), 3))
    for corner in range(3):
        for axis in range(3):
            summed[:, axis] += np.bincount(triangles[:, corner], faces[:, axis], minlength=len(vertices))
    length = np.linalg.norm(summed, axis=1, keepdims=True)
    unit = np.where(length > 1e-20, summed / np.maximum(length, 1e-20), (0.0, 0.0, 1.0))
    return unit.astype(np.float32)
