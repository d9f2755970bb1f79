"""Weights with which a body's neck moves a face's vertices, and the vertices that the neck hides."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fba.arrays import Array, Bool, Float32, Float64, Int32, Int64
from fba.body.model import BodyPart
from fba.body.skin.skin_weights import INFLUENCES, strongest_weights
from fba.cache import load_or_make, make_key
from fba.easing import smoothstep

WITH_NECK = 0.010
"""Distance from the body's neck up to which a vertex of the face moves with the neck, metres."""
WITH_SKULL = 0.030
"""Distance from the body's neck from which a vertex of the face moves with the skull only, metres."""
NEIGHBOURS = 4
SAME_PLACE = 1e-5
"""Metres within which two vertices are the same."""
PAIR_DISTANCE = 0.01
"""Metres within which vertices are paired at first."""
MAX_ROUNDS = 20
"""Largest number of rounds in which a face is moved by the median offset of its pairs."""
RIM = 0.3
"""Smallest width of a neck's lower rim, as a share of the neck's."""
SEAM = 0.002
"""Distance to the body's neck, metres, up to which a face's own neck meets it."""

CACHED_VERTICES = 4000
"""Number of vertices from which results for a face are cached on disk."""
CACHE_VERSION = 1
"""Version of cached results; increment when results change."""


class NeckBlend(NamedTuple):
    """Weights, offset and hidden vertices of a face on a body's neck."""

    offset: Float64
    """(3,) metres by which the face must be moved for both necks to coincide."""
    joints: Int32
    """(F, 4) joints of the free vertices."""
    weights: Float32
    """(F, 4) weights of those joints."""
    hidden: Bool
    """(V,) mask of vertices beyond the lower edge of the body's neck."""
    brings_neck: bool
    """Whether the face has a neck of its own that meets the body."""


def blend_with_neck(neck: list[BodyPart], joints: int, skull: int, placed: Float64, free: Bool) -> NeckBlend:
    """Return the joints and weights by which a body's neck moves a face's vertices (V, 3), metres.

    neck: the body's parts of that kind, with vertices. joints: number of the body's joints. skull: the joint
    that carries the head. free: (V,) vertices that the neck may bend.
    """

    def make() -> list[Array]:
        result = _compute_blend(neck, joints, skull, placed, free)
        return [*result[:4], np.array([result.brings_neck])]

    if len(placed) < CACHED_VERTICES:
        arrays = make()
    else:
        of_neck = [array for p in neck for array in (p.vertices, p.triangles, p.joints, p.weights)]
        key = make_key("neck", CACHE_VERSION, joints, skull, placed, free, *of_neck)
        count = int(free.sum())
        shapes = ((3,), (count, INFLUENCES), (count, INFLUENCES), (len(placed),), (1,))
        arrays = load_or_make(key, shapes, make, [np.float64, np.int32, np.float32, np.bool_, np.bool_])
    offset, which, weights, hidden, brings = arrays
    return NeckBlend(offset, which, weights, hidden, bool(brings[0]))


def _compute_blend(neck: list[BodyPart], joints: int, skull: int, placed: Float64, free: Bool) -> NeckBlend:
    from scipy.spatial import cKDTree

    anchors = np.concatenate([part.vertices for part in neck])
    offset = _measure_offset(anchors, placed)
    placed = placed + offset
    tree = cKDTree(anchors)
    hidden, brings_neck = np.zeros(len(placed), dtype=bool), False
    edge, outward = _lower_edge(anchors, neck)
    if len(edge) and len(placed):
        low = np.setdiff1d(np.flatnonzero(anchors[:, 1] < anchors[:, 1].mean()), edge)
        away = cKDTree(placed).query(anchors[low])[0] if len(low) else np.full(1, np.inf)
        brings_neck = bool(np.median(away) < SEAM)
        hidden = _beyond_edge(tree, edge, outward, anchors, placed)
    which, weights = _blend_weights(tree, _dense_weights(neck, joints), placed[free], skull, hidden[free])
    return NeckBlend(offset, which, weights, hidden, brings_neck)


