"""Speed of skinning: a person's vertices with normals, on one core.

Times are those of the processor, whatever else it has to do meanwhile.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from statistics import median
from typing import Any

import numpy as np
import pytest

from fba.body import BapSolver, BodyModel

ROUNDS = 300
MOST = 0.4e-3
"""Seconds for 10,000 vertices with normals."""


@pytest.mark.parametrize("method", ["dual", "linear"])
def test_skinning_a_person(benchmark: Any, report: Callable[[str], None], method: str) -> None:
    body = BodyModel.default()
    random = np.random.default_rng(2)
    poses = BapSolver(body.skeleton).pose(random.integers(-30_000, 30_000, (16, 296)))
    out, normals = np.empty_like(body.vertices), np.empty_like(body.vertices)

    def run() -> None:
        body.skin(poses[0], out, normals, method)

    run()
    times = []
    for number in range(ROUNDS):
        start = time.thread_time()
        body.skin(poses[number % len(poses)], out, normals, method)
        times.append(time.thread_time() - start)
    benchmark.pedantic(run, rounds=20)
    each = median(times) * 10_000 / len(body.vertices)
    benchmark.extra_info.update(milliseconds=each * 1e3)
    report(
        f"skinning, {method}: {each * 1e3:.3f} ms for 10,000 vertices with normals (of {len(body.vertices)})"
    )
    assert each < MOST
