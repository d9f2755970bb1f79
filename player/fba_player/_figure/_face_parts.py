"""Constant data of a face's parts: shapes with colours, pictures and hairs, and how far its neck bends."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32, Intp
from fba.compiled import is_compiled
from fba.errors import FbaWarning
from fba.face import FaceModel, Part
from fba.mesh import vertex_normals
from fba.mesh.simplify import TOLERANCES, DetailLevels, place_on_full
from fba.parameters import point_rows
from fba.rotations import unit
from fba.sampling import smoothstep
from fba_player._figure.wrinkles import place_wrinkles
from fba_player._mesh.textures import RELIEF, FacePicture, load_picture, texture_breadth
from fba_player.view._view import CoarseShape, FaceShape

if TYPE_CHECKING:
    from fba.body import BodyModel, BodyPart


NEWTON_STEPS, FARTHEST_OUTSIDE = 6, 1.0
"""Steps in which a place on a triangle is looked for, and how far outside, by weights, it may be."""
SCATTER = {"skin": 1.0, "tongue": 0.8, "mouth": 0.8, "teeth": 0.5, "eye": 0.3}
TWO_SIDED = ("brow", "lash", "hair", "other", "teeth", "tongue")
HAIRY = ("lash", "brow", "hair")
MAX_HAIR_WIDTH = 0.0012
"""Strips wider than this (m) are not single hairs."""
RELIEF_STRENGTHS = {"skin": 0.45, "cloth": 0.22}
"""Strength of the relief of skin and of woven cloth."""
NECK_LENGTH = 2.3
"""Length over which the neck bends, in multiples of the eye-nose separation (ENS)."""
MAX_BENT_SHARE = 0.1
"""Light is computed for every pixel if more than this share of a part's edges are long and bent."""
BENT_COSINE = 0.8
"""An edge is bent if the cosine between the normals at its ends is below this."""
LONG_EDGE = 0.005
"""An edge is long from this length on, metres."""
NORMAL_WEIGHT = 0.002
"""Error in metres that weighs as much in simplification as a normal off by its length."""
TEXTURE_WEIGHT = 0.5
"""The same for texture coordinates off by a metre on the surface."""
COLOUR_WEIGHT = 0.004
"""The same for a colour off by its whole range."""


def compute_sway(model: FaceModel) -> Float32:
    """Return float32 (V,): share of the head's turn, from 1 above jaw and ears to 0 down the neck."""
    chin = middle_of_points(model, ("2.1", "2.10"))
    lobe = middle_of_points(model, ("10.7", "10.8", "10.5", "10.6", "7.1"))
    if chin is None or lobe is None:
        return np.ones(len(model.vertices), dtype=np.float32)
    reach = NECK_LENGTH * model.fapu.ENS * 1024
    y, z = model.vertices[:, 1].astype(np.float64), model.vertices[:, 2].astype(np.float64)
    # The border between head and neck rises from below the chin to below the ears, and is level behind them.
    along = np.clip((z - lobe[2]) / max(chin[2] - lobe[2], 1e-6), 0.0, 1.0)
    border = lobe[1] + (chin[1] - 0.12 * reach - lobe[1]) * along
    return smoothstep(1 - (border - y) / reach).astype(np.float32)


def middle_of_points(model: FaceModel, names: Sequence[str]) -> Float64 | None:
    """Return (3,): the middle of the first two of the named feature points that the face has, or None."""
    points = np.array([model.points[point_rows()[name]] for name in names])
    first = points[np.isfinite(points).all(axis=1)][:2]
    return np.asarray(first.mean(axis=0)) if len(first) else None


def make_shape(part: Part, sways: Float32) -> FaceShape:
    """Return the constant data of a part. sways: (V,), how far its vertices turn with the head."""
    picture = part_picture(part)
    return FaceShape(
        part.triangles,
        part_colours(part, part.material.colour),
        sways if part.kind in ("skin", "hair", "other") else np.ones_like(sways),
        part.texcoords,
        picture,
        SCATTER.get(part.kind, 0.0),
        _relief(part),
        part.kind in TWO_SIDED or part.material.two_sided,
        find_hairs(part) if part.kind in HAIRY and picture is None else None,
        name=part.name,
        kind=part.kind,
        smooth=_is_smooth(part),
        alpha=part.material.alpha,
        opacity=part.material.opacity,
        cutoff=part.material.cutoff,
    )


def detail_levels(part: BodyPart, more: Float32, stored: dict[str, Any]) -> DetailLevels:
    """Return the levels of detail of a body's part. more: (V, N), attributes to preserve besides normals,
    colours and texture, scaled to metres. stored: what `load_baked` returns for the body."""
    columns = [part.vertices]
    if part.normals is not None:
        columns.append(part.normals * NORMAL_WEIGHT)
    if part.texcoords is not None and len(part.triangles):
        metres = texture_breadth(part.vertices, part.texcoords, part.triangles)
        columns.append(part.texcoords * (TEXTURE_WEIGHT * metres))
    if part.colours is not None:
        columns.append(part.colours[:, :3] * COLOUR_WEIGHT)
    columns.append(more)
    known = tuple(stored[f"{part.name}/{n}"].astype(np.int32) for n in ("onto", "first")) if stored else None
    return DetailLevels(np.concatenate(columns, axis=1).astype(np.float32), 1, part.triangles, known)


