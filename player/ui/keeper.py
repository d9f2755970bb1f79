"""Pictures and films of what a window shows, kept as files in the current folder."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from fba.errors import FbaError
from player.picture_files import write_picture
from player.recorder import Recorder
from player.ui.session import Session

UInt8 = npt.NDArray[np.uint8]

RATE = 30
"""Frames a second of a film of the window."""


class Keeper:
    """Fulfils the wishes of a session for pictures and films.

    folder: where they go, by default the current one. Names are the file's with the frame's number; none
    is ever overwritten.
    """

    def __init__(self, session: Session, folder: str | os.PathLike[str] | None = None) -> None:
        self.session = session
        self.folder = Path(folder) if folder is not None else Path()
        self._recorder: Recorder | None = None
        self._begun = 0.0

    @property
    def recording(self) -> bool:
        """Whether a film is being made."""
        return self._recorder is not None

    def screenshot(self, pixels: UInt8, *, transparent: bool = False) -> Path | None:
        """Keep a picture, uint8 (H, W, 4), as a PNG file; None where it failed, which the user is told."""
        path = self._name(f"-{self.session.transport.frame + 1:04d}", ".png")
        try:
            write_picture(path, pixels, transparent=transparent)
        except (OSError, FbaError) as error:
            self.session.say(f"The picture could not be kept: {error}", "error", 8.0)
            return None
        self.session.say(f"Kept as {path}")
        return path

    def toggle_recording(self) -> None:
        """Begin a film of what is seen, or finish it."""
        if self._recorder is not None:
            self._finish()
            return
        path = self._name("-film", ".mp4")
        try:
            self._recorder = Recorder(path, self.session.size, rate=RATE)
        except (OSError, FbaError, ValueError) as error:
            self.session.say(f"No film can be recorded: {error}", "error", 8.0)
            return
        self._begun = self.session.clock()
        self.session.recording = 0.0

    def picture(self, read: Callable[[], UInt8]) -> None:
        """A picture was drawn; `read` gives it, uint8 (H, W, 4), and is called only if it is needed."""
        if self._recorder is None:
            return
        seconds = self.session.clock() - self._begun
        self.session.recording = seconds
        if not self._recorder.wants(seconds):
            return
        try:
            self._recorder.add(read(), seconds, wait=False)
        except (OSError, FbaError) as error:
            self._recorder, self.session.recording = None, None
            self.session.say(f"The film was given up: {error}", "error", 8.0)

    def close(self) -> Path | None:
        """Finish a film that is still being made; raises what went wrong, as nobody can be told later."""
        if self._recorder is None:
            return None
        recorder, self._recorder = self._recorder, None
        self.session.recording = None
        return recorder.close()

    def _finish(self) -> None:
        try:
            path = self.close()
        except (OSError, FbaError) as error:
            self.session.say(f"The film was given up: {error}", "error", 8.0)
            return
        if path is not None:
            self.session.say(f"Kept as {path}")

    def _name(self, what: str, suffix: str) -> Path:
        """A name that no file has."""
        stem = Path(self.session.source.name or "fba").stem
        stem = re.sub(r"[^\w. -]", "_", stem)[:60].strip(" .") or "fba"
        path, number = self.folder / f"{stem}{what}{suffix}", 2
        while path.exists():
            path, number = self.folder / f"{stem}{what}-{number}{suffix}", number + 1
        return path
