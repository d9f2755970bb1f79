"""The medial axis of a silhouette: points that are equally far from several places of its outline.

There the vectors from the nearest places of the outline meet, so that the mean flux of these unit vectors
into a small circle is positive: Siddiqi, Bouix, Tannenbaum and Zucker, "Hamilton-Jacobi skeletons", 2002.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64
from fba.errors import FormatError

FLUX = 0.4
"""Mean flux from which a pixel lies on the medial axis; below, rounded corners would count."""
CELL = 6
"""Pixels, of a silhouette 96 pixels long, within which points become one node."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes on the medial axis of a silhouette.

    points: float64 (N, 2), x to the right and y up, pixels. radii: (N,), of the largest circles inside,
    pixels. masses: (N,), the sum of the radii that a node stands for. area: pixels of the silhouette.
    """

    points: Float64
    radii: Float64
    masses: Float64
    area: int


def medial_axis(mask: Bool) -> tuple[Float64, Float64]:
    """Return points (N, 2) of the medial axis, x to the right and y up, and their radii (N,), in pixels.

    The mask's border must be background. Raises FormatError for an empty mask.
    """
    from scipy import ndimage

    if not mask.any():
        raise FormatError("shows no figure: the outline is empty")
    radii, nearest = ndimage.distance_transform_edt(mask, return_indices=True)
    inward = (np.indices(mask.shape) - nearest) / np.maximum(radii, 1)
    circle = np.mgrid[-1:2, -1:2] / np.maximum(np.hypot(*np.mgrid[-1:2, -1:2]), 1)
    flux = -sum(ndimage.correlate(part, rays) for part, rays in zip(inward, circle, strict=True)) / 8
    on_axis = mask & ((flux > FLUX) | (radii == radii.max()))
    rows, columns = np.nonzero(on_axis)
    return np.column_stack([columns, -rows]).astype(np.float64), radii[on_axis]


def find_nodes(mask: Bool, cell: float = CELL) -> Nodes:
    """Return the nodes of a silhouette (H, W) with a border of background; see `fit_mask`.

    cell: pixels, the side of the squares whose points become one node. Raises FormatError for an empty mask.
    """
    points, radii = medial_axis(mask)
    cells = np.floor(points / cell).astype(np.int64)
    _, node = np.unique(cells, axis=0, return_inverse=True)
    node = node.reshape(-1)
    masses: Float64 = np.bincount(node, radii).astype(np.float64)
    means = [np.bincount(node, values * radii) / masses for values in (*points.T, radii)]
    return Nodes(np.column_stack(means[:2]), means[2], masses, int(mask.sum()))
