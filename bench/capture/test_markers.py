"""A minute of 50 markers at 100 Hz, from a C3D file to a stream."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import fba
from fba.face import FaceModel
from tools.captures import marked_actor, marker_files

SECONDS, RATE = 60, 100


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file: the built-in head talks and turns."""
    motion = marked_actor.perform(FaceModel.default(), SECONDS * RATE, RATE).motion
    return marker_files.write(tmp_path_factory.mktemp("markers"), "float.c3d", motion)


@pytest.mark.benchmark(timer=time.process_time)
def test_a_minute_of_markers(
    benchmark: Any, take: Path, tmp_path: Path, report: Callable[[str], None]
) -> None:
    def encode() -> int:
        fba.write(tmp_path / "a.fba", fba.read(take), clamp=True)
        return (tmp_path / "a.fba").stat().st_size

    size = benchmark.pedantic(encode, rounds=5, warmup_rounds=1)
    seconds = benchmark.stats.stats.median
    benchmark.extra_info.update(seconds=seconds, bytes=size)
    report(f"{SECONDS} s of 50 markers at {RATE} Hz to {size} bytes: {seconds:.2f} s of processor")
    assert size > 1000
