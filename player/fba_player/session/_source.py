"""The file behind a scene, and its stream information."""

from __future__ import annotations

import os
import threading
import time as wall
from pathlib import Path
from typing import TYPE_CHECKING

from fba.animation import Animation
from fba.errors import FbaError
from fba.parameters import BapTable
from fba_player.playback._lanes import Lane, lane_of_expressions, lane_of_visemes
from fba_player.playback.live import LiveAnimation
from fba_player.scene.compare import CompareScene
from fba_player.scene.scene import Scene
from fba_player.session._group_activity import Activity, read_activity
from fba_player.session._timeline_trace import (
    Stretch,
    Trace,
    lane_of_stretches,
    read_stretches,
    trace_of_motion,
    trace_of_planes,
)

if TYPE_CHECKING:
    from fba.codec import DecodedFrames, StreamInfo
    from fba_player.view.protocols import Showable

REFRESH_SECONDS = 0.2
"""Seconds between updates of the information about a live stream."""


class Source:
    """The file behind a scene.

    path: None if there is no file. bap_steps: the table of BAP steps it was decoded with. warnings: those
    given while it was read. `info` describes its content, at first from the scene alone, and once `probe` is
    done also with planes, bits and damage.
    """

    def __init__(
        self,
        scene: Showable,
        path: str | os.PathLike[str] | None = None,
        *,
        bap_steps: BapTable = "iso",
        warnings: tuple[str, ...] = (),
    ) -> None:
        self.path = path
        self.bap_steps = bap_steps
        self.warnings = list(warnings)
        self._scene = scene
        self._probed: StreamInfo | None = None
        self._scene_info: StreamInfo | None = None
        self._format_and_size = ("animation", 0)
        animation: object = scene.animation if isinstance(scene, Scene) else None
        self._live = animation if isinstance(animation, LiveAnimation) else None
        self._updated = -REFRESH_SECONDS
        self._trace_info: StreamInfo | None = None
        self._trace: Trace | None = None
        self._thread: threading.Thread | None = None
        self._stamp = self._newer = self._stat()
        self.expressions: tuple[Stretch, ...] = ()
        """What the face shows when; empty until `probe` is done, and for live streams."""
        self._lanes: tuple[Lane, ...] = ()
        self.activity: Activity | None = None
        """Which groups move when; None until `probe` is done, and for live streams."""

    @property
    def name(self) -> str:
        """Name of the file, else the title of the scene."""
        return os.path.basename(os.fspath(self.path)) if self.path is not None else self._scene.title

    @property
    def stem(self) -> str:
        """What files that are made from it are called, without suffix; "one-other" where two are shown."""
        return "-".join(Path(name).stem for name in self.name.split(" | ")) or "fba"

    @property
    def info(self) -> StreamInfo:
        """Information about the stream; the same object until something changes."""
        if self._probed is not None:
            return self._probed
        before, timeline, now = self._scene_info, self._scene.timeline, wall.monotonic()
        due = not timeline.growing or now - self._updated >= REFRESH_SECONDS
        if before is None or (before.frames != timeline.frames and due):
            self._scene_info, self._updated = self._info_of_scene(), now
        assert self._scene_info is not None
        return self._scene_info

    def changed(self) -> bool:
        """Return once whether the file has changed, and has been left alone since the last call."""
        now = self._stat()
        if now is None or now == self._stamp:
            return False
        if now != self._newer:  # it may still be being written
            self._newer = now
            return False
        self._stamp = now
        return True

    def _stat(self) -> tuple[int, int] | None:
        if self.path is None:
            return None
        try:
            stat = os.stat(self.path)
        except OSError:
            return None
        return stat.st_mtime_ns, stat.st_size

    def probe(self, *, wait: bool = False) -> None:
        """Read the planes, bits and damage of the file; in the background unless `wait` is True."""
        if self._thread is not None:
            return
        self._thread = threading.Thread(target=self._read_details, name="fba source", daemon=True)
        self._thread.start()
        if wait:
            self._thread.join()

    @property
    def probing(self) -> bool:
        return self._thread is not None and self._thread.is_alive()

    @property
    def trace(self) -> Trace | None:
        """The graph behind the timeline: bits of planes, or amount of motion; None until `probe` is done."""
        self._follow_live()
        return self._trace

    @property
    def lanes(self) -> tuple[Lane, ...]:
        """What is said and felt when; of files empty until `probe` is done, of live streams what is sent."""
        self._follow_live()
        return self._lanes

    def _follow_live(self) -> None:
        """Bring the trace and the lanes of a live stream up to date with its information."""
        if self._live is not None and self._trace_info is not self.info:
            self._trace_info = self.info
            self._trace = trace_of_planes(self._trace_info)
            self._lanes = _sent(self._live.now)

    def _info_of_scene(self) -> StreamInfo:
        from fba.codec import StreamInfo

        if self._live is not None:
            return self._live.info()
        animation, times = self._animation(), self._scene.timeline
        if isinstance(animation, Animation) and len(animation) == times.frames:
            return StreamInfo.of_animation(animation, *self._format_and_size)
        return StreamInfo(
            format="stream", size=0, rate=times.rate, frames=times.frames, duration=times.duration,
            start=times.start, skipped=0, face=None, body=None,
        )  # fmt: skip

    def _animation(self) -> object:
        return self._scene.animation if isinstance(self._scene, Scene | CompareScene) else None

    def _read_details(self) -> None:
        from fba.formats import format_of, probe

        try:
            found = format_of(self.path) if self.path is not None else None
            if self.path is not None and found is not None and found.read_stream is not None:
                self._probed = probe(self.path, bap_steps=self.bap_steps)
            elif self.path is not None and found is not None:
                # described by the animation, whose rate the user may have set
                self._format_and_size = (found.name, os.stat(self.path).st_size)
                self._scene_info = None
        except (FbaError, OSError) as error:
            self.warnings.append(f"the planes of the file cannot be read: {error}")
        trace = trace_of_planes(self.info)
        animation = self._animation()
        if trace is None and isinstance(animation, Animation):
            trace = trace_of_motion(animation)
        self._trace = trace
        if isinstance(self._scene, Scene) and isinstance(animation, Animation):
            self._lanes = _sent(animation)
            self.activity = read_activity(animation, self._scene.model)
            self.expressions = read_stretches(animation, self._scene.model)
            felt = lane_of_stretches(self.expressions)
            self._lanes += () if felt is None else (felt,)


def _sent(animation: Animation | DecodedFrames) -> tuple[Lane, ...]:
    """Return the lanes of visemes and expressions that frames send."""
    lanes = lane_of_visemes(animation), lane_of_expressions(animation)
    return tuple(lane for lane in lanes if lane is not None)
