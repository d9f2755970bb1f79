"""The medial axis of a silhouette, trees over its nodes, and their embeddings in vector spaces.

The axis has the points that are equally far from several places of the outline. There the vectors from the
nearest places meet, so that the mean flux of these unit vectors into a small circle is positive: Siddiqi,
Bouix, Tannenbaum and Zucker, "Hamilton-Jacobi skeletons", 2002.

The caterpillar decomposition splits a tree into paths without common edges, each from a node of an earlier
path (at first the root) to a leaf. A node's coordinate of a path is the length that its way from the root
shares with that path: then l1 distances are those along the tree (Linial, London and Rabinovich 1995).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64, Int64
from fba.errors import FormatError, ModelError

FLUX = 0.4
"""Mean flux from which a pixel lies on the medial axis; below, rounded corners would count."""
CELL = 6
"""Pixels, of a silhouette 96 pixels long, within which points become one node."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes on the medial axis of a silhouette.

    points: float64 (N, 2), x to the right and y up, pixels. radii: (N,), of the largest circles inside,
    pixels. masses: (N,), the sum of the radii that a node stands for. area: pixels of the silhouette.
    """

    points: Float64
    radii: Float64
    masses: Float64
    area: int


def medial_axis(mask: Bool) -> tuple[Float64, Float64]:
    """Return points (N, 2) of the medial axis, x to the right and y up, and their radii (N,), in pixels.

    The mask's border must be background. Raises FormatError for an empty mask.
    """
    from scipy import ndimage

    if not mask.any():
        raise FormatError("shows no figure: the outline is empty")
    radii, nearest = ndimage.distance_transform_edt(mask, return_indices=True)
    inward = (np.indices(mask.shape) - nearest) / np.maximum(radii, 1)
    circle = np.mgrid[-1:2, -1:2] / np.maximum(np.hypot(*np.mgrid[-1:2, -1:2]), 1)
    flux = -sum(ndimage.correlate(part, rays) for part, rays in zip(inward, circle, strict=True)) / 8
    on_axis = mask & ((flux > FLUX) | (radii == radii.max()))
    rows, columns = np.nonzero(on_axis)
    return np.column_stack([columns, -rows]).astype(np.float64), radii[on_axis]


def find_nodes(mask: Bool, cell: float = CELL) -> Nodes:
    """Return the nodes of a silhouette (H, W) with a border of background; see `fit_mask`.

    cell: pixels, the side of the squares whose points become one node. Raises FormatError for an empty mask.
    """
    points, radii = medial_axis(mask)
    cells = np.floor(points / cell).astype(np.int64)
    _, node = np.unique(cells, axis=0, return_inverse=True)
    node = node.reshape(-1)
    masses: Float64 = np.bincount(node, radii).astype(np.float64)
    means = [np.bincount(node, values * radii) / masses for values in (*points.T, radii)]
    return Nodes(np.column_stack(means[:2]), means[2], masses, int(mask.sum()))


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
