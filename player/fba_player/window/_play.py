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
from fba_player.session._life import Life
from fba_player.session._memory import Memory
from fba_player.session._session import Session
from fba_player.session._source import Source
from fba_player.sound._peaks import Peaks
from fba_player.view._camera import Camera
from fba_player.window._window import WARNING_SECONDS, Window
from fba_player.window.surface import Resumed, Surface, WindowClosedError

if TYPE_CHECKING:
    from fba_player.view.protocols import Showable

Newest = Callable[[], tuple[FaceTrack | None, BodyTrack | None]]
"""Returns tracks of one frame, the newest face and body of a live capture; None for a missing one."""
NEWEST_SECONDS = 1.0
"""Seconds from the end of what has arrived within which a picture shows the newest values."""


def play(
    animation: Animation | LiveAnimation | Showable | Callable[[], Showable],
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
    surface: Surface | None = None,
    life: bool = False,
    from_face: bool = False,
) -> tuple[Path, ...]:
    """Play an animation in a window; return when it is closed, with the files dropped onto it.

    Those files can be read, and the user wants to see them next.

    animation: may be a function that makes the scene, called when the window is there, so that it is there at
    once. title: of the window; the animation's name by default. size: of the window. camera: a `Camera`, the
    name of a preset, or None for the one that suits the content. speed: 0.1 to 4. start: seconds.
    interpolate: whether motion is smooth between frames. audio: a sound file, which begins audio_offset
    seconds after the first frame (earlier if negative); the picture then follows the clock of the sound
    device. file: where the animation was read from, with bap_steps, for the panels about the file. warnings:
    those given while it was read; the window shows them for some seconds, and the file panel lists them.
    panels: names of those open at first ("file", "view", "camera", "help"). newest: of a live capture, see
    `follow_newest`. life: whether a figure blinks, looks about and breathes where the animation does not move
    it; films and pictures never have that. from_face: whether it begins with the face, and goes back to
    `camera` after some seconds. F1 shows the keys. Motion follows the clock: a slow machine shows fewer
    pictures, not slower ones.

    surface: a `Surface` where it is shown, and which stays open: pass it again to show the files that are
    returned in the same window. Files that were shown are then remembered, and a file that has changed on
    disk is returned, to be shown again from where it was. By default it is a new window.

    Raises DisplayError if there is no display or no OpenGL 3.3, or OpenGL stops working, saying what to do;
    ValueError for an impossible speed or size or an unknown preset; FormatError for a sound file that cannot
    be read.
    """
    if not math.isfinite(audio_offset):
        raise ValueError(f"audio_offset must be a finite number of seconds, not {audio_offset}")
    with contextlib.ExitStack() as stack:
        if surface is None:
            surface = stack.enter_context(Surface(size))
        else:
            surface.memory = Memory()
        stack.enter_context(contextlib.suppress(WindowClosedError))
        if callable(animation):
            surface.open(title or "fba")
            surface.tell("Preparing the figure", 0.25)
            animation = animation()
        scene = _scene_of(animation)
        surface.tell("Preparing light and panels", 0.5)
        source = Source(scene, file, bap_steps=bap_steps, warnings=warnings)
        window = stack.enter_context(
            Window(scene, title=title, size=size, camera=camera, loop=loop, source=source, surface=surface)
        )
        session, resumed = window.session, surface.resumed
        window.follows_file = session.memory is not None
        session.read = surface.read or session.read
        window.transport.set_speed(speed)
        window.transport.interpolate = interpolate
        _set_up(session, panels, warnings, newest, life=life, from_face=from_face)
        if audio is not None:
            _add_sound(stack, session, audio, audio_offset, again=resumed is not None)
        if start is not None:
            window.transport.seek(start)
        if resumed is not None:
            _resume(session, resumed)
            paused = not resumed.playing
        return _run(window, surface, paused=paused)
    return ()  # closed before the scene was there


def _run(window: Window, surface: Surface, *, paused: bool) -> tuple[Path, ...]:
    """Show a prepared window until it is closed; return the files dropped onto it."""
    session = window.session
    surface.tell("Drawing the first picture", 0.75)
    shown = window.update()
    surface.show_scene()
    if surface.resumed is not None:  # said now, as preparing may take longer than notices are shown
        session.say(f"{session.source.name} has changed on disk, and is shown again", about="reload")
    if shown and not paused:  # the first picture takes long: time begins when it is there
        window.transport.play()
    window.run()
    surface.resumed = _state(session) if session.resumes else None
    return session.dropped


def _set_up(
    session: Session,
    panels: tuple[str, ...],
    warnings: tuple[str, ...],
    newest: Newest | None,
    *,
    life: bool,
    from_face: bool,
) -> None:
    """Set what a session begins with, see `play`."""
    session.open |= set(panels)
    for text in warnings:
        session.say(text, "warning", WARNING_SECONDS)
    if newest is not None:
        follow_newest(session, newest)
    if session.memory is not None and session.source.path is not None:
        session.memory.add(session.source.path)
    if life and isinstance(session.scene, Scene):
        session.life = Life(session.scene.animation)
    if from_face:
        session.viewpoint.begin_with_face()


def _scene_of(animation: Animation | LiveAnimation | Showable) -> Showable:
    if isinstance(animation, LiveAnimation):
        return Scene(cast(Animation, animation), timeline=LiveTimeline(animation))
    return as_scene(animation)


def _state(session: Session) -> Resumed:
    transport, zoom = session.transport, session.zoom
    return Resumed(
        transport.time,
        transport.playing,
        session.viewpoint.view,
        (transport.mark_in, transport.mark_out),
        None if zoom.shows_all else (zoom.low, zoom.high),
        frozenset(session.open),
        session.lanes,
    )


def _resume(session: Session, state: Resumed) -> None:
    """Go on with a file that has changed where the window was."""
    transport, zoom = session.transport, session.zoom
    transport.mark_in, transport.mark_out = state.marks
    transport.seek(min(max(state.time, transport.start), transport.end))
    session.viewpoint.restore(state.view)
    session.open |= state.panels
    session.lanes = state.lanes
    if state.zoom is not None:
        low, high = state.zoom
        zoom.bound(transport.start, transport.end)
        zoom.zoom((high - low) / max(zoom.high - zoom.low, 1e-9), zoom.low)
        zoom.pan(low - zoom.low)


def _add_sound(
    stack: contextlib.ExitStack, session: Session, path: PathLike, offset: float, *, again: bool
) -> None:
    """Add a sound and its outline to the session, until the stack is closed.

    again: whether the file was shown before, and a missing sound device is known.
    """
    from fba_player.sound._player import open_audio

    session.audio = open_audio(path, session.transport, offset=offset)
    session.sound, session.sound_offset = path, offset
    if session.audio is not None:
        stack.enter_context(session.audio)
    elif not again:
        name = os.path.basename(os.fspath(path))
        text = f"There is no sound device: {name} is not heard, but recorded films have it"
        session.say(text, "warning", 8.0)
    session.peaks = stack.enter_context(Peaks(path))
    session.peaks.start()


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
