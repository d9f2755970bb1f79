"""A face that arrives live, in the window: the newest values while it plays at its end."""

from __future__ import annotations

import io

import numpy as np
import pytest

import fba
from fba.animation import Animation
from fba.tracks import BodyTrack, FaceTrack
from fba_player.playback.live import LiveAnimation, LiveTimeline
from fba_player.scene.scene import Scene
from fba_player.session._session import Session
from fba_player.window._play import follow_newest
from player_tracks import face_track


def test_the_newest_values_are_shown_while_it_plays_at_its_end() -> None:
    frames = [{3: 10 * t} for t in range(100)]
    data = fba.encode(Animation(25, np.arange(100), face=face_track(frames)))  # type: ignore[arg-type]
    live = LiveAnimation(io.BufferedReader(io.BytesIO(data)))  # type: ignore[arg-type]
    assert live.wait_end(300)
    assert live.wait()
    live.growing = True  # as before its end
    now = [0.0]
    session = Session(Scene(live, timeline=LiveTimeline(live)), clock=lambda: now[0])  # type: ignore[arg-type]
    asked: list[bool] = []

    def newest() -> tuple[FaceTrack | None, BodyTrack | None]:
        asked.append(True)
        return face_track([{3: 777}]), None

    follow_newest(session, newest)
    assert session.restless  # pictures all the time

    def jaw(time: float) -> float:
        session.view(time)
        return float(session.values[0][2])

    assert jaw(1.0) == pytest.approx(250, abs=4)  # paused
    assert not asked
    session.transport.play()
    assert jaw(session.transport.time) < 10  # far from the end: what was recorded
    session.transport.last()
    assert jaw(session.transport.time) == 777
    live.growing = False
    assert jaw(2.0) == pytest.approx(500, abs=4)
    assert not session.rolling
    live.close()
