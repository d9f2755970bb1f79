"""Depth maps of scanned faces: rasterised clouds, holes filled, the face cut out and its outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64
from fba.errors import ModelError

STEP = 1.0
"""Millimetres of a cell."""
LARGEST = 1000
"""Cells along a side of a map at most."""
BEHIND_BROW, BEFORE_TIP = 10.0, 5.0
"""Millimetres behind the end of a brow and before the tip of the nose between which the face is: the
source's 1 and 0.5 cm."""
NEIGHBOURS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))


@dataclass(frozen=True, eq=False)
class DepthMap:
    """Depth over a grid. depth: float64 (R, C), millimetres towards the camera, NaN where nothing was
    measured; row 0 is the lowest. corner: (2,), x and y of cell (0, 0)."""

    depth: Float64
    corner: Float64

    def cells(self, places: Float64) -> Float64:
        """Return rows and columns (N, 2), not rounded, of places (N, 2)."""
        return np.asarray(((places - self.corner) / STEP)[:, ::-1])

    def look_up(self, places: Float64) -> Float64:
        """Return the depth (N,) at places (N, 2); NaN beside the map."""
        cells = np.rint(self.cells(places)).astype(int)
        inside = ((cells >= 0) & (cells < self.depth.shape)).all(axis=1)
        deep = np.full(len(places), np.nan)
        deep[inside] = self.depth[cells[inside, 0], cells[inside, 1]]
        return deep


def make_depth_map(points: Float64) -> DepthMap:
    """Return the map of a cloud (N, 3): of several points in a cell, the mean. Raises ModelError for a
    cloud that is too large."""
    corner = points[:, :2].min(axis=0)
    cells = np.rint((points[:, :2] - corner) / STEP).astype(np.int64)[:, ::-1]
    shape = cells.max(axis=0) + 1
    if shape.max() > LARGEST:
        raise ModelError(
            f"the cloud is {STEP * shape.max():.0f} mm wide; a face has {STEP * LARGEST:.0f} at most"
        )
    flat = cells[:, 0] * shape[1] + cells[:, 1]
    count = np.bincount(flat, minlength=int(shape.prod()))
    total = np.bincount(flat, points[:, 2], minlength=int(shape.prod()))
    depth = np.where(count > 0, total / np.maximum(count, 1), np.nan)
    return DepthMap(depth.reshape(shape), corner)


def fill_holes(map_: DepthMap, places: Float64) -> DepthMap:
    """Return the map without holes inside the hull of some places (N, 2), which the source fills cell by
    cell.

    A cell without depth gets the mean of its neighbours (of 8) that have one; cells whose turn has not come
    get theirs from those. Row by row, so that a filled cell is a neighbour at once.
    """
    from scipy.spatial import Delaunay

    depth = map_.depth.copy()
    rows, columns = depth.shape
    grid = (
        np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2) * STEP
        + map_.corner
    )
    inside = (Delaunay(places).find_simplex(grid) >= 0).reshape(depth.shape)
    near = np.rint(map_.cells(places)).astype(int)
    valid = ((near >= 0) & (near < depth.shape)).all(axis=1)
    inside[near[valid, 0], near[valid, 1]] = True
    holes = [(int(row), int(column)) for row, column in np.argwhere(inside & np.isnan(depth))]
    while holes:
        left = []
        for row, column in holes:
            around = [
                depth[row + down, column + right]
                for down, right in NEIGHBOURS
                if 0 <= row + down < rows and 0 <= column + right < columns
            ]
            known = [one for one in around if not np.isnan(one)]
            if known:
                depth[row, column] = sum(known) / len(known)
            else:
                left.append((row, column))
        if len(left) == len(holes):
            break  # a part of the map without any depth
        holes = left
    return DepthMap(depth, map_.corner)


def cut_out_face(map_: DepthMap, tip: float, brow: float) -> Bool:
    """Return the cells (R, C) of the face: neither ears, neck nor the top of the head.

    tip, brow: depth of the nose's tip and of the outer end of a brow. Depth grows towards the camera, so
    the face is before the brow less 1 cm; the source's formula has depth grow the other way.
    """
    with np.errstate(invalid="ignore"):
        return np.asarray((map_.depth > brow - BEHIND_BROW) & (map_.depth < tip + BEFORE_TIP))


def find_outline(map_: DepthMap, tip: float, brow: float, count: int = 16) -> Float64:
    """Return points (count, 2) of the face's outline on rays from its middle, counter-clockwise from +x.

    The face is cut out, its edge found by Sobel's operator and dilated by 3 x 3; of each ray the outermost
    cell of the edge counts. Raises ModelError where a ray meets none.
    """
    from scipy import ndimage

    face = cut_out_face(map_, tip, brow).astype(np.float64)
    face = np.pad(face, 1)
    slope = np.hypot(ndimage.sobel(face, axis=0), ndimage.sobel(face, axis=1))
    edge = ndimage.binary_dilation(slope > 0, np.ones((3, 3)))
    cells = np.argwhere(edge)
    if not len(cells):
        raise ModelError(
            "no face could be cut out of the cloud: is z depth towards the camera, in millimetres?"
        )
    middle = cells.mean(axis=0)
    angles = np.arctan2(*(cells - middle).T)
    far = np.linalg.norm(cells - middle, axis=1)
    found = []
    for ray in 2 * np.pi * np.arange(count) / count:
        off = np.abs((angles - ray + np.pi) % (2 * np.pi) - np.pi) * far
        hit = np.flatnonzero(off <= 1.0)
        if not len(hit):
            raise ModelError("the outline of the face is open")
        reach = far[hit].max() - 2.0  # of the dilated edge, which is wider by a cell and by Sobel's one
        found.append(middle + reach * np.array([np.sin(ray), np.cos(ray)]))
    places = (np.array(found) - 1.0)[:, ::-1]
    return np.asarray(places * STEP + map_.corner)
