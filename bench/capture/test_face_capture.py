"""Ten minutes of blendshapes at 60 Hz, from a table of Live Link Face to a stream, and the way back."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import fba
from tools.captures import face_files

SECONDS, RATE = 600, 60


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All 52 shapes and nine angles move all the time."""
    count = SECONDS * RATE
    columns = {**face_files.face_weights(count), **face_files.face_angles(count)}
    path = tmp_path_factory.mktemp("faces") / "face.csv"
    path.write_text(face_files.livelink_csv(columns))
    return path


@pytest.mark.benchmark(timer=time.process_time)
def test_ten_minutes_of_blendshapes(
    benchmark: Any, table: Path, tmp_path: Path, report: Callable[[str], None]
) -> None:
    parts: dict[str, float] = {}

    def encode() -> int:
        begin = time.process_time()
        animation = fba.read(table, swap="no")
        parts["read"] = time.process_time() - begin
        fba.write(tmp_path / "a.fba", animation, clamp=True)
        return (tmp_path / "a.fba").stat().st_size

    size = benchmark.pedantic(encode, rounds=5, warmup_rounds=1)
    seconds = benchmark.stats.stats.median
    benchmark.extra_info.update(seconds=seconds, bytes=size, read=parts["read"])
    report(
        f"{SECONDS} s of 52 shapes at {RATE} Hz to {size} bytes: {seconds:.2f} s of processor, "
        f"{parts['read']:.2f} s of them for reading the table"
    )
    assert size > 1000


@pytest.mark.benchmark(timer=time.process_time)
def test_ten_minutes_of_faps_to_blendshapes(
    benchmark: Any, table: Path, tmp_path: Path, report: Callable[[str], None]
) -> None:
    animation = fba.read(table, swap="no")
    benchmark.pedantic(fba.write, (tmp_path / "a.csv", animation), rounds=3, warmup_rounds=1)
    seconds = benchmark.stats.stats.median
    benchmark.extra_info.update(seconds=seconds)
    report(f"{SECONDS} s of FAPs to a table of blendshapes: {seconds:.2f} s of processor")
