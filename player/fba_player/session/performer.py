"""Puppeteering: changes the values that a session shows, and records, shows and saves takes."""

from __future__ import annotations

import os
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from fba.animation import Animation
from fba.arrays import Float32, Float64
from fba.tracks import BodyTrack, FaceTrack
from fba_player.playback._timeline import Timeline
from fba_player.scene.compare import CompareScene
from fba_player.scene.scene import Scene
from fba_player.session._puppet import Puppet
from fba_player.session._takes import TakeRecorder, Takes, take_rate

if TYPE_CHECKING:
    from pathlib import Path

    from fba_player.session._session import Session

NEUTRAL_SECONDS = 10
UNSAVED_TAKE = "the last take"
"""Name of a take that is not saved, in the warning before the window closes."""


class Performer:
    """The puppet of a session and its takes; it changes what the session shows once it is attached.

    folder: where takes are saved; by default the current one.
    """

    def __init__(self, session: Session, folder: str | os.PathLike[str] | None = None) -> None:
        self.session = session
        scene = session.scene
        self.puppet = Puppet(scene.model.definitions if isinstance(scene, Scene | CompareScene) else None)
        self.takes = Takes(folder)
        self._recorder: TakeRecorder | None = None
        self._shown: Timeline | None = None
        self._begun = 0.0

    def attach(self) -> None:
        """Let the puppet change what the session shows."""
        if self._hook not in self.session.before_frame:
            self.session.before_frame.append(self._hook)

    @property
    def recording(self) -> float | None:
        """Seconds recorded so far; None where nothing is being recorded."""
        return None if self._recorder is None else self._recorder.seconds

    @property
    def showing(self) -> bool:
        """Whether the last take is being shown."""
        return self._shown is not None

    def record(self) -> None:
        """Begin a take: record what is shown, also while playing is paused."""
        self.stop()
        scene: Any = self.session.scene
        face = scene.animation.face is not None or not scene.has_body or self._face_moved()
        self._recorder = TakeRecorder(take_rate(scene.timeline.rate), face=face, body=scene.has_body)
        self._begin()

    def show(self) -> None:
        """Show the last take once, in place of what is played."""
        self.stop()
        if self.takes.last is not None:
            self._shown = Timeline(self.takes.last)
            self._begin()

    def stop(self) -> None:
        """Stop recording or showing a take."""
        recorder, self._recorder, self._shown = self._recorder, None, None
        self.session.rolling.discard("take")
        if recorder is not None and len(recorder):
            self.takes.add(recorder.take(f"take {len(self.takes) + 1}"))
            self.session.unsaved.add(UNSAVED_TAKE)

    def undo(self) -> None:
        """Delete the last take."""
        self.stop()
        self.takes.undo()
        self.session.unsaved.discard(UNSAVED_TAKE)

    def save(self, name: str) -> tuple[Path, str]:
        """Write the last take with the BAP steps of the source; return and raises as `Takes.save`."""
        saved = self.takes.save(name, bap_steps=self.session.source.bap_steps)
        self.session.unsaved.discard(UNSAVED_TAKE)
        return saved

    def _begin(self) -> None:
        self._begun = self.session.clock()
        self.session.rolling.add("take")
        self.attach()

    def _hook(self, faps: Float32, baps: Float64) -> None:
        seconds = self.session.clock() - self._begun
        if self._shown is not None:
            if seconds > self._shown.duration:
                self.stop()
            else:
                faps[:] = self._shown.faps(seconds)
                baps[:] = self._shown.baps(seconds)
                self.puppet.shown = (faps.copy(), baps.copy())
                return
        self.puppet(faps, baps)
        if self._recorder is not None:
            self._recorder.add(seconds, faps, baps)
            if self._recorder.full:
                self.stop()
                self.session.say("The take has become too long, and was ended", "warning")

    def _face_moved(self) -> bool:
        puppet = self.puppet
        return bool(puppet.speaks or puppet.feels or puppet.mood.active or puppet.fap_moved.any())


def neutral(*, body: bool = False, name: str = "puppet") -> Animation:
    """Return a neutral face, with a standing body if `body` is True: 10 s at 25 frames/s."""
    count = 25 * NEUTRAL_SECONDS
    standing = BodyTrack.empty(count) if body else None
    return Animation(Fraction(25), np.arange(count), FaceTrack.empty(count), standing, name)
