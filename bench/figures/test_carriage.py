"""MP4 files: ten minutes of a face at 30 frames/s, written and read."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import fba
from fba.carriage.mp4 import read_mp4, write_mp4
from fba.codec import encode_animation

FRAMES = 18_000


@pytest.fixture(scope="module")
def stream() -> bytes:
    """A head that turns and a mouth that moves, with an I plane each second."""
    values, mask = np.zeros((FRAMES, 68), dtype=np.int32), np.zeros((FRAMES, 68), dtype=bool)
    phase = np.arange(FRAMES)[:, None] / np.arange(5, 17)
    values[:, 2:14], mask[:, 2:14] = np.rint(60 * np.sin(phase)), True
    values[:, 47:50], mask[:, 47:50] = np.rint(2000 * np.sin(phase[:, :3] / 9)), True
    animation = fba.Animation(30, np.arange(FRAMES), fba.FaceTrack(values, mask))
    return encode_animation(animation, fba.EncoderOptions(intra_period=1))[0]


@pytest.mark.parametrize("fragment", [None, 2])
def test_write(benchmark: Any, stream: bytes, fragment: int | None) -> None:
    benchmark.pedantic(write_mp4, (stream,), {"fragment": fragment}, rounds=1)


@pytest.mark.parametrize("fragment", [None, 2])
def test_read(benchmark: Any, stream: bytes, fragment: int | None) -> None:
    data = write_mp4(stream, fragment=fragment)
    assert benchmark.pedantic(read_mp4, (data,), rounds=1).stream == stream
    benchmark.extra_info["bytes of stream and file"] = len(stream), len(data)
