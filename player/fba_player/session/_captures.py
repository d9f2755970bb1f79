"""Screenshots and films of a window."""

from __future__ import annotations

import os
import re
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fba.arrays import UInt8
from fba.errors import FbaError
from fba_player.export._offscreen import cut_out
from fba_player.export._recorder import Recorder
from fba_player.export.image_files import write_picture
from fba_player.gl._framebuffer import Target
from fba_player.gl._renderer import Renderer
from fba_player.session._session import Session
from fba_player.sound.soundtrack import FilmSound
from fba_player.view.switches import Quality

FILM_RATE = 30
"""Frames per second of a film of the window."""
SPEED_FRAMES = 30
"""Frames of a film over which its speed is measured."""


class FilmClock:
    """The clock of a window while it records a film: it goes on by one frame with each picture.

    So the film has all of its frames, however long a picture takes to be drawn and encoded; on a slow machine
    what the window shows goes more slowly meanwhile.

    clock: that of the window before, which this one continues and never overtakes.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self.before = clock
        self.frames = 0
        self._begun = clock()
        self._drawn: deque[float] = deque(maxlen=SPEED_FRAMES)

    def __call__(self) -> float:
        return self._begun + self.seconds

    @property
    def seconds(self) -> float:
        """Length of the film so far."""
        return self.frames / FILM_RATE

    def go_on(self) -> float:
        """Go to the next frame of the film; return by how many seconds it has gone on per second of late."""
        self.frames += 1
        self._drawn.append(self.before())
        taken = self._drawn[-1] - self._drawn[0]
        return (len(self._drawn) - 1) / FILM_RATE / taken if taken > 0 else 1.0


class Captures:
    """Saves the screenshots and records the films that a session requests.

    folder: where they are saved; by default the current one. They are named after the file shown, screenshots
    also after the frame; no file is overwritten.
    """

    def __init__(self, session: Session, folder: str | os.PathLike[str] | None = None) -> None:
        self.session = session
        self.folder = Path(folder) if folder is not None else Path()
        self._recorder: Recorder | None = None
        self._sound: FilmSound | None = None
        self._clock: FilmClock | None = None
        self._clock_of_transport: tuple[Callable[[], float], float] = (session.clock, 0.0)
        self._read: Callable[[], UInt8] | None = None

    @property
    def recording(self) -> bool:
        return self._recorder is not None

    def screenshot(self, pixels: UInt8, *, transparent: bool = False) -> Path | None:
        """Save a picture, uint8 (H, W, 4), as PNG; return its path, or None, with a notice, if it fails."""
        path = self._unused_path(f"-{self.session.transport.frame:04d}", ".png")
        try:
            write_picture(path, pixels, transparent=transparent)
        except (OSError, FbaError) as error:
            self.session.say(f"The picture could not be saved: {error}", "error", 8.0)
            return None
        self.session.say(f"Saved as {path}")
        return path

    def toggle_recording(self) -> None:
        if self._recorder is not None:
            self._finish()
            return
        path = self._unused_path("-film", ".mp4")
        sound = self._open_sound()
        try:
            self._recorder = Recorder(path, self.session.size, rate=FILM_RATE, audio=sound)
        except (OSError, FbaError, ValueError) as error:
            if sound is not None:
                sound.close()
            self.session.say(f"No film can be recorded: {error}", "error", 8.0)
            return
        self._sound = sound
        self._follow_film()

    def begin_picture(self) -> None:
        """Add the last picture to the film, mix its sound up to now; call before each picture is drawn."""
        self._add_read()
        if self._sound is not None and self._clock is not None:
            self._sound.advance(self._clock.seconds)

    def add_picture(self, start: Callable[[], Callable[[], UInt8]]) -> None:
        """Add the picture drawn since `begin_picture` to the film, whose clock goes on to the next.

        start: begins to read it, and returns a function that gives its pixels, uint8 (H, W, 4), which is
        called when the next picture begins, so that the graphics card is not waited for. start is not called
        if no film is recorded.
        """
        if self._clock is not None:
            self._read = start()
            self.session.recording_speed = self._clock.go_on()
            self.session.recording = self._clock.seconds

    def close(self) -> Path | None:
        """Finish the film; return its path, None if none is being recorded. Raises FbaError, OSError."""
        self._add_read()
        if self._recorder is None:
            return None
        recorder, sound = self._recorder, self._sound
        if sound is not None:
            sound.advance(float(recorder.seconds))
            sound.end()
        self._stop()
        return recorder.close()

    def _add_read(self) -> None:
        """Add the picture that is being read to the film, if there is one."""
        read, self._read = self._read, None
        if self._recorder is None or read is None:
            return
        try:
            self._recorder.add(read())
        except (OSError, FbaError) as error:
            self._stop()
            self.session.say(f"Recording stopped: {error}", "error", 8.0)

    def _follow_film(self) -> None:
        """Let all that moves follow the clock of the film; the sound is in it, and not heard meanwhile."""
        session = self.session
        self._clock = session.clock = FilmClock(session.clock)
        self._clock_of_transport = session.transport.use_clock(self._clock)
        session.recording, session.recording_speed = 0.0, 1.0
        if session.audio is not None:
            session.audio.held = True
            session.say("The film has the sound; it is not heard while the film is recorded", about="film")

    def _stop(self) -> None:
        """Forget the film, and follow the clocks of before."""
        session = self.session
        self._recorder = self._sound = session.recording = None
        if self._clock is None:
            return
        session.clock = self._clock.before
        session.transport.use_clock(*self._clock_of_transport)
        self._clock = None
        if session.audio is not None:
            session.audio.held = False

    def _open_sound(self) -> FilmSound | None:
        """Return the sound for a new film; None without sound, or, with a notice, if it cannot be used."""
        session = self.session
        if session.sound is None:
            return None
        if session.audio is not None and session.audio.muted:
            session.say("The sound is off: the film is silent until it is on (V)", "warning")
        try:
            return FilmSound(
                session.sound,
                session.transport,
                offset=lambda: session.sound_offset,
                muted=lambda: session.audio is not None and session.audio.muted,
            )
        except (OSError, FbaError) as error:
            session.say(f"The film is silent: {error}", "warning", 8.0)
            return None

    def _finish(self) -> None:
        try:
            path = self.close()
        except (OSError, FbaError) as error:
            self.session.say(f"Recording stopped: {error}", "error", 8.0)
            return
        if path is not None:
            self.session.say(f"Saved as {path}")

    def _unused_path(self, what: str, suffix: str) -> Path:
        """Return the path of a new file, named after the source."""
        stem = re.sub(r"[^\w. -]", "_", self.session.source.stem)[:60].strip(" .") or "fba"
        path, number = self.folder / f"{stem}{what}{suffix}", 2
        while path.exists():
            path, number = self.folder / f"{stem}{what}-{number}{suffix}", number + 1
        return path


def draw_screenshot(
    context: Any, renderer: Renderer, session: Session, *, transparent: bool = False
) -> UInt8:
    """Draw the current view without panels: uint8 (H, W, 4), top row first.

    transparent: without a background. Raises DisplayError if the graphics card lacks the memory.
    """
    time, scene = session.transport.time, session.scene
    target = Target(context, session.size, Quality.FINE.samples)
    before = scene.switches["background"]
    try:
        if transparent:
            scene.show("background", "transparent")
        view, camera = session.view(time, captured=True), session.viewpoint.camera_without_panels(time)
        views = [replace(view, background=(shade,) * 3) for shade in (0.0, 1.0)] if transparent else [view]
        pictures = []
        for shown in views:
            target.begin()
            renderer.draw(shown, camera, session.size, smoothed=target.smoothed)
            pictures.append(read_pixels(target.finish(), session.size))
    finally:
        scene.show("background", before)
        target.close()
    return cut_out(*pictures) if transparent else pictures[0]


def read_pixels(framebuffer: Any, size: tuple[int, int]) -> UInt8:
    """Return the pixels of a framebuffer: uint8 (H, W, 4), top row first."""
    width, height = size
    data = framebuffer.read((0, 0, width, height), components=4, alignment=1)
    return np.frombuffer(data, np.uint8).reshape(height, width, 4)[::-1]
