"""Turns triangles so that all face outwards."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fba.arrays import Bool, Float64, Int32
from fba.face.importers.assembly.polygon_parts import Piece


def turn_outward(pieces: Sequence[Piece], centre: Float64, reach: float = np.inf) -> tuple[list[Piece], int]:
    """(pieces with the skin facing away from the centre of the head, number of triangles turned).

    reach: distance from the centre within which skin is that of the head; hands and feet of avatars, which
    may have its material, face anywhere as seen from there. Within the skin, triangles that run against their
    neighbours are turned first. When the skin was inside out the other pieces are taken to be so too.
    """
    masks = [np.zeros(len(piece.part.triangles), dtype=np.bool_) for piece in pieces]
    all_inside_out = False
    for number, part in enumerate(piece.part for piece in pieces):
        if part.kind == "skin":
            wrong = _opposing(part.triangles)
            triangles = _flip(part.triangles, wrong)
            vertices = part.vertices.astype(np.float64)
            near = np.linalg.norm(vertices[triangles].mean(axis=1) - centre, axis=1) < reach
            inside_out = float(_facing(vertices, triangles[near], centre).sum()) < 0
            all_inside_out |= inside_out
            masks[number] = wrong ^ inside_out
    if all_inside_out:
        masks = [m if p.part.kind == "skin" else ~m for p, m in zip(pieces, masks, strict=True)]
    turned = [_turn_triangles(p, m) if m.any() else p for p, m in zip(pieces, masks, strict=True)]
    return turned, int(sum(mask.sum() for mask in masks))


def _turn_triangles(piece: Piece, wrong: Bool) -> Piece:
    # normals of the file belong to the wrong sides: they are computed again
    part = replace(piece.part, triangles=_flip(piece.part.triangles, wrong), normals=None)
    return replace(piece, part=part)


def _flip(triangles: Int32, wrong: Bool) -> Int32:
    """Triangles (F, 3), those of a mask (F,) turned over."""
    return np.where(wrong[:, None], triangles[:, ::-1], triangles)


def _facing(vertices: Float64, triangles: Int32, centre: Float64) -> Float64:
    """(F,) positive for triangles that face away from a centre, in proportion to their areas."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.asarray(np.einsum("ij,ij->i", np.cross(b - a, c - a), (a + b + c) / 3 - centre))


def _opposing(triangles: Int32) -> Bool:
    """bool (F,): triangles to turn so that neighbours agree, at most half of each connected piece."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order, connected_components

    count = len(triangles)
    ends = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.int64)
    face = np.repeat(np.arange(count), 3)
    forward = ends[:, 0] < ends[:, 1]
    key = np.minimum(ends[:, 0], ends[:, 1]) << 32 | np.maximum(ends[:, 0], ends[:, 1])
    order = np.argsort(key, kind="stable")
    key, face, forward = key[order], face[order], forward[order]
    first = np.flatnonzero(key[1:] == key[:-1])
    # an edge of three or more triangles does not define sides
    crowded = np.zeros(len(key) + 1, dtype=np.bool_)
    triple = np.flatnonzero(key[2:] == key[:-2])
    crowded[triple] = crowded[triple + 1] = True
    first = first[~crowded[first]]
    if not len(first):
        return np.zeros(count, dtype=np.bool_)
    a, b = face[first], face[first + 1]
    clash = forward[first] == forward[first + 1]
    if not clash.any():
        return np.zeros(count, dtype=np.bool_)
    graph = coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(count, count)).tocsr()
    _, label = connected_components(graph, directed=False)
    sizes = np.bincount(label)
    doubtful = np.zeros(len(sizes), dtype=np.bool_)
    doubtful[label[a[clash]]] = True
    # one more triangle, a neighbour of the first of each doubtful piece, so that one walk reaches them all
    starts = np.unique(label, return_index=True)[1][doubtful]
    a_all, b_all = np.append(a, np.full(len(starts), count)), np.append(b, starts)
    size = count + 1
    graph = coo_array((np.ones(len(a_all), dtype=np.int8), (a_all, b_all)), shape=(size, size)).tocsr()
    walk, before = breadth_first_order(graph, count, directed=False)
    clashes = {(int(x), int(y)) for x, y in zip(a[clash], b[clash], strict=True)}
    wrong = np.zeros(count, dtype=np.bool_)
    for here in walk[1:].tolist():
        there = int(before[here])
        if there < count:
            wrong[here] = wrong[there] ^ ((there, here) in clashes or (here, there) in clashes)
    most = doubtful & (np.bincount(label, wrong, len(sizes)) > sizes / 2)
    wrong ^= most[label]
    return wrong
