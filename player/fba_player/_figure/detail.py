"""Which level of detail a part is drawn at, and the vertices that are moved for that and coarser ones."""

from __future__ import annotations

import math
from bisect import bisect_right

import numpy as np

from fba.arrays import Bool, Int32
from fba.mesh.simplify import TOLERANCES
from fba_player._figure._face_parts import join_pieces
from fba_player.view._view import FaceShape

MAX_ERROR_PIXELS = 1.3
"""Largest error of a coarser mesh of a body, in pixels."""
MAX_FACE_ERROR_PIXELS = 0.3
"""Largest root-mean-square error of a face's level of detail, in pixels."""
FAINTEST_HAIR, PIXELS_OF_HAIR = 0.25, 0.6
"""How faint narrow hairs become at most, and half the width (pixels) that they have then, as in
shaders/face.vert: of lashes that are narrower still, fewer are drawn, or they would be too dark."""
MOST_HALVINGS = 5
"""How often the number of lashes is halved at most."""
SAMPLED_VERTICES = 24
"""Number of vertices from which the distance to the camera is taken."""


def choose_level(shape: FaceShape, pixel: float) -> int:
    """Return the number of a part's level of detail, 0 for all triangles, where a pixel is so wide (m)."""
    if shape.across is not None:  # locks of hair lie over each other: fewer would show the skin
        return _halvings(shape, pixel) if shape.kind == "lash" else 0
    if shape.coarser is not None:
        return bisect_right(TOLERANCES, MAX_ERROR_PIXELS * pixel)
    return bisect_right([level.error for level in shape.levels], MAX_FACE_ERROR_PIXELS * pixel)


def level_triangles(shape: FaceShape, number: int) -> Int32 | None:
    """Return int32 (F, 3): the triangles of a level of a body's part or of hairs; None for all."""
    if number and shape.coarser is not None:
        return shape.coarser.triangles_within(TOLERANCES[number - 1])
    return _fewer_hairs(shape.triangles, number) if number and shape.across is not None else None


def needed_vertices(shape: FaceShape, number: int) -> Bool:
    """Return the mask (V,) of the vertices of a part that its levels from this number on are made of."""
    needed = np.full(len(shape.sway), number == 0)
    needed[sampled(len(needed))] = True
    if number and shape.levels:
        for level in shape.levels[number - 1 :]:
            needed[level.rows] = True
        return needed
    for coarser in range(number, MOST_HALVINGS + 1 if shape.coarser is None else len(TOLERANCES) + 1):
        triangles = level_triangles(shape, coarser)
        needed[... if triangles is None else triangles] = True
    return needed


def sampled(count: int) -> slice:
    """Return which of a number of vertices give a part's distance to the camera."""
    return slice(None, None, max(count // SAMPLED_VERTICES, 1))


def _halvings(shape: FaceShape, pixel: float) -> int:
    """Return how often the number of a part's hairs is halved where a pixel is so wide (m)."""
    narrow = FAINTEST_HAIR * PIXELS_OF_HAIR * pixel / max(shape.hair_width, 1e-9)
    return min(int(math.log2(max(narrow, 1.0))), MOST_HALVINGS)


def _fewer_hairs(triangles: Int32, halvings: int) -> Int32:
    """Return the triangles (F, 3) of every second, fourth ... hair."""
    edges = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.intp)
    hair = join_pieces(np.concatenate([edges, edges[:, ::-1]]), int(triangles.max(initial=0)) + 1)
    number = np.unique(hair[triangles[:, 0]], return_inverse=True)[1].ravel()
    return np.ascontiguousarray(triangles[number % 2**halvings == 0])
