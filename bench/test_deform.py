"""Figures deformed by the processor and on the graphics card, or on what stands in for one: each way's own
time a picture outside OpenGL and its pictures a second at 1280x720, in turns within one run.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import pytest

from bench.test_player import GL, _timed
from fba.animation import Animation
from fba.errors import DisplayError
from fba.formats import merge, read

moderngl = pytest.importorskip("moderngl")
FRAMES = 60
SIZE = (1280, 720)
WAYS = ("cpu", "gpu")


def sample(face_alone: bool) -> Animation:
    """Five seconds of a head, or of a body with it."""
    folder = files("fba") / "samples"
    face = read(Path(str(folder / "hello.fap")))
    return face if face_alone else merge(face, read(Path(str(folder / "hello.bvh"))).resample(face.rate))


@pytest.fixture(params=["face", "person"])
def views(request: Any) -> Iterator[tuple[str, dict[str, Any]]]:
    """One scene, shown in both ways."""
    from fba.player import Offscreen

    animation = sample(request.param == "face")
    if request.param == "face":
        animation = replace(animation, body=None)
    with ExitStack() as stack:
        try:
            found = {way: stack.enter_context(Offscreen(animation, SIZE, deform=way)) for way in WAYS}
        except DisplayError as error:
            pytest.skip(str(error))
        yield request.param, found


def test_both_ways(
    views: tuple[str, dict[str, Any]],
    report: Callable[[str], None],
    monkeypatch: pytest.MonkeyPatch,
    benchmark: Any,
) -> None:
    name, shown = views
    within = [0.0]
    for kind, methods in GL.items():
        for method in methods:
            original = getattr(getattr(moderngl, kind), method)
            monkeypatch.setattr(getattr(moderngl, kind), method, _timed(original, within))
    moments = np.linspace(0, float(shown["cpu"].scene.duration) * 0.98, FRAMES)
    own: dict[str, list[float]] = {way: [] for way in WAYS}
    walls: dict[str, list[float]] = {way: [] for way in WAYS}

    def both(moment: float) -> None:
        for way in WAYS:
            within[0] = 0.0
            start = time.thread_time(), time.perf_counter()
            shown[way].draw(moment)
            own[way].append(time.thread_time() - start[0] - within[0])
            walls[way].append(time.perf_counter() - start[1])

    for moment in moments[:5]:
        both(float(moment))
    for kept in (*own.values(), *walls.values()):
        kept.clear()
    following = iter(np.tile(moments, 2))
    benchmark.pedantic(lambda: both(float(next(following))), rounds=FRAMES)
    assert shown["gpu"].deformed == ("gpu", "as wished")
    (cpu, gpu), (slow, quick) = ([median(times[way]) for way in WAYS] for times in (own, walls))
    report(
        f"{name}, deformed by the processor and through OpenGL: {cpu * 1e3:.2f} and {gpu * 1e3:.2f} ms of "
        f"its own a picture ({gpu / cpu:.2f}); {1 / slow:.0f} and {1 / quick:.0f} pictures/s "
        f"({slow / quick:.2f})"
    )
