"""Animations and a virtual display for tests."""

import os
import shutil
import subprocess
from collections.abc import Iterator

import numpy as np
import pytest

import graphics
from fba.animation import Animation
from player_tracks import body_track, face_track
from set_clock import Clock


@pytest.fixture(scope="session")
def talking() -> Animation:
    """A face that opens its mouth, ten frames at 25 a second."""
    frames = [{3: 70 * t, 5: -60 * t, 31: 20 * t} for t in range(10)]
    return Animation(25, np.arange(10), face=face_track(frames), name="talking")  # type: ignore[arg-type]


@pytest.fixture(scope="session")
def walking() -> Animation:
    """A body with a face that lifts an arm and a knee, ten frames at 25 a second."""
    bodies = [{32: 9000 * t, 8: 5000 * t, 11: -8000 * t} for t in range(10)]
    faces = [{48: 2000 * t} for t in range(10)]
    return Animation(25, np.arange(10), face_track(faces), body_track(bodies), "walking")  # type: ignore[arg-type]


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture(scope="session")
def display() -> Iterator[str]:
    """The name of a virtual display of its own: skips where Xvfb is missing."""
    if shutil.which("Xvfb") is None:
        graphics.skip("Xvfb is not installed (Debian, Ubuntu: apt-get install xvfb)")
    read, write = os.pipe()
    server = subprocess.Popen(
        ["Xvfb", "-displayfd", str(write), "-screen", "0", "1000x800x24", "-nolisten", "tcp", "-noreset"],
        pass_fds=[write],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    os.close(write)
    pipe = os.fdopen(read)
    try:
        number = pipe.readline().strip()
        if not number:
            graphics.skip("Xvfb did not start")
        yield f":{number}"
    finally:
        pipe.close()
        server.terminate()
        server.wait(10)


@pytest.fixture
def on_display(display: str, monkeypatch: pytest.MonkeyPatch) -> str:
    """Windows of this process open on the virtual display."""
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    return display
