"""A head's coarsest level of detail, for persons that are small on the screen.

Bounds: what is stored is checked to name vertices of the level that it belongs to.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from fba.arrays import Float32, Int32
from fba.face import Part
from fba.mesh.simplify import DetailLevels
from fba.parameters import FAP_COUNT
from fba_player._figure._face_parts import NORMAL_WEIGHT
from fba_player._figure.face import FaceFigure
from fba_player._figure.face_light import CLOSED, MOUTH_OPEN, UPPER_LIDS
from fba_player.view._view import CoarseShape, FaceShape

TOLERANCE = 0.0032
"""Root-mean-square error (m) of its parts, with the mouth shut and open and the eyes closed."""
ERROR = 0.0012
"""The error (m) that counts where levels are chosen: smaller, as the ones before are better than need be."""


def add_far_level(figure: FaceFigure, part: Part, shape: FaceShape, stored: dict[str, Any]) -> FaceShape:
    """Return a part of a face with one more level of detail; as it is without any, or with coarser ones.

    stored: what `load_baked` returns for the face.
    """
    if not shape.levels or shape.levels[-1].error >= ERROR:
        return shape
    last = shape.levels[-1]
    target = stored.get(f"{part.name}/far")
    if target is None or len(target) != len(last.rows) or target.max(initial=0) >= len(target):
        target = find_collapses(figure, part, last)
    kept = np.unique(target)
    number: Int32 = np.searchsorted(kept, target).astype(np.int32)
    corners = number[last.shape.triangles]
    a, b, c = corners.T
    texcoords, places = (
        None if array is None else np.ascontiguousarray(array[kept])
        for array in (last.shape.texcoords, last.shape.wrinkle_places)
    )
    coarse = replace(
        last.shape,
        triangles=np.ascontiguousarray(corners[(a != b) & (b != c) & (c != a)]),
        colours=last.shape.colours[kept],
        sway=last.shape.sway[kept],
        texcoords=texcoords,
        wrinkle_places=places,
        outer=None if last.shape.outer is None else number[last.shape.outer],
    )
    far = CoarseShape(
        coarse,
        last.rows[kept],
        last.weights[kept],
        last.heights[kept],
        number[last.parents],
        ERROR,
        last.whole,
    )
    return replace(shape, levels=(*shape.levels, far))


def find_collapses(figure: FaceFigure, part: Part, level: CoarseShape) -> Int32:
    """Return int32 (M,): the vertex of a level that each of its M collapses onto."""
    blinking = dict.fromkeys(UPPER_LIDS, CLOSED)
    posed = [_pose(figure, part, level, faps) for faps in ({}, MOUTH_OPEN, blinking)]
    columns = [positions for positions, _ in posed] + [posed[0][1] * NORMAL_WEIGHT]
    points = np.concatenate(columns, axis=1).astype(np.float32)
    return DetailLevels(points, len(posed), level.shape.triangles).targets_within(TOLERANCE)


def _pose(
    figure: FaceFigure, part: Part, level: CoarseShape, faps: dict[int, int]
) -> tuple[Float32, Float32]:
    """Return positions and normals (M, 3) of a level's vertices for some FAPs."""
    values = np.zeros(FAP_COUNT, dtype=np.float32)
    for fap, value in faps.items():
        values[fap - 1] = value
    normals = np.empty((len(figure.model.vertices), 3), dtype=np.float32)
    positions = figure.deformer.local(values, out=np.empty_like(normals), normals=normals)
    rows = figure.rows(part.name)
    at, out = (
        np.einsum("nk,nkd->nd", level.weights, array[rows][level.rows]) for array in (positions, normals)
    )
    return at + level.heights[:, None] * out, out
