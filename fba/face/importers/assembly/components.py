"""Pieces of a mesh that hang together: its shells."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.mesh.polygons import Polygons

Bool = npt.NDArray[np.bool_]
Int = npt.NDArray[np.intp]


def shells(polygons: Polygons) -> list[Bool]:
    """Masks bool (F,) of the polygons of each connected shell, by lowest vertex number."""
    sizes = np.diff(polygons.starts)
    first = np.repeat(polygons.corners[polygons.starts[:-1]], sizes)
    label = _connected(first, polygons.corners, len(polygons.vertices))
    of_face = label[polygons.corners[polygons.starts[:-1]]]
    return [of_face == shell for shell in np.unique(of_face)]


def shell_labels(triangles: npt.NDArray[np.int32], count: int, vertices: npt.NDArray[np.float32]) -> Int:
    """(count,) shell of each vertex, vertices at the same place taken as one (seams of textures)."""
    _, same = np.unique(vertices, axis=0, return_inverse=True)
    place = same.reshape(-1)
    a, b, c = place[triangles].T if len(triangles) else (place[:0],) * 3
    label = _connected(np.concatenate([a, b]), np.concatenate([b, c]), int(place.max()) + 1)
    return np.asarray(label[place], dtype=np.intp)


def _connected(a: npt.NDArray[np.integer], b: npt.NDArray[np.integer], count: int) -> Int:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = (np.ones(len(a), dtype=np.int8), (a, b))
    labels: Int = connected_components(coo_array(links, shape=(count, count)), directed=False)[1]
    return labels
