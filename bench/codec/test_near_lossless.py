"""Speed of encoding within a tolerance: FAPs of ten minutes on one core, and what an hour would take."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import fba
from fba import Animation, FaceTrack
from fba.planning import encode_planned, encode_within_tolerance

pytestmark = pytest.mark.benchmark(timer=time.process_time)  # of one core, whoever else uses the machine
MINUTES = 10


@pytest.fixture(scope="module")
def talk(head_motion: tuple[Animation, str, str]) -> Animation:
    """A stream there and back again, for ten minutes."""
    face = head_motion[0].face
    assert face is not None
    count = 25 * 60 * MINUTES
    times = -(-count // (2 * len(face)))
    rows = np.tile(np.concatenate([np.arange(len(face)), np.arange(len(face))[::-1]]), times)[:count]
    return Animation(25, np.arange(count), FaceTrack(face.values[rows], face.mask[rows]))


def test_planned_encoding(benchmark: Any, talk: Animation, report: Callable[[str], None]) -> None:
    """Within 0.5 mm, beside compact and plain encoding in the same run."""
    encode_within_tolerance(talk[:50])
    seconds = {}
    for name, encode in (("plain", fba.encode), ("compact", compact)):
        encode(talk[:50])
        before = time.process_time()
        encode(talk)
        seconds[name] = time.process_time() - before
    data, result = benchmark.pedantic(encode_within_tolerance, (talk,), rounds=1)
    assert result.face is not None
    seconds["within 0.5 mm"] = benchmark.stats.stats.median
    hourly = {name: one * 60 / MINUTES for name, one in seconds.items()}
    benchmark.extra_info.update(hourly)
    report(
        "an hour of FAPs: "
        + ", ".join(f"{name} {one:.1f} s" for name, one in hourly.items())
        + f"; {8 * len(data) / float(talk.duration):.0f} bit/s, {result.face.largest * 1000:.3f} mm"
    )


def compact(animation: Animation) -> bytes:
    return encode_planned(animation, preset="compact")[0]
