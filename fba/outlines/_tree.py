"""Trees over the nodes of a medial axis, and their embeddings in vector spaces.

The caterpillar decomposition splits a tree into paths without common edges, each from a node of an earlier
path (at first the root) to a leaf. A node's coordinate of a path is the length that its way from the root
shares with that path: then l1 distances are those along the tree (Linial, London and Rabinovich 1995).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Int64
from fba.errors import ModelError

SPHERE = 100
"""Dimensions of the l2 embedding."""


@dataclass(frozen=True, eq=False)
class Tree:
    """A tree with a root.

    order: int64 (N,), its nodes, each after its parent, the root first. parents: (N,), -1 for the root.
    lengths: float64 (N,), of the edge to the parent; 0 for the root.
    """

    order: Int64
    parents: Int64
    lengths: Float64

    def distances(self) -> Float64:
        """Return the lengths (N, N) of the ways between nodes."""
        count = len(self.order)
        result = np.zeros((count, count))
        for number, node in enumerate(self.order[1:], 1):
            before, parent = self.order[:number], self.parents[node]
            result[node, before] = result[before, node] = result[parent, before] + self.lengths[node]
        return result


def build_tree(points: Float64) -> Tree:
    """Return the minimum spanning tree of points (N, D) that differ.

    Its root is the node with the least sum of distances along the tree to all others. Raises ModelError for
    points that coincide.
    """
    from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree
    from scipy.spatial.distance import pdist, squareform

    if not len(points) or (len(points) > 1 and not pdist(points).min() > 0):
        raise ModelError("a tree needs at least one node, and all at different places")
    between = squareform(pdist(points))
    graph = minimum_spanning_tree(between)

    def rooted(root: int) -> Tree:
        order, parents = breadth_first_order(graph, root, directed=False)
        parents = np.maximum(parents, -1).astype(np.int64)  # SciPy's sign of none is -9999
        lengths = np.where(parents >= 0, between[np.arange(len(points)), parents], 0.0)
        return Tree(order.astype(np.int64), parents, lengths)

    return rooted(int(rooted(0).distances().sum(axis=1).argmin()))


def split_into_paths(tree: Tree, weights: Float64) -> Int64:
    """Return the path (N,) by which each node is reached; -1 for the root.

    Every child of the root begins a path. At other nodes, the path goes on to the child below which the
    nodes weigh most, and the other children begin paths. Paths are numbered by level, then from the heaviest
    to the lightest, so that trees that are alike have the same order. weights: (N,), of the nodes.
    """
    below = weights.astype(np.float64)
    for node in tree.order[:0:-1]:
        below[tree.parents[node]] += below[node]
    root = int(tree.order[0])
    heaviest: dict[int, int] = {}
    for node in tree.order[1:].tolist():
        parent = int(tree.parents[node])
        if parent != root and (parent not in heaviest or below[node] > below[heaviest[parent]]):
            heaviest[parent] = node
    paths = np.full(len(below), -1)
    starts: list[int] = []
    levels: list[int] = []
    for node in tree.order[1:].tolist():
        parent = int(tree.parents[node])
        if heaviest.get(parent) == node:
            paths[node] = paths[parent]
        else:
            paths[node] = len(starts)
            starts.append(node)
            levels.append(0 if parent == root else levels[paths[parent]] + 1)
    order = np.lexsort((-below[starts], np.array(levels))) if starts else np.empty(0, dtype=np.int64)
    return np.asarray(np.append(np.argsort(order), -1)[paths], dtype=np.int64)


def embed_l1(tree: Tree, paths: Int64) -> Float64:
    """Return coordinates (N, P) of nodes, a dimension for each path, whose l1 distances are the tree's.

    paths: (N,), as `split_into_paths` returns them.
    """
    result = np.zeros((len(paths), int(paths.max(initial=-1)) + 1))
    for node in tree.order[1:]:
        result[node] = result[tree.parents[node]]
        result[node, paths[node]] += tree.lengths[node]
    return result


def embed_l2(tree: Tree, paths: Int64, dimensions: int = SPHERE) -> Float64:
    """Return coordinates (N, dimensions) of nodes, whose Euclidean distances are near those of the tree.

    Each path has a direction of a spherical code: the axes, and then the opposite ones, which is the best
    code of up to twice as many points as dimensions. Raises ModelError for more paths than that.
    """
    along = embed_l1(tree, paths)
    count = along.shape[1]
    if count > 2 * dimensions:
        raise ModelError(f"{count} paths do not fit in {dimensions} dimensions, which hold {2 * dimensions}")
    directions = np.concatenate([np.eye(dimensions), -np.eye(dimensions)])[:count]
    return np.asarray(along @ directions)
