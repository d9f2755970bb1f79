"""A stream that still arrives, and several performances, in the window itself."""

from __future__ import annotations

import io
import os
from pathlib import Path

import numpy as np

import fba
import graphics
from fba.animation import Animation
from fba.body import gait
from fba.codec import Decoder
from fba_player.playback.live import LiveAnimation, LiveTimeline
from fba_player.scene.compare import CompareScene
from fba_player.scene.scene import Scene
from fba_player.view.protocols import Showable
from fba_player.window._window import Window
from open_windows import or_skip, settle, shown, until
from player_tracks import face_track

graphics.imported("glfw")
graphics.imported("imgui_bundle")


def window_of(scene: Showable, folder: Path) -> Window:
    return or_skip(lambda: Window(scene, size=(480, 320), folder=folder, loop=False))


def test_a_stream_is_shown_while_it_arrives(on_display: str, tmp_path: Path) -> None:
    frames = [{3: 12 * t, 5: -9 * t} for t in range(60)]
    data = fba.encode(Animation(25, np.arange(60), face=face_track(frames)))  # type: ignore[arg-type]
    planes = [frame.plane for frame in Decoder().push(data)]
    middle = (planes[30].bit + planes[30].bits) // 8
    read, write = os.pipe()
    with os.fdopen(read, "rb") as source, os.fdopen(write, "wb", buffering=0) as sender:
        sender.write(data[:middle])
        live = LiveAnimation(source, name="wire")
        assert live.wait(300)
        with window_of(Scene(live, timeline=LiveTimeline(live)), tmp_path) as window:  # type: ignore[arg-type]
            settle(window)
            pictures, length = window.pictures, window.transport.duration
            sender.write(data[middle:])
            sender.close()
            assert live.wait_end(300)
            until(window, lambda: window.pictures > pictures)  # though it is paused
            assert window.transport.duration > length
            assert window.transport.time == 0.0
            window.transport.set_speed(4.0)
            window.transport.play()
            until(window, lambda: not window.transport.playing)
            assert window.transport.frame == 59


def test_a_stream_that_is_read_with_other_steps_is_noticed_once(on_display: str, tmp_path: Path) -> None:
    stream = io.BufferedReader(
        io.BytesIO(fba.encode(gait.walk(), fba.EncoderOptions(bap_steps="visage", mark=False)))
    )  # type: ignore[arg-type]
    live = LiveAnimation(stream, name="wire")
    assert live.wait_end(300)
    with window_of(Scene(live, timeline=LiveTimeline(live)), tmp_path) as window:  # type: ignore[arg-type]
        until(window, window.session.notices)
        (notice,) = window.session.notices()
        assert (notice.kind, notice.text) == ("warning", live.doubt)
        assert notice.text.endswith("made with --bap-steps visage?")
        window.session.say("else", about=notice.about)  # takes its place
        settle(window)
        assert [one.text for one in window.session.notices()] == ["else"]


def test_two_performances_stand_side_by_side(on_display: str, tmp_path: Path) -> None:
    talks = [Animation(25, np.arange(5), face=face_track([{3: v}] * 5), name=str(v)) for v in (0, 500)]  # type: ignore[arg-type]
    with window_of(CompareScene([Scene(talk) for talk in talks]), tmp_path) as window:
        settle(window)
        picture = shown(window)[40:200]
        skin = picture[..., 0] - picture[..., 2] > 25
        assert skin[:, :240].sum() > 1500
        assert skin[:, 240:].sum() > 1500
        window.session.open.add("differences")
        window._redraw()
        settle(window)
        assert shown(window)[40:200, 240:].mean() < picture[:, 240:].mean() - 20  # the panel covers that side
