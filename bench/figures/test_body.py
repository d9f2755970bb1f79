"""Speed of the BAP solver and of motion capture -> BAPs, on one core."""

from __future__ import annotations

import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np
import pytest

from fba.body import BapSolver, Skeleton
from fba.body.solve.conventions import convention
from fba.parameters import baps

POSES = 2000
ROUNDS = 20
TEXTBOOK_ROUNDS = 5
pytestmark = pytest.mark.benchmark(timer=time.process_time)  # of one core, whoever else uses the machine


@pytest.fixture(scope="module")
def poses() -> np.ndarray:
    """int32 (T, 296): all 186 BAPs anywhere within the standard's ranges, but 0.5 m and 1 rad at most."""
    generator = np.random.default_rng(0)
    values = np.zeros((POSES, 296), dtype=np.int32)
    for bap in baps():
        if bap.i_limits is not None:
            most = 500 if bap.unit == "mm" else 100_000
            low, high = np.clip(np.array(bap.i_limits) * bap.step_iso, -most, most)
            values[:, bap.number - 1] = generator.integers(low, high + 1, POSES)
    return values


def textbook(solver: BapSolver, values: np.ndarray) -> np.ndarray:
    """The same matrices, joint by joint, vectorised over frames with NumPy."""
    body, rules = solver.skeleton, convention("iso")
    result = np.tile(np.eye(4), (len(values), len(body), 1, 1))
    for number, name in enumerate(body.names):
        parent = body.parents[number]
        above = result[:, parent] if parent >= 0 else np.tile(np.eye(4), (len(values), 1, 1))
        step = np.tile(np.eye(4), (len(values), 1, 1))
        step[:, :3, 3] = body.offsets[number]
        if parent < 0:
            step[:, :3, 3] += values[:, rules.translation] * 1e-3
        row = rules.joints.index(name) if name in rules.joints else None
        for column, axis, sign in zip(rules.bap[row], rules.axis[row], rules.sign[row], strict=True):
            if column < 0:
                break
            angle = values[:, column] * 1e-5 * sign
            turn = np.tile(np.eye(4), (len(values), 1, 1))
            a, b = (axis + 1) % 3, (axis + 2) % 3
            turn[:, a, a] = turn[:, b, b] = np.cos(angle)
            turn[:, b, a] = np.sin(angle)
            turn[:, a, b] = -np.sin(angle)
            step = step @ turn
        result[:, number] = above @ step
    return result


def seconds(benchmark: Any, function: Callable[[], Any]) -> float:
    """Median of a call, whose results are all kept, as by a user who needs them.

    Results that are dropped at once would hide what new memory costs: each would get the memory of the last.
    """
    results = [function()]
    benchmark.pedantic(lambda: results.append(function()), rounds=ROUNDS)
    return float(benchmark.stats.stats.median) if benchmark.stats else 0.0


def seconds_of_dropped(benchmark: Any, function: Callable[[], Any]) -> float:
    """Median of a call, whose results are dropped at once, so that each gets the memory of the last."""
    function()
    benchmark.pedantic(function, rounds=ROUNDS)
    return float(benchmark.stats.stats.median) if benchmark.stats else 0.0


def fill_new_memory(shape: tuple[int, ...]) -> tuple[float, list[np.ndarray]]:
    """Median of writing zeros into memory that the process has not used before, and the arrays.

    They are kept, so that what is measured next does not get their memory.
    """
    kept, times = [], []
    for _ in range(ROUNDS):
        start = time.process_time()
        kept.append(np.empty(shape))
        kept[-1].fill(0.0)
        times.append(time.process_time() - start)
    return median(times), kept


@pytest.mark.parametrize("way", ["out", "new arrays", "new arrays, all kept"])
def test_pose(benchmark: Any, poses: np.ndarray, way: str, report: Callable[[str], None]) -> None:
    """Speed of `pose` into one array, into new ones that are dropped, and into new ones that are kept.

    The first two are equal: allocating costs nothing. Kept ones need memory that the process has not used
    before, 22 MB for 2000 poses, which the system must find and clear page by page. Filling such arrays with
    zeros shows how long that takes, and no solver can be faster.
    """
    solver = BapSolver()
    shape = (POSES, len(Skeleton.default()), 4, 4)
    out = np.empty(shape) if way == "out" else None
    np.testing.assert_allclose(solver.pose(poses, out=out), textbook(solver, poses), atol=1e-12)
    keeps = way == "new arrays, all kept"
    fill, held = fill_new_memory(shape) if keeps else (0.0, [])
    measure = seconds if keeps else seconds_of_dropped
    if took := measure(benchmark, lambda: solver.pose(poses, out=out)):
        slow = []
        for _ in range(TEXTBOOK_ROUNDS):
            start = time.process_time()
            textbook(solver, poses)
            slow.append(time.process_time() - start)
        benchmark.extra_info.update(
            rate=POSES / took, ratio=median(slow) / took, filling=fill / took, held=len(held)
        )
        report(
            f"pose, {way}: {POSES / took:,.0f} poses/s (186 BAPs -> 87 matrices), "
            f"{median(slow) / took:.1f} times NumPy"
            + (f"; filling such arrays with zeros takes {fill / took:.2f} of that time" if fill else "")
        )


def test_solve(benchmark: Any, poses: np.ndarray, report: Callable[[str], None]) -> None:
    solver = BapSolver()
    matrices = solver.pose(poses)
    assert np.abs(solver.solve(matrices[:1]) - poses[:1]).max() <= 1
    if took := seconds(benchmark, lambda: solver.solve(matrices)):
        benchmark.extra_info.update(rate=POSES / took)
        report(f"solve: {POSES / took:,.0f} poses/s (87 matrices -> 186 BAPs)")
