"""Trees, their paths and embeddings: the source's worked example, and distances along random trees."""

import numpy as np
import pytest
from scipy.sparse.csgraph import dijkstra, minimum_spanning_tree
from scipy.spatial.distance import cdist, pdist, squareform

from fba.errors import ModelError
from fba.outlines import Tree, build_tree, embed_l1, embed_l2
from fba.outlines._tree import split_into_paths

NAMES = "abcdefghijklm"
PARENTS = {"b": "a", "c": "b", "d": "a", "e": "d", "g": "e", "f": "e", "h": "a", "i": "h", "k": "i", "m": "k",
           "j": "i", "l": "k"}  # fmt: skip
WEIGHTS = {"c": 90, "g": 40, "m": 20, "f": 9, "j": 5, "l": 3}
"""First-level paths end at c, g and m, second-level ones at f, j and l, in this order."""


def worked_example() -> tuple[Tree, np.ndarray]:
    """The tree whose paths and whose node f the thesis gives (figure 4.3), and weights of its nodes."""
    number = {name: count for count, name in enumerate(NAMES)}
    order = [0]
    while len(order) < len(NAMES):
        order += [number[k] for k, v in PARENTS.items() if number[v] in order and number[k] not in order]
    parents = np.array([number[PARENTS[name]] if name in PARENTS else -1 for name in NAMES])
    lengths = np.full(len(NAMES), 0.75)
    lengths[0], lengths[number["f"]] = 0.0, 1.5
    weights = np.array([WEIGHTS.get(name, 1) for name in NAMES], dtype=float)
    return Tree(np.array(order), parents, lengths), weights


def random_tree(seed: int, count: int) -> Tree:
    random = np.random.default_rng(seed)
    parents = np.array([-1, *(random.integers(node) for node in range(1, count))])
    return Tree(np.arange(count), parents, np.append(0.0, random.exponential(1.0, count - 1)))


def test_the_worked_example() -> None:
    tree, weights = worked_example()
    paths = split_into_paths(tree, weights)
    ends = {NAMES[node]: int(paths[node]) for node in range(len(NAMES)) if NAMES[node] in "cgmfjl"}
    assert ends == {"c": 0, "g": 1, "m": 2, "f": 3, "j": 4, "l": 5}
    assert embed_l1(tree, paths)[NAMES.index("f")].tolist() == [0, 1.5, 0, 1.5, 0, 0]


@pytest.mark.parametrize("seed", range(20))
def test_l1_distances_are_those_along_the_tree(seed: int) -> None:
    random = np.random.default_rng(seed)
    tree = random_tree(seed, int(random.integers(1, 60)))
    count = len(tree.order)
    graph = np.zeros((count, count))
    graph[np.arange(1, count), tree.parents[1:]] = tree.lengths[1:]
    along = dijkstra(graph, directed=False)
    paths = split_into_paths(tree, random.random(count))  # whatever the weights
    placed = embed_l1(tree, paths)
    assert cdist(placed, placed, "cityblock") == pytest.approx(along, abs=1e-12)
    assert tree.distances() == pytest.approx(along, abs=1e-12)
    leaves = set(range(count)) - set(tree.parents.tolist()) - {0}
    assert placed.shape[1] == len(leaves)  # a path for each


def test_the_order_of_paths_is_that_of_weights() -> None:
    tree, weights = worked_example()
    weights[NAMES.index("g")], weights[NAMES.index("f")] = 1000, 1
    paths = split_into_paths(tree, weights)
    assert paths[NAMES.index("g")] == 0
    assert paths[NAMES.index("f")] == 5


@pytest.mark.parametrize("seed", range(5))
def test_the_l2_embedding_distorts_within_its_bounds(seed: int) -> None:
    """With a direction of its own for each path, distances shrink by the root of the paths on the way."""
    tree = random_tree(seed, 40)
    along = squareform(tree.distances())
    placed = pdist(embed_l2(tree, split_into_paths(tree, np.ones(40))))
    assert (placed <= along * (1 + 1e-12)).all()
    assert (placed >= along / np.sqrt(40)).all()
    assert placed.mean() < along.mean()
    with pytest.raises(ModelError, match="do not fit in 2 dimensions"):
        embed_l2(tree, split_into_paths(tree, np.ones(40)), 2)


@pytest.mark.parametrize("seed", range(5))
def test_the_tree_is_minimal_and_its_root_central(seed: int) -> None:
    points = np.random.default_rng(seed).normal(size=(30, 2))
    tree = build_tree(points)
    spanning = minimum_spanning_tree(squareform(pdist(points)))
    assert tree.lengths.sum() == pytest.approx(spanning.sum())
    sums = dijkstra(spanning, directed=False).sum(axis=1)
    assert tree.order[0] == sums.argmin()
    assert (np.isin(tree.parents[tree.order[1:]], tree.order)).all()


def test_trees_of_one_point_and_of_coinciding_points() -> None:
    tree = build_tree(np.zeros((1, 2)))
    assert embed_l1(tree, split_into_paths(tree, np.ones(1))).shape == (1, 0)
    for points in (np.zeros((0, 2)), np.zeros((2, 2))):
        with pytest.raises(ModelError, match="all at different places"):
            build_tree(points)
