"""Descriptions of silhouettes, and the distances between them: the methods that are compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from fba.arrays import Bool, Float64, Int64
from fba.outlines._distance import Ground, sample
from fba.outlines._tree import Nodes, Tree, build_tree, embed_l1, embed_l2, find_nodes, split_into_paths

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