def cast_coarsely(shape: FaceShape, part: Part, stored: dict[str, Any]) -> FaceShape:
    """Return a part of a face of which all levels of detail cast the shadow of a much coarser mesh.

    stored: what `load_baked` returns for the face.
    """
    if not (shape.casts and shape.levels):
        return shape
    last = shape.levels[-1]
    if f"{part.name}/outer" in stored:
        outer = stored[f"{part.name}/outer"].astype(np.int32)
    else:
        points = np.einsum("nk,nkd->nd", last.weights, part.vertices[last.rows]).astype(np.float32)
        coarse = DetailLevels(points, 1, last.shape.triangles).triangles_within(TOLERANCES[-1])
        if coarse is None:
            return shape
        outer = last.first[coarse].astype(np.int32)
    levels = tuple(
        replace(level, shape=replace(level.shape, outer=level.parents[outer])) for level in shape.levels
    )
    return replace(shape, outer=outer, levels=levels)


def part_rows(model: FaceModel | BodyModel, name: str) -> slice:
    """Return the slice of a part's vertices in the arrays of its model; KeyError for an unknown name."""
    start = model.starts[name]
    return slice(start, start + len(model.part(name).vertices))


def coarse_shapes(model: FaceModel, part: Part, shape: FaceShape) -> tuple[CoarseShape, ...]:
    """Return a part's shape at the model's levels of detail; none without numba."""
    if not is_compiled():
        return ()
    normals = vertex_normals(part.vertices, part.triangles) if part.normals is None else part.normals
    shapes = []
    for level in model.levels:
        own, rows = level.model.part(part.name), part_rows(model, part.name)
        parents = level.parents[rows] - np.int32(level.model.starts[part.name])
        if not len(own.triangles) or not 0 <= parents.min() <= parents.max() < len(own.vertices):
            return ()
        corners, weights = place_on_full(own.vertices, part.vertices, part.triangles, parents)
        weights, heights = _lift(own.vertices, part.vertices[corners], normals[corners], weights)
        places = shape.wrinkle_places
        coarse = replace(
            shape,
            triangles=own.triangles,
            colours=_mean_colours(shape.colours, part, parents, len(own.vertices)),
            sway=np.einsum("nk,nk->n", weights, shape.sway[corners]).astype(np.float32),
            texcoords=own.texcoords if shape.texcoords is not None else None,
            wrinkle_places=None if places is None else place_wrinkles(model, own),
        )
        shapes.append(
            CoarseShape(
                coarse, corners, weights.astype(np.float32), heights.astype(np.float32),
                np.ascontiguousarray(parents), level.error, level,
            )
        )  # fmt: skip
    return tuple(shapes)


def _mean_colours(colours: Float32, part: Part, parents: Int32, count: int) -> Float32:
    """Return (count, 4): the mean of the colours (V, 4) of a part around each vertex of a level.

    parents: (V,), of each vertex of the part the one of the level. A corner of a coarse tooth has the colour
    of the tooth, not of the dark between teeth.
    """
    corners = part.vertices[part.triangles]
    twice = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    area = np.bincount(part.triangles.ravel(), np.repeat(twice, 3), len(colours)) + 1e-12
    whole = np.bincount(parents, area, count)
    sums = [np.bincount(parents, area * colour, count) for colour in colours.T]
    return (np.stack(sums, axis=1) / np.maximum(whole, 1e-12)[:, None]).astype(colours.dtype)


def _lift(places: Float32, corners: Float32, normals: Float32, weights: Float64) -> tuple[Float64, Float64]:
    """Return weights (N, 3) of corners and heights (N,) along the normal there that give places (N, 3).

    corners, normals: (N, 3, 3). weights: (N, 3), of the nearest point of each triangle. At a sharp edge the
    normal there does not lead to the place: then weights a little outside the triangle are taken if those do.
    """
    sought, heights = weights, np.zeros(len(weights))
    best, least = (weights, heights), np.full(len(weights), np.inf)
    for _ in range(NEWTON_STEPS):
        at, out = (np.einsum("nk,nkd->nd", sought, array) for array in (corners, normals))
        off = places - at
        along = (off * out).sum(axis=1) / np.maximum((out * out).sum(axis=1), 1e-12)
        missed = np.linalg.norm(off - along[:, None] * out, axis=1)
        better = (missed < least) & (np.abs(sought - 0.5).max(axis=1) <= FARTHEST_OUTSIDE + 0.5)
        least = np.where(better, missed, least)
        best = np.where(better[:, None], sought, best[0]), np.where(better, along, best[1])
        moved = corners + along[:, None, None] * normals
        axes = np.stack([moved[:, 1] - moved[:, 0], moved[:, 2] - moved[:, 0], out], axis=2).astype(
            np.float64
        )
        axes[np.abs(np.linalg.det(axes)) < 1e-12] = np.eye(3)
        step = np.linalg.solve(axes, (off - along[:, None] * out)[:, :, None])[:, :, 0]
        sought = sought + np.stack([-step[:, 0] - step[:, 1], step[:, 0], step[:, 1]], axis=1)
    return best


