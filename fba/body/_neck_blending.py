"""Weights with which a body's neck moves a face's vertices, and the vertices that the neck hides."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from fba.arrays import Array, Bool, Float32, Float64, Int32, Int64
from fba.body.model import BodyPart
from fba.body.skin.skin_weights import INFLUENCES, strongest_weights
from fba.cache import kept, key_of
from fba.easing import smoothstep

NEAR, FAR = 0.010, 0.030
"""Metres from the body's neck: up to the first a vertex moves as the neck there, beyond the second with the
skull alone."""
NEIGHBOURS = 4
SAME, ALMOST, ROUNDS = 1e-5, 0.01, 20
"""Metres: vertices so near are the same; those of one mesh may at first be so far apart. How often a face is
moved by what its vertices are off."""
RIM = 0.3
"""The share of a neck's width that its lower rim has at least."""
SEAM = 0.002
"""A face whose vertices come this close (m) to those of the body's neck brings its own neck."""

LARGE = 4000
"""What faces of so many vertices and more gave is kept on disk."""
MAKING = 1
"""Counts up with every change of what is found: what was kept before is then made anew."""


class Carried(NamedTuple):
    """Weights, offset and hidden vertices of a face on a body's neck."""

    offset: Float64
    """(3,) metres that the face is to be moved by, so that both necks are in one place."""
    joints: Int32
    """(F, 4) of the free vertices."""
    weights: Float32
    """(F, 4)"""
    hidden: Bool
    """(V,) vertices beyond the lower edge of the body's neck."""
    brings_neck: bool
    """Whether the face has a neck that meets the body."""


def carried_by_neck(neck: list[BodyPart], joints: int, skull: int, placed: Float64, free: Bool) -> Carried:
    """How a body's neck carries a face's vertices placed (V, 3), metres.

    neck: the body's parts of that kind, with vertices. joints: how many the body has. skull: the joint that
    carries the head. free: (V,) vertices that the neck may bend.
    """

    def make() -> list[Array]:
        found = _carried(neck, joints, skull, placed, free)
        return [*found[:4], np.array([found.brings_neck])]

    if len(placed) < LARGE:
        arrays = make()
    else:
        of_neck = [array for p in neck for array in (p.vertices, p.triangles, p.joints, p.weights)]
        key = key_of("neck", MAKING, joints, skull, placed, free, *of_neck)
        count = int(free.sum())
        shapes = ((3,), (count, INFLUENCES), (count, INFLUENCES), (len(placed),), (1,))
        arrays = kept(key, shapes, make, [np.float64, np.int32, np.float32, np.bool_, np.bool_])
    offset, which, weights, hidden, brings = arrays
    return Carried(offset, which, weights, hidden, bool(brings[0]))


def _carried(neck: list[BodyPart], joints: int, skull: int, placed: Float64, free: Bool) -> Carried:
    from scipy.spatial import cKDTree

    anchors = np.concatenate([part.vertices for part in neck])
    offset = _offset(anchors, placed)
    placed = placed + offset
    tree = cKDTree(anchors)
    hidden, brings_neck = np.zeros(len(placed), dtype=bool), False
    edge, outward = _lower_edge(anchors, neck)
    if len(edge) and len(placed):
        low = np.setdiff1d(np.flatnonzero(anchors[:, 1] < anchors[:, 1].mean()), edge)
        away = cKDTree(placed).query(anchors[low])[0] if len(low) else np.full(1, np.inf)
        brings_neck = bool(np.median(away) < SEAM)
        hidden = _beyond(tree, edge, outward, anchors, placed)
    which, weights = _nearest(tree, _dense(neck, joints), placed[free], skull, hidden[free])
    return Carried(offset, which, weights, hidden, brings_neck)


def _offset(anchors: Float32, placed: Float64) -> Float64:
    """(3,) how far a face is off a body whose neck it has, vertex by vertex; 0 where it has another.

    Where pupils are found differs a little from one reader to another.
    """
    from scipy.spatial import cKDTree

    none = np.zeros(3)
    if not len(placed):
        return none
    tree, moved = cKDTree(placed), anchors.astype(np.float64)
    for _ in range(ROUNDS):
        away, rows = tree.query(moved)
        near = away < ALMOST
        if not near.any() or float((away < SAME).mean()) > 0.5:
            break
        moved = moved + np.median(placed[rows[near]] - moved[near], axis=0)
    offset: Float64 = anchors[0].astype(np.float64) - moved[0]
    found = float((tree.query(moved)[0] < SAME).mean()) > 0.5
    return offset if found and float(np.linalg.norm(offset)) > SAME else none


def _dense(neck: list[BodyPart], joints: int) -> Float64:
    """(A, J) weights of the necks' vertices."""
    rows = sum(len(part.vertices) for part in neck)
    dense = np.zeros((rows, joints))
    which = np.concatenate([part.joints for part in neck])
    share = np.concatenate([part.weights for part in neck])
    for slot in range(INFLUENCES):
        np.add.at(dense, (np.arange(rows), which[:, slot]), share[:, slot])
    return dense


def _nearest(tree: Any, dense: Float64, places: Float64, skull: int, below: Bool) -> tuple[Int32, Float32]:
    """Weights of the nearest anchors, handed over to the skull with distance, but for what lies below."""
    away, rows = tree.query(places, k=min(NEIGHBOURS, len(dense)))
    away, rows = away.reshape(len(places), -1), rows.reshape(len(places), -1)
    share = 1 / np.maximum(away, 1e-6) ** 2
    share /= share.sum(axis=1, keepdims=True)
    found = np.einsum("vk,vkj->vj", share, dense[rows])
    alone = np.where(below[:, None], 0.0, smoothstep((away[:, :1] - NEAR) / (FAR - NEAR)))
    found *= 1 - alone
    found[:, skull] += alone[:, 0]
    return strongest_weights(found)


def _lower_edge(anchors: Float32, neck: list[BodyPart]) -> tuple[Int64, Float64]:
    """Vertices of the open rims in the lower half of necks, and the ways out over them (N, 3)."""
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
    """Vertices of the rims that a neck ends in below: not its chin, nor holes within."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = (np.ones(len(open_sides)), (open_sides[:, 0], open_sides[:, 1]))
    _, label = connected_components(coo_array(links, shape=(len(anchors),) * 2), directed=False)
    middle = (anchors[:, 1].min() + anchors[:, 1].max()) / 2
    wide = RIM * np.ptp(anchors[:, 0])
    rims = np.unique(open_sides)
    found = [np.zeros(0, dtype=np.int64)]
    for number in np.unique(label[rims]):
        rim = rims[label[rims] == number]
        if anchors[rim, 1].mean() < middle and np.ptp(anchors[rim, 0]) > wide:
            found.append(rim)
    return np.concatenate(found)


def _beyond(tree: Any, edge: Int64, outward: Float64, anchors: Float32, places: Float64) -> Bool:
    """(V,) mask of the positions beyond the edge."""
    away, rows = tree.query(places)
    number = np.full(len(anchors), -1)
    number[edge] = np.arange(len(edge))
    at = number[rows]
    past: Bool = (at >= 0) & (away > SEAM)
    past &= ((places - anchors[rows]) * outward[at]).sum(axis=1) > 0
    return past
