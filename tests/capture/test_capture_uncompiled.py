"""Retargeting without machine code: the same BAPs, slower."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from capture_bodies import swinging_limbs
from fba.capture import from_skeleton
from fba.capture._limbs._coupled_paths import chain

HELPERS = Path(__file__).parents[1] / "helpers" / "figures"
SCRIPT = """
import json
from capture_bodies import swinging_limbs
from fba import compiled
from fba.capture import from_skeleton

print(json.dumps([compiled.is_compiled(), from_skeleton(swinging_limbs()).body.values.tolist()]))
"""


def test_the_same_baps_without_machine_code() -> None:
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", SCRIPT],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(HELPERS)},
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    compiled, values = json.loads(done.stdout)
    assert compiled is False
    body = from_skeleton(swinging_limbs()).body
    np.testing.assert_allclose(values, body.values, atol=1)  # machine code may round differently


@pytest.mark.parametrize("count", [1, 2, 7])
def test_coupled_frames_by_linear_algebra(count: int) -> None:
    random = np.random.default_rng(count)
    own, pull, bonds = (
        random.uniform(0.1, 1, count),
        random.normal(size=count),
        random.uniform(0, 2, count - 1),
    )
    matrix = np.diag(own)
    for t, bond in enumerate(bonds):
        matrix[t : t + 2, t : t + 2] += bond * np.array([[1, -1], [-1, 1]])
    expected = np.linalg.solve(matrix, pull)
    course = np.zeros(count)
    chain(own, bonds, pull, course)
    np.testing.assert_allclose(course, expected, rtol=1e-9)
