"""A live capture: from a datagram to the FAPs that are drawn, and to the bytes of the file."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fba.live import Capture, StreamFile, StreamRecorder, find_kind
from fba_conformance.captures import face_files

COUNT = 1200


@pytest.fixture(scope="module")
def datagrams() -> list[bytes]:
    """Twenty seconds of Live Link Face at 60 Hz; all 52 shapes and nine angles move."""
    return face_files.livelink_udp({**face_files.face_weights(COUNT), **face_files.face_angles(COUNT)})


@pytest.mark.parametrize("what", ["drawn", "recorded"])
def test_a_datagram(
    benchmark: Any, datagrams: list[bytes], tmp_path: Path, what: str, report: Callable[[str], None]
) -> None:
    times: list[float] = []

    def receive() -> None:
        times.clear()
        recorder = StreamRecorder([StreamFile(tmp_path / "a.fba")])
        capture = Capture(
            find_kind("livelink"), recorder.push if what == "recorded" else lambda _frames: None
        )
        for row, data in enumerate(datagrams):
            begin = time.perf_counter()
            capture.receive(data, "10.0.0.2", row / 60)
            if what == "drawn":
                capture.newest()
            times.append(time.perf_counter() - begin)
        capture.finish()
        recorder.finish()

    receive()
    benchmark.pedantic(receive, rounds=3, iterations=1)
    slow = sorted(times)[int(0.99 * len(times))]
    report(
        f"{what}: {1000 * statistics.median(times):.2f} ms a datagram, {1000 * slow:.2f} ms in 99 % of them; "
        f"{1 / statistics.fmean(times):.0f} datagrams a second"
    )