def keep_triangles(shape: FaceShape, vertices: Bool, *, whole: bool) -> FaceShape:
    """Return the shape with those triangles of which one corner, or the whole, is among vertices (V,)."""

    def left(triangles: Int32, kept: Bool) -> Int32:
        chosen = kept[triangles].all(axis=1) if whole else kept[triangles].any(axis=1)
        return np.ascontiguousarray(triangles[chosen], dtype=np.int32)

    def cut(shape: FaceShape, kept: Bool) -> FaceShape:
        outer = None if shape.outer is None else left(shape.outer, kept)
        return replace(shape, triangles=left(shape.triangles, kept), outer=outer)

    levels = tuple(replace(level, shape=cut(level.shape, vertices[level.first])) for level in shape.levels)
    return replace(cut(shape, vertices), levels=levels)


def find_hairs(part: Part) -> Float32 | None:
    """Return float32 (V, 8) as in `FaceShape.across`, or None if a part does not consist of single hairs.

    A hair is a strip of two rows of vertices that ends in a point; the vertex opposite to another is the
    nearest one joined to it by an edge.
    """
    if not len(part.triangles):
        return None
    vertices, count = part.vertices.astype(np.float64), len(part.vertices)
    edges = part.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.intp)
    edges = np.concatenate([edges, edges[:, ::-1]])
    apart = vertices[edges[:, 0]] - vertices[edges[:, 1]]
    length = np.linalg.norm(apart, axis=1)
    order = np.lexsort((length, edges[:, 0]))
    rows, first = np.unique(edges[order, 0], return_index=True)
    nearest = order[first]
    opposite = np.arange(count)
    opposite[rows] = edges[nearest, 1]
    paired = (opposite[opposite] == np.arange(count)) & (opposite != np.arange(count))
    half = np.zeros(count)
    half[rows] = length[nearest] / 2
    if not paired.any() or 2 * float(np.median(half[paired])) > MAX_HAIR_WIDTH:
        return None
    hair = join_pieces(edges, count)
    tip = np.full(count, -1)
    tip[hair[~paired]] = np.flatnonzero(~paired)  # unpaired: a tip's nearest has a nearer one
    complete = paired & (tip[hair] >= 0)
    across = np.zeros((count, 8), dtype=np.float32)
    across[:, 7] = np.where(np.arange(count) < opposite, 1, -1)
    across[complete, :3] = unit(vertices[complete] - vertices[opposite[complete]])
    across[complete, 3] = half[complete]
    across[complete, 4:7] = unit(vertices[tip[hair[complete]]] - vertices[complete])
    return across


def join_pieces(edges: Intp, count: int) -> Intp:
    """Return (V,): the lowest vertex in each vertex's connected piece. edges: (E, 2), in both directions."""
    lowest = np.arange(count)
    while True:  # each round halves the remaining distance
        lower = lowest.copy()
        np.minimum.at(lower, edges[:, 0], lowest[edges[:, 1]])
        np.minimum.at(lower, lowest, lower)
        lower = lower[lower]
        if np.array_equal(lower, lowest):
            return lowest
        lowest = lower


def _relief(part: Part) -> tuple[float, float]:
    """Return the strength of a part's relief and its repetitions, so that each is `RELIEF` metres wide."""
    if part.kind not in RELIEF_STRENGTHS or part.texcoords is None or not len(part.triangles):
        return (0.0, 1.0)
    metres = texture_breadth(part.vertices, part.texcoords, part.triangles)
    return (RELIEF_STRENGTHS[part.kind], min(metres / RELIEF, 200.0)) if metres > 0 else (0.0, 1.0)


def _is_smooth(part: Part) -> bool:
    """Return whether most edges bend so little that light may be interpolated between vertices."""
    if part.normals is None or not len(part.triangles):
        return True
    normals, corners = part.normals[part.triangles], part.vertices[part.triangles]
    cosines = np.einsum("tkn,tkn->tk", normals, np.roll(normals, 1, axis=1))
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    return bool(((cosines < BENT_COSINE) & (lengths > LONG_EDGE)).mean() < MAX_BENT_SHARE)


def part_colours(part: Part, plain: tuple[float, ...]) -> Float32:
    """Return float32 (V, 4): the colours of a part and its gloss; `plain` where it has none."""
    if part.colours is not None:
        return part.colours
    row = np.array((*plain, part.material.gloss), dtype=np.float32)
    return np.tile(row, (len(part.vertices), 1))


def part_picture(part: Part) -> FacePicture | None:
    """Return a part's texture, None without one, or, with an FbaWarning, if it cannot be read."""
    if part.material.texture is None or part.texcoords is None:
        return None
    try:
        return load_picture(part.material.texture)
    except (OSError, ValueError, SyntaxError) as error:
        warnings.warn(
            f"the texture of part {part.name!r} cannot be read ({error}): its colour is shown instead",
            FbaWarning,
            stacklevel=2,
        )
        return None
