"""Descriptions of silhouettes, and the distances between them: the methods that are compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np

from fba.arrays import Bool, Float32, Float64, Floating, Int64
from fba.outlines._tree import Nodes, Tree, build_tree, embed_l1, embed_l2, find_nodes, split_into_paths

BAND = 3.0
"""Pixels from the outline, of a silhouette 96 pixels long, at which its distances are cut off."""
Ground = Literal["cityblock", "euclidean"]
"""The distance between points, by SciPy's name: l1 or l2."""


def sample(masses: Float64, count: int) -> Int64:
    """Return nodes (count,), each as often as its share of the mass says, ascending."""
    reached = np.cumsum(masses)
    places = (np.arange(count) + 0.5) * (reached[-1] / count)
    nodes = np.minimum(np.searchsorted(reached, places), len(masses) - 1)
    return np.asarray(nodes, dtype=np.int64)


def earth_movers_distance(first: Floating, second: Floating, ground: Ground = "cityblock") -> float:
    """Return the least mean distance over which the points of one set are moved onto those of the other.

    first, second: (N, D) and (M, E), points of equal mass; missing dimensions are 0. If one set has more
    points, only as many of them are used as the other has.
    """
    from scipy.optimize import linear_sum_assignment
    from scipy.spatial.distance import cdist

    width = max(first.shape[1], second.shape[1])
    cost = cdist(_widen(first, width), _widen(second, width), ground)
    rows, columns = linear_sum_assignment(cost)
    return float(cost[rows, columns].mean())


def project(points: Floating) -> Floating:
    """Return sorted coordinates (D, N) of points (N, D), or (S, D, N) of (S, N, D): see `lower_bounds`."""
    return np.sort(np.swapaxes(points, -1, -2), axis=-1)


def lower_bounds(projected: Floating, all_projected: Floating, ground: Ground = "cityblock") -> Float64:
    """Return numbers (S,) that the distances from one set of points to S others cannot be below.

    projected: (D, N), all_projected: (S, D, N), as `project` returns them. In one dimension the least cost
    is that of matching in sorted order. What is moved in space moves in every coordinate, so that the l1
    distance is at least the sum of these costs, and the l2 distance the length of their vector.
    """
    along = np.abs(all_projected - projected).mean(axis=-1, dtype=np.float64)
    return np.asarray(along.sum(axis=-1) if ground == "cityblock" else np.sqrt((along**2).sum(axis=-1)))


def _widen(points: Floating, width: int) -> Floating:
    return np.pad(points, ((0, 0), (0, width - points.shape[1])))


def signed_distances(mask: Bool) -> Float32:
    """Return the distances (H, W) of pixels from the outline, -3..3 pixels, with the figure in the middle.

    mask: (H, W), of a figure that does not touch its border. Half a pixel aside is half the difference.
    """
    from scipy import ndimage

    away = ndimage.distance_transform_edt(mask) - ndimage.distance_transform_edt(~mask)
    result: Float32 = np.clip(away - np.sign(away) / 2, -BAND, BAND).astype(np.float32)
    for axis in (0, 1):
        used = np.flatnonzero(mask.any(axis=1 - axis))
        aside, half = divmod(mask.shape[axis] - 1 - int(used[0] + used[-1]), 2)
        result = np.roll(result, aside, axis)
        if half:
            result = np.asarray((result + np.roll(result, 1, axis)) / 2, dtype=np.float32)
    return result


def outline_distances(first: Bool, others: Bool) -> Float64:
    """Return how far the outlines of silhouettes (K, H, W) are from that of one (H, W): (K,).

    The root mean square, over the pixels near the first outline, of the differences of `signed_distances`,
    relative to the width of the masks.
    """
    one = signed_distances(first)
    near = max(int((np.abs(one) < BAND).sum()), 1)
    squares = [float(((signed_distances(other) - one) ** 2).sum()) for other in others]
    return np.asarray(np.sqrt(np.array(squares) / near) / first.shape[1])


SAMPLES = 64
"""Points of equal mass by which the nodes of a silhouette are described."""
BINS = 32


@dataclass(frozen=True)
class Method:
    """A way to describe silhouettes.

    describe: returns float64 (64, D) of a silhouette as `fit_mask` returns it, points of equal mass; lengths
    are relative to the root of the silhouette's area. ground: the distance by which the earth is moved.
    """

    name: str
    describe: Callable[[Bool], Float64]
    ground: Ground = "cityblock"


@cache
def methods() -> dict[str, Method]:
    """Return the methods by name.

    points: the nodes' places about their centre and their radii. tree-l1: their places in the isometric
    embedding of the tree. tree-l2: those in 100 dimensions. histogram: of the distances between nodes and of
    the radii, as a sorted list, so that the earth mover's distance is that of two histograms.
    """
    listed = (
        Method("points", describe_points),
        Method("tree-l1", describe_tree),
        Method("tree-l2", describe_sphere, "euclidean"),
        Method("histogram", describe_histogram),
    )
    return {method.name: method for method in listed}


def describe_points(mask: Bool) -> Float64:
    """Return x, y and radius (64, 3) of points along the medial axis; their centre is 0."""
    nodes, chosen = _sampled(mask)
    placed = nodes.points[chosen]
    return _scaled(np.column_stack([placed - placed.mean(axis=0), nodes.radii[chosen]]), nodes)


def describe_tree(mask: Bool) -> Float64:
    """Return the places (64, P) of points in the l1 embedding of the silhouette's tree."""
    nodes, chosen = _sampled(mask)
    return _scaled(embed_l1(*_with_paths(nodes))[chosen], nodes)


def describe_sphere(mask: Bool) -> Float64:
    """Return the places (64, 100) of points in the l2 embedding of the silhouette's tree."""
    nodes, chosen = _sampled(mask)
    return _scaled(embed_l2(*_with_paths(nodes))[chosen], nodes)


def describe_histogram(mask: Bool) -> Float64:
    """Return quantiles (32, 2) of the distances between points and of their radii, ascending."""
    from scipy.spatial.distance import pdist

    nodes, chosen = _sampled(mask)
    steps = (np.arange(BINS) + 0.5) / BINS
    values = (pdist(nodes.points[chosen]), nodes.radii[chosen])
    return _scaled(np.column_stack([np.quantile(each, steps) for each in values]), nodes)


def _sampled(mask: Bool) -> tuple[Nodes, Int64]:
    nodes = find_nodes(mask)
    return nodes, sample(nodes.masses, SAMPLES)


def _with_paths(nodes: Nodes) -> tuple[Tree, Int64]:
    tree = build_tree(nodes.points)
    return tree, split_into_paths(tree, nodes.masses)


def _scaled(lengths: Float64, nodes: Nodes) -> Float64:
    return np.asarray(lengths / nodes.area**0.5)
