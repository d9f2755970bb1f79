"""The earth mover's distance beside linear programming, bounds below it, and searches that use them."""

import itertools

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial.distance import cdist
from scipy.stats import wasserstein_distance

from fba.outlines import earth_movers_distance, follow, lower_bounds, nearest, outline_distances
from fba.outlines._distance import Ground, project, sample

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
