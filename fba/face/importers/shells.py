"""Polygons that hang together: the shells of a mesh."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.face.importers.polygons import Polygons

Bool = npt.NDArray[np.bool_]


def shells(polygons: Polygons) -> list[Bool]:
    """Masks bool (F,) of the polygons of each connected shell, by lowest vertex number."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    sizes = np.diff(polygons.starts)
    first = np.repeat(polygons.corners[polygons.starts[:-1]], sizes)
    count = len(polygons.vertices)
    links = (np.ones(len(first), dtype=np.int8), (first, polygons.corners))
    total, label = connected_components(coo_array(links, shape=(count, count)), directed=False)
    of_face = label[polygons.corners[polygons.starts[:-1]]]
    return [of_face == shell for shell in range(total) if (of_face == shell).any()]
