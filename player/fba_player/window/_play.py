"""`play`: open a window and play an animation in it."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np

from fba.animation import Animation
from fba.arrays import Float32, Float64
from fba.atomic import PathLike
from fba.face import Resolver
from fba.parameters import BapTable
from fba.tracks import BodyTrack, FaceTrack
from fba_player.export.render import as_scene
from fba_player.playback.live import LiveAnimation, LiveTimeline
from fba_player.scene.scene import Scene
from fba_player.session._session import Session
from fba_player.session._source import Source
from fba_player.view._camera import Camera
from fba_player.window._window import WARNING_SECONDS, Window

if TYPE_CHECKING:
    from fba_player.sound._player import Audio
    from fba_player.view.protocols import Showable

Newest = Callable[[], tuple[FaceTrack | None, BodyTrack | None]]
"""Returns tracks of one frame, the newest face and body of a live capture; None for a missing one."""
NEWEST_SECONDS = 1.0
"""Seconds from the end of what has arrived within which a picture shows the newest values."""


def play(
    animation: Animation | LiveAnimation | Showable,
    *,
    title: str | None = None,
    size: tuple[int, int] = (1280, 720),
    camera: Camera | str | None = None,
    loop: bool = True,
    speed: float = 1.0,
    start: float | None = None,
    paused: bool = False,
    interpolate: bool = True,
    audio: PathLike | None = None,
    audio_offset: float = 0.0,
    file: PathLike | None = None,
    bap_steps: BapTable = "iso",
    warnings: tuple[str, ...] = (),
    panels: tuple[str, ...] = (),
    newest: Newest | None = None,
) -> tuple[Path, ...]:
    """Play an animation in a window; return when it is closed, with the files dropped onto it.

    Those files can be read, and the user wants to see them next.

    title: of the window; the animation's name by default. size: of the window. camera: a `Camera`, the name
    of a preset, or None for the one that suits the content. speed: 0.1 to 4. start: seconds. interpolate:
    whether motion is smooth between frames. audio: a sound file, which begins audio_offset seconds after the
    first frame (earlier if negative); the picture then follows the clock of the sound device. file: where the
    animation was read from, with bap_steps, for the panels about the file. warnings: those given while it was
    read; the window shows them for some seconds, and the file panel lists them. panels: names of those open
    at first ("file", "view", "camera", "help"). newest: of a live capture, see `follow_newest`. F1 shows the
    keys. Motion follows the clock: a slow machine shows fewer pictures, not slower ones.

    Raises DisplayError if there is no display or no OpenGL 3.3, or OpenGL stops working, saying what to do;
    ValueError for an impossible speed or size or an unknown preset; FormatError for a sound file that cannot
    be read.
    """
    if not math.isfinite(audio_offset):
        raise ValueError(f"audio_offset must be a finite number of seconds, not {audio_offset}")
    scene: Showable
    if isinstance(animation, LiveAnimation):
        scene = Scene(cast(Animation, animation), timeline=LiveTimeline(animation))
    else:
        scene = as_scene(animation)
    source = Source(scene, file, bap_steps=bap_steps, warnings=warnings)
    with Window(scene, title=title, size=size, camera=camera, loop=loop, source=source) as window:
        window.transport.set_speed(speed)
        window.transport.interpolate = interpolate
        window.session.open |= set(panels)
        if newest is not None:
            follow_newest(window.session, newest)
        for text in warnings:
            window.session.say(text, "warning", WARNING_SECONDS)
        with contextlib.ExitStack() as stack:
            if audio is not None:
                sound = _add_sound(window.session, audio, audio_offset)
                if sound is not None:
                    stack.enter_context(sound)
            if start is not None:
                window.transport.seek(start)
            if not paused:
                window.transport.play()
            window.run()
        return window.session.dropped


def _add_sound(session: Session, path: PathLike, offset: float) -> Audio | None:
    """Add a sound to the session; return None, with a notice, if there is no sound device."""
    from fba_player.sound._player import open_audio

    session.audio = open_audio(path, session.transport, offset=offset)
    session.sound, session.sound_offset = path, offset
    if session.audio is None:
        name = os.path.basename(os.fspath(path))
        text = f"There is no sound device: {name} is not heard, but recorded films have it"
        session.say(text, "warning", 8.0)
    return session.audio


def follow_newest(session: Session, newest: Newest) -> None:
    """Let pictures show the newest values of a capture before the stream contains them.

    They do while the stream arrives and is played at its end. A user who pauses or seeks back sees the
    stream instead, until it is played to its end again.
    """
    scene = session.scene
    settings = scene.model if isinstance(scene, Scene) else None

    def show(faps: Float32, baps: Float64) -> None:
        transport = session.transport
        if not scene.timeline.growing:
            session.rolling.discard("newest")
            return
        if not transport.playing or transport.behind > NEWEST_SECONDS:
            return
        face, body = newest()
        if face is not None:
            faps[:] = Resolver(settings).push(face)[0]
        if body is not None:
            np.copyto(baps, body.values[0], where=body.mask[0])

    session.before_frame.append(show)
    session.rolling.add("newest")
