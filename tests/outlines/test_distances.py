"""Trees of skeletons, their embeddings and distances; the earth mover's distance and its bounds."""

import itertools

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.sparse.csgraph import dijkstra, minimum_spanning_tree
from scipy.spatial.distance import cdist, pdist, squareform
from scipy.stats import wasserstein_distance

from fba.errors import ModelError
from fba.outlines import (
    Tree,
    build_tree,
    earth_movers_distance,
    embed_l1,
    embed_l2,
    follow,
    lower_bounds,
    nearest,
    outline_distances,
)
from fba.outlines._methods import Ground, project, sample
from fba.outlines._tree import split_into_paths

GROUNDS: tuple[Ground, ...] = ("cityblock", "euclidean")


def transport(first: np.ndarray, second: np.ndarray, masses: list[np.ndarray], ground: str) -> float:
    """The distance by the transportation problem of Rubner's definition."""
    cost = cdist(first, second, ground)
    rows, columns = cost.shape
    flow = min(masses[0].sum(), masses[1].sum())
    bounds = [np.kron(np.eye(rows), np.ones(columns)), np.kron(np.ones(rows), np.eye(columns))]
    done = linprog(
        cost.ravel(), A_ub=np.concatenate(bounds), b_ub=np.concatenate(masses), A_eq=np.ones((1, cost.size)),
        b_eq=[flow],
    )  # fmt: skip
    return float(done.fun / flow)


@pytest.mark.parametrize("ground", GROUNDS)
@pytest.mark.parametrize("seed", range(6))
def test_it_is_the_transportation_problem(seed: int, ground: Ground) -> None:
    random = np.random.default_rng(seed)
    sets = [random.normal(size=(count, 3)) for count in (4, 6)]
    masses = [random.integers(1, 5, len(points)) for points in sets]
    repeated = [np.repeat(points, mass, axis=0) for points, mass in zip(sets, masses, strict=True)]
    expected = transport(*sets, [mass.astype(float) for mass in masses], ground)  # also of unequal masses
    assert earth_movers_distance(*repeated, ground) == pytest.approx(expected, rel=1e-9)


def test_missing_dimensions_are_zero() -> None:
    assert earth_movers_distance(np.array([[1.0]]), np.array([[1.0, 2.0, -3.0]])) == 5


def test_samples_have_the_shares_of_masses() -> None:
    masses = np.array([1.0, 2.0, 0.0, 5.0])
    assert np.bincount(sample(masses, 8)).tolist() == [1, 2, 0, 5]
    assert len(sample(masses, 64)) == 64


@pytest.mark.parametrize("ground", GROUNDS)
def test_bounds_are_below_the_distance(ground: Ground) -> None:
    random = np.random.default_rng(3)
    sets = random.normal(size=(40, 16, 3)) * random.exponential(1.0, (40, 1, 3))
    query = random.normal(size=(16, 3))
    bounds = lower_bounds(project(query), project(sets), ground)
    distances = np.array([earth_movers_distance(query, each, ground) for each in sets])
    assert (bounds <= distances + 1e-12).all()
    assert (bounds > 0.5 * distances).mean() > 0.5  # and not far below it


def test_a_bound_in_one_dimension_is_the_distance() -> None:
    first, second = np.random.default_rng(1).normal(size=(2, 30, 1))
    (bound,) = lower_bounds(project(first), project(second[None]))
    assert bound == pytest.approx(wasserstein_distance(first[:, 0], second[:, 0]))
    assert bound == pytest.approx(earth_movers_distance(first, second))


@pytest.mark.parametrize("ground", GROUNDS)
def test_pruning_changes_no_result(ground: Ground) -> None:
    random = np.random.default_rng(5)
    middles = random.normal(size=(300, 1, 3))
    sets = (middles + random.normal(size=(300, 16, 3))).astype(np.float32)
    sets[250:] = sets[:50]  # and with ties
    spared = 0
    for number in range(0, 300, 30):
        full = nearest(sets[number], sets, 7, ground=ground, prune=False)
        pruned = nearest(sets[number], sets, 7, ground=ground)
        assert pruned[0].tolist() == full[0].tolist()
        assert pruned[1].tolist() == full[1].tolist()
        assert full[2] == 300
        spared += 300 - pruned[2]
    assert spared > 1000


def test_a_sequence_is_the_cheapest_of_all() -> None:
    random = np.random.default_rng(2)
    costs = [random.random(3) for _ in range(5)]
    steps = [random.random((3, 3)) for _ in range(4)]

    def total(chosen: tuple[int, ...]) -> float:
        alone = sum(cost[each] for cost, each in zip(costs, chosen, strict=True))
        return float(alone + sum(s[a, b] for s, a, b in zip(steps, chosen, chosen[1:], strict=False)))

    assert tuple(follow(costs, steps)) == min(itertools.product(range(3), repeat=5), key=total)
    assert follow(costs[:1], []) == [int(costs[0].argmin())]


def test_outlines_that_move_are_that_far_apart() -> None:
    y, x = np.mgrid[:100, :100]
    discs = [np.hypot(y - 49.5, x - 49.5) < radius for radius in (30, 31, 32, 34)]
    apart = 100 * outline_distances(discs[0], np.stack(discs))
    assert apart[0] == 0
    assert apart[1:3] == pytest.approx([1, 2], rel=0.25)  # pixels, less where distances are cut off
    assert (np.diff(apart) > 0).all()
    aside = np.stack([np.roll(discs[0], shift, (0, 1)) for shift in ((3, 0), (-2, 5))])
    assert outline_distances(discs[0], aside) == pytest.approx(0)  # figures are compared in the middle
    assert outline_distances(discs[0], discs[0][None, :, ::-1]) == pytest.approx(0)


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
    assert (paths[NAMES.index("g")], paths[NAMES.index("f")]) == (0, 5)


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