def _measure_offset(anchors: Float32, placed: Float64) -> Float64:
    """Return (3,) offset, metres, between a face and a body whose neck it shares vertex by vertex; else 0.

    Needed because readers differ a little in the positions of pupils.
    """
    from scipy.spatial import cKDTree

    none = np.zeros(3)
    if not len(placed):
        return none
    tree, moved = cKDTree(placed), anchors.astype(np.float64)
    for _ in range(MAX_ROUNDS):
        away, rows = tree.query(moved)
        near = away < PAIR_DISTANCE
        if not near.any() or float((away < SAME_PLACE).mean()) > 0.5:
            break
        moved = moved + np.median(placed[rows[near]] - moved[near], axis=0)
    offset: Float64 = anchors[0].astype(np.float64) - moved[0]
    result = float((tree.query(moved)[0] < SAME_PLACE).mean()) > 0.5
    return offset if result and float(np.linalg.norm(offset)) > SAME_PLACE else none


def _dense_weights(neck: list[BodyPart], joints: int) -> Float64:
    """Return (A, J) weights of the necks' vertices."""
    rows = sum(len(part.vertices) for part in neck)
    dense = np.zeros((rows, joints))
    which = np.concatenate([part.joints for part in neck])
    share = np.concatenate([part.weights for part in neck])
    for slot in range(INFLUENCES):
        np.add.at(dense, (np.arange(rows), which[:, slot]), share[:, slot])
    return dense


def _blend_weights(
    tree: Any, dense: Float64, positions: Float64, skull: int, below: Bool
) -> tuple[Int32, Float32]:
    """Return joints and weights of the nearest anchors, which fade into the skull's unless `below`."""
    away, rows = tree.query(positions, k=min(NEIGHBOURS, len(dense)))
    away, rows = away.reshape(len(positions), -1), rows.reshape(len(positions), -1)
    share = 1 / np.maximum(away, 1e-6) ** 2
    share /= share.sum(axis=1, keepdims=True)
    result = np.einsum("vk,vkj->vj", share, dense[rows])
    alone = np.where(below[:, None], 0.0, smoothstep((away[:, :1] - WITH_NECK) / (WITH_SKULL - WITH_NECK)))
    result *= 1 - alone
    result[:, skull] += alone[:, 0]
    return strongest_weights(result)


def _lower_edge(anchors: Float32, neck: list[BodyPart]) -> tuple[Int64, Float64]:
    """Return (vertices (N,) of the open rims in the lower half of necks, (N, 3) outward directions there)."""
    starts = np.cumsum([0, *(len(part.vertices) for part in neck)])
    triangles = np.concatenate([part.triangles + start for part, start in zip(neck, starts, strict=False)])
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2)
    _, inverse, counts = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    open_sides = sides[counts[inverse.ravel()] == 1]
    edge = _low_rims(anchors, open_sides)
    within = np.zeros((len(anchors), 3))
    count = np.zeros((len(anchors), 1))
    inner = np.ones(len(anchors), dtype=bool)
    inner[edge] = False
    for a, b in (sides.T, sides[:, ::-1].T):
        use = inner[b]
        np.add.at(within, a[use], anchors[b[use]].astype(np.float64))
        np.add.at(count, a[use], 1)
    outward = np.where(count[edge] > 0, anchors[edge] - within[edge] / np.maximum(count[edge], 1), 0.0)
    return edge, outward


def _low_rims(anchors: Float32, open_sides: Int64) -> Int64:
    """Return the vertices of the rims at the lower end of a neck, not at its chin nor in holes."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = (np.ones(len(open_sides)), (open_sides[:, 0], open_sides[:, 1]))
    _, label = connected_components(coo_array(links, shape=(len(anchors),) * 2), directed=False)
    middle = (anchors[:, 1].min() + anchors[:, 1].max()) / 2
    wide = RIM * np.ptp(anchors[:, 0])
    rims = np.unique(open_sides)
    result = [np.zeros(0, dtype=np.int64)]
    for number in np.unique(label[rims]):
        rim = rims[label[rims] == number]
        if anchors[rim, 1].mean() < middle and np.ptp(anchors[rim, 0]) > wide:
            result.append(rim)
    return np.concatenate(result)


def _beyond_edge(tree: Any, edge: Int64, outward: Float64, anchors: Float32, positions: Float64) -> Bool:
    """Return (V,) mask of the positions beyond the edge."""
    away, rows = tree.query(positions)
    number = np.full(len(anchors), -1)
    number[edge] = np.arange(len(edge))
    edge_number = number[rows]
    past: Bool = (edge_number >= 0) & (away > SEAM)
    past &= ((positions - anchors[rows]) * outward[edge_number]).sum(axis=1) > 0
    return past
