"""A live capture: from a datagram to the FAPs that are drawn, and to the bytes of the file."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fba.capture import SkeletonMotion
from fba.capture.live import LiveSkeleton
from fba.live import Capture, StreamFile, StreamRecorder, find_kind
from fba.live._people import standard_offsets
from fba.live._protocols import unity_bones
from tools.captures import face_files

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


@pytest.mark.parametrize("frames", [1, 4])
def test_a_body(benchmark: Any, frames: int, report: Callable[[str], None]) -> None:
    """From poses to BAPs, so many at once."""
    motion = walk_of_bones()
    skeleton = LiveSkeleton(motion)

    def convert() -> None:
        for start in range(0, 20 * frames, frames):
            part = slice(start, start + frames)
            skeleton.convert(motion.rotations[part], motion.positions[part], motion.rate)

    convert()
    benchmark.pedantic(convert, rounds=3, iterations=1)
    report(f"{frames} frames at once: {1000 * benchmark.stats.stats.median / 20:.1f} ms")


def walk_of_bones() -> SkeletonMotion:
    """A person of Unity's bones that swings arms and legs, without a file."""
    names = ("Hips", "Spine", "Neck", "Head", "LeftUpperArm", "LeftLowerArm", "LeftHand", "RightUpperArm",
             "RightLowerArm", "RightHand", "LeftUpperLeg", "LeftLowerLeg", "LeftFoot", "RightUpperLeg",
             "RightLowerLeg", "RightFoot")  # fmt: skip
    parents = np.array([-1, 0, 1, 2, 1, 4, 5, 1, 7, 8, 0, 10, 11, 0, 13, 14])
    turns = np.tile([1.0, 0.0, 0.0, 0.0], (80, len(names), 1))
    angles = 0.3 * np.sin(np.arange(80) / 10)
    for bone in (4, 7, 10, 13):
        turns[:, bone] = np.stack([np.cos(angles), np.sin(angles), 0 * angles, 0 * angles], axis=1)
    joints = {name: unity_bones.joint_of(name) or "" for name in names}
    offsets = standard_offsets(names, parents.tolist())
    path = np.tile([0.0, 0.95, 0.0], (80, 1))
    return SkeletonMotion(names, parents, offsets, turns, path, Fraction(30), declared=joints, up="+y")
