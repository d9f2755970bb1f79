"""Speed of the BAP solver and of motion capture -> BAPs, on one core."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from fba.body import BapSolver, Skeleton
from fba.body.conventions import convention
from fba.parameters import baps

POSES = 2000
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
    benchmark(function)
    return float(benchmark.stats.stats.median) if benchmark.stats else 0.0


def test_pose(benchmark: Any, poses: np.ndarray, report: Callable[[str], None]) -> None:
    solver = BapSolver()
    out = np.empty((POSES, len(Skeleton.default()), 4, 4))
    np.testing.assert_allclose(solver.pose(poses, out=out), textbook(solver, poses), atol=1e-12)
    if took := seconds(benchmark, lambda: solver.pose(poses, out=out)):
        report(f"pose: {POSES / took:,.0f} poses/s (186 BAPs -> 87 matrices, out=)")


def test_pose_by_numpy(benchmark: Any, poses: np.ndarray, report: Callable[[str], None]) -> None:
    solver = BapSolver()
    if took := seconds(benchmark, lambda: textbook(solver, poses)):
        report(f"pose by NumPy: {POSES / took:,.0f} poses/s")


def test_solve(benchmark: Any, poses: np.ndarray, report: Callable[[str], None]) -> None:
    solver = BapSolver()
    matrices = solver.pose(poses)
    assert np.abs(solver.solve(matrices[:1]) - poses[:1]).max() <= 1
    if took := seconds(benchmark, lambda: solver.solve(matrices)):
        report(f"solve: {POSES / took:,.0f} poses/s (87 matrices -> 186 BAPs)")
