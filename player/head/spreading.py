"""Weights spread over a mesh: biharmonic, so that motion dies away smoothly between what is given."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Float64 = npt.NDArray[np.float64]
Int32 = npt.NDArray[np.int32]

LEAST = 1e-3
"""Smaller weights are left out."""


def spread(vertices: Float64, triangles: Int32, given: Float64, known: npt.NDArray[np.bool_]) -> Float64:
    """Weights (V, K) of all vertices: as given where known, between them with the least bending.

    vertices (V, 3), triangles (F, 3). given (V, K): read where known (V,) is True. A mesh with holes is
    spread over round them.
    """
    from scipy.sparse import diags
    from scipy.sparse.linalg import splu

    weights = np.where(known[:, None], given, 0.0)
    laplacian, mass = _laplacian(vertices, triangles)
    bending = (laplacian.T @ diags(1 / mass) @ laplacian).tocsc()
    free = np.flatnonzero(~known)
    fixed = np.flatnonzero(known)
    active = np.flatnonzero(np.abs(weights).sum(axis=0) > 0)
    solver = splu(bending[free][:, free].tocsc())
    weights[np.ix_(free, active)] = solver.solve(-(bending[free][:, fixed] @ weights[np.ix_(fixed, active)]))
    weights[np.abs(weights) < LEAST] = 0.0
    return weights


def _laplacian(vertices: Float64, triangles: Int32) -> tuple[Any, Float64]:
    """Cotangent Laplacian (positive semidefinite) and the area that belongs to each vertex."""
    from scipy.sparse import coo_matrix, diags

    count = len(vertices)
    rows, columns, values = [], [], []
    mass = np.zeros(count)
    for i in range(3):
        a, b, c = triangles[:, i], triangles[:, (i + 1) % 3], triangles[:, (i + 2) % 3]
        u, v = vertices[a] - vertices[c], vertices[b] - vertices[c]
        cross = np.linalg.norm(np.cross(u, v), axis=1)
        cotangent = np.clip((u * v).sum(axis=1) / np.maximum(cross, 1e-12), 0.02, 20.0) / 2
        rows += [a, b]
        columns += [b, a]
        values += [-cotangent, -cotangent]
        mass += np.bincount(a, cross / 6, minlength=count)
    flat = np.concatenate(values)
    matrix = coo_matrix((flat, (np.concatenate(rows), np.concatenate(columns))), shape=(count, count)).tocsr()
    degree = np.asarray(matrix.sum(axis=1)).ravel()
    return matrix - diags(degree), np.maximum(mass, 1e-9)
