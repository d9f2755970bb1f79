"""Benchmarks: `./dev bench`. Absolute times belong to the machine; quote the ratios, from one run.

What a benchmark stores in `benchmark.extra_info` is what bench/summary.py prints. Every function is called
before it is timed, so that nothing is compiled within a measurement, and the garbage collector stays on, as
it does for users.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from fba import Animation, FaceTrack

SHARED = Path(os.environ.get("FBA_SHARED") or Path(__file__).parents[2] / "shared")
_LINES: list[str] = []


@pytest.fixture(scope="session")
def shared() -> Path:
    """Real-world material that may not be redistributed; benchmarks that need it skip where it is absent."""
    if not (SHARED / "vectors" / "index.json").is_file():
        pytest.skip("no shared test material; set FBA_SHARED to its folder")
    return SHARED


@pytest.fixture(scope="session")
def report() -> Callable[[str], None]:
    """Say a line in the summary at the end."""
    return _LINES.append


def pytest_terminal_summary(terminalreporter: Any) -> None:
    if _LINES:
        terminalreporter.section("measured")
        for line in _LINES:
            terminalreporter.write_line(line)


@pytest.fixture(scope="session")
def head_motion() -> tuple[Animation, str, str]:
    """2253 frames of 66 FAPs with alphabets of 3721 symbols: (animation, table of BAP steps, where from).

    The real stream `headmotion_long` where the shared material is there, else one of the same make.
    """
    stream = SHARED / "vectors" / "real" / "headmotion_long.fba"
    if stream.is_file():
        return fba.decode(stream.read_bytes(), bap_steps="visage"), "visage", stream.name
    return synthetic(2253), "iso", "synthetic"


def synthetic(frames: int, seed: int = 1) -> Animation:
    """Smooth random motion of all FAPs, most of them resting most of the time."""
    random = np.random.default_rng(seed)
    speed = random.normal(0.0, 40.0, (frames, 68)) * (random.random((frames, 68)) < 0.17)
    values = np.cumsum(speed, axis=0)
    values = np.rint(1500 * np.sin(values / 1500)).astype(np.int32)
    values[:, :2] = 0
    mask = np.ones((frames, 68), dtype=bool)
    mask[:, :2] = False
    return Animation(25, np.arange(frames), FaceTrack(values, mask))
