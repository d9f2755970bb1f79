"""What the panels of the window cost the processor in a picture, outside OpenGL: 2 ms at most; and memory."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from fba import Animation
from fba.errors import DisplayError
from fba_player.scene.scene import Scene
from fba_player.session._session import Session
from fba_player.session._source import Source

pytest.importorskip("imgui_bundle", exc_type=ImportError)

from tools.window_picture import Studio

GOAL = 2e-3
"""Seconds a picture."""
BATCH, ROUNDS = 5, 80


class Lists:
    """In the place of the renderer: what it does before OpenGL is asked to draw."""

    def __init__(self, renderer: Any) -> None:
        self._renderer = renderer

    def draw(self, data: Any) -> None:
        self._renderer._upload(data)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._renderer, name)


@pytest.fixture(scope="module")
def moving(tmp_path_factory: pytest.TempPathFactory) -> tuple[Animation, Path]:
    """Ten seconds of a face and a body, as a stream of 25 frames a second."""
    frames = 250
    face, body = fba.FaceTrack.empty(frames), fba.BodyTrack.empty(frames)
    values, moves = np.array(face.values), np.array(body.values)
    values[:, 2:12] = (300 * np.sin(np.arange(frames)[:, None] / np.arange(5, 15))).astype(int)
    moves[:, 30:40] = (9000 * np.sin(np.arange(frames)[:, None] / np.arange(5, 15))).astype(int)
    tracks = fba.FaceTrack(values, values != 0), fba.BodyTrack(moves, moves != 0)
    animation = Animation(25, np.arange(frames), *tracks)  # type: ignore[arg-type]
    path = tmp_path_factory.mktemp("bench") / "moving.fba"
    fba.write(path, animation)
    return fba.read(path), path


@pytest.fixture(params=["timeline", "all panels"])
def studio(request: pytest.FixtureRequest, moving: tuple[Animation, Path]) -> Iterator[Studio]:
    animation, path = moving
    scene = Scene(animation)
    session = Session(scene, source=Source(scene, path), size=(1280, 720))
    session.source.probe(wait=True)
    try:
        made = Studio(session)
    except DisplayError as error:
        pytest.skip(str(error))
    with made:
        if request.param == "all panels":
            session.open |= {panel.name for panel in made.gui.panels if panel.available(session)}
        made.draw(6)
        yield made


def test_panels_outside_opengl(benchmark: Any, studio: Studio) -> None:
    studio.gui._renderer = Lists(studio.gui._renderer)  # type: ignore[assignment]
    studio.session.transport.play()
    best = [float("inf")]

    def batch() -> None:
        begun = time.thread_time()
        for _ in range(BATCH):
            studio.gui.draw(1 / 60)
        best[0] = min(best[0], (time.thread_time() - begun) / BATCH)

    with studio._gl:
        benchmark.pedantic(batch, rounds=ROUNDS)
    studio.gui._renderer = studio.gui._renderer._renderer
    benchmark.extra_info["milliseconds of the processor a picture"] = round(best[0] * 1e3, 2)
    assert best[0] < GOAL


def test_panels_hold_their_memory(studio: Studio) -> None:
    statm = Path("/proc/self/statm")
    if not statm.exists():
        pytest.skip("only Linux tells how much memory a process has")

    def pictures(count: int) -> int:
        """Draw, and give the resident bytes."""
        with studio._gl:
            studio._screen.use()
            for _ in range(count):
                studio.gui.draw(1 / 60)
                studio._gl.finish()  # as showing them would
        return int(statm.read_text().split()[1]) * 4096

    studio.session.size = (320, 240)
    studio.draw(4)
    before = pictures(200)
    assert pictures(1000) - before < 1_000_000
