"""Speed of `fba render` to MP4 at 1280x720: drawing alone, encoding alone, both together.

Times are those of the processor, all threads together: what a frame costs, whoever else is at work. On two
cores, a film is rendered at 60 frames/s where both together cost less than 33 ms.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fba import Animation, BodyTrack
from fba.errors import DisplayError
from fba.player import Offscreen, Recorder

SIZE = (1280, 720)
FRAMES = 60
GOAL = 2 / 60
"""Seconds of two processors for a frame at 60 frames/s."""


def gesture(frames: int) -> BodyTrack:
    """Both arms, the trunk and the head move all the time."""
    values, mask = np.zeros((frames, 296), dtype=np.int32), np.zeros((frames, 296), dtype=bool)
    for number, (bap, reach) in enumerate({32: 60000, 33: 60000, 40: 50000, 41: 50000, 25: 9000}.items()):
        values[:, bap - 1] = np.rint(reach * np.sin(np.arange(frames) / (7 + number)))
        mask[:, bap - 1] = True
    return BodyTrack(values, mask)


@pytest.fixture(scope="module", params=["head", "head and body"])
def drawn(request: pytest.FixtureRequest, head_motion: tuple[Animation, str, str]) -> Iterator[Any]:
    animation = head_motion[0][:FRAMES]
    if request.param != "head":
        animation = Animation(animation.rate, animation.index, animation.face, gesture(FRAMES))
    try:
        with Offscreen(animation, SIZE) as view:
            yield request.param, view, [float(time) for time in animation.times]
    except DisplayError as error:
        pytest.skip(f"no OpenGL without a display: {error}")


def spent(function: Callable[[], None]) -> float:
    """Seconds of all processors for a frame."""
    start = time.process_time()
    function()
    return (time.process_time() - start) / FRAMES


def test_render_to_mp4(benchmark: Any, drawn: Any, tmp_path: Path, report: Callable[[str], None]) -> None:
    name, view, times = drawn
    view.draw(times[0])
    pictures = [view.draw(at).copy() for at in times[:: FRAMES // 6]]

    def draw() -> None:
        for at in times:
            view.draw(at)

    def copy() -> None:
        for number in range(FRAMES):
            pictures[number % 6].copy()

    def film() -> None:
        with Recorder(tmp_path / "both.mp4", SIZE, rate=25) as recorder:
            for at in times:
                recorder.add(view.draw(at))

    kept = [view.draw(at).copy() for at in times]

    def encode() -> None:
        with Recorder(tmp_path / "encoded.mp4", SIZE, rate=25) as recorder:
            for pixels in kept:
                recorder.add(pixels)

    drawing, encoding, copying = (min(spent(step) for _ in range(2)) for step in (draw, encode, copy))
    both = spent(film)
    benchmark.pedantic(film, rounds=3)
    wall = benchmark.stats.stats.median
    kilobits = (tmp_path / "both.mp4").stat().st_size * 8 / FRAMES / 1e3
    benchmark.extra_info.update(pictures=FRAMES / wall, processor=both * 1e3)
    report(
        f"render {name} to MP4 at {SIZE[0]}x{SIZE[1]}: {both * 1e3:.1f} ms of processor a frame (goal "
        f"{GOAL * 1e3:.0f}: 60 frames/s on two cores), drawing alone {drawing * 1e3:.1f}, encoding alone "
        f"{encoding * 1e3:.1f}; ratio encoding to drawing {encoding / drawing:.2f}, encoding to a copy of "
        f"the picture {encoding / copying:.0f}; {FRAMES / wall:.0f} frames/s now, {kilobits:.0f} kbit a frame"
    )
