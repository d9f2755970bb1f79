"""The state of a window: scene, transport, camera, selection, notices and requests.

Panels read and change it; it knows no imgui and no OpenGL.
"""

from __future__ import annotations

import math
import time as wall
import warnings
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from fba.arrays import Float32, Float64
from fba.atomic import PathLike
from fba_player.playback._time_zoom import TimeZoom
from fba_player.playback._transport import Transport
from fba_player.scene.scene import Scene
from fba_player.session._camera_controller import Viewpoint
from fba_player.session._exports import Exports
from fba_player.session._keys import by_name
from fba_player.session._source import Source
from fba_player.view._camera import Camera
from fba_player.view._view import Seen, View
from fba_player.view.protocols import Showable
from fba_player.view.switches import SWITCHES, Switch

if TYPE_CHECKING:
    from fba_player.session._life import Life
    from fba_player.session._memory import Memory
    from fba_player.sound._peaks import Peaks
    from fba_player.sound._player import Audio

Hook = Callable[[Float32, Float64], None]

LANES = ("content", "all", "none")
"""Lanes of the timeline: what is said, felt and heard; also which groups move; none."""
NOTICE_SECONDS = 4.0
LEAVING_SECONDS = 6.0
"""Seconds in which closing again discards unsaved work."""
IDLE_MOUSE_SECONDS = 3.0
"""Seconds without input after which a full screen hides the mouse cursor while it plays."""
NOTICE_FADE_SECONDS = 0.5
"""Last seconds of a notice, in which it fades."""


@dataclass(frozen=True, slots=True)
class Notice:
    """A message to the user.

    kind: "done", "warning" or "error". until: end of its time on the session's clock. about: its subject; a
    newer notice about the same subject replaces it.
    """

    text: str
    kind: str
    until: float
    about: str


@dataclass
class Selection:
    """What the user has selected, in the order of selection: FAPs and BAPs by number, and derived curves.

    derived: (kind, number), see `fba_player._ui.panels._derived`.
    """

    faps: list[int] = field(default_factory=list)
    baps: list[int] = field(default_factory=list)
    derived: list[tuple[str, int]] = field(default_factory=list)

    @property
    def all(self) -> list[tuple[str, int]]:
        """(kind, number) of all: FAPs, BAPs, derived curves."""
        return [("fap", one) for one in self.faps] + [("bap", one) for one in self.baps] + self.derived

    def choose(self, chosen: list[tuple[str, int]]) -> None:
        """Select these (kind, number), and nothing else."""
        self.faps = [number for kind, number in chosen if kind == "fap"]
        self.baps = [number for kind, number in chosen if kind == "bap"]
        self.derived = [row for row in chosen if row[0] not in ("fap", "bap")]

    def toggle(self, kind: str, number: int) -> None:
        """Add a curve to the selection, or remove it. kind: "fap", "bap" or that of a derived curve."""
        row, chosen = (kind, number), self.all
        self.choose([one for one in chosen if one != row] if row in chosen else [*chosen, row])


class Session:
    """The state that the window and its panels share.

    scene, transport, viewpoint: what is shown, its current time, and the camera. exports: see `Exports`.
    source: the file behind it. selection: the curves. open: names of the open panels. bare: whether
    everything but the picture is hidden. size: of the picture in pixels. scale: pixels per point of the
    display. zoom: the part of the time that timeline and curves show. lanes: which lanes the timeline has,
    one of `LANES`. peaks: the outline of the sound. life: signs of life that windows show while they play,
    None for none; films and pictures do not have them. memory: what is remembered for other windows, None for
    nothing. read: reads a file, to see whether it can be opened.

    before_frame: functions called as hook(faps, baps) before each picture; they may change the values that
    will be shown in place: FAPs, float32 (68,), and BAPs, float64 (296,), zeros without a body.

    requests: what the window shall do after this picture, see `request`. recording: seconds of the film so
    far, None if none is being recorded. recording_speed: seconds of it per second, below 1 on a machine
    that draws more slowly than the film is shown. values: FAPs and BAPs of the last picture, after the
    hooks. sound: path of the sound file; audio: its player, None without a sound device; the sound begins
    sound_offset seconds after the first frame, see `shift_sound`. rolling: names of what needs new pictures
    without input. unsaved: what would be lost if the window closed, see `leave`. dropped: files to open next,
    see `drop`; resumes: whether they go on where the window is, see `reload`. popup: whether a list is open
    over the picture; set to False to close it.
    """

    def __init__(
        self,
        scene: Showable,
        transport: Transport | None = None,
        *,
        source: Source | None = None,
        camera: Camera | str | None = None,
        size: tuple[int, int] = (1280, 720),
        scale: float = 1.0,
        clock: Callable[[], float] = wall.monotonic,
    ) -> None:
        self.scene = scene
        self.transport = transport or Transport(scene.timeline)
        self.source = source or Source(scene)
        self.size = size
        self.scale = scale
        self.clock = clock
        self.viewpoint = Viewpoint(scene, size[0] / max(size[1], 1), camera, clock=self._now)
        self.selection = Selection()
        self.zoom = TimeZoom()
        self.lanes = LANES[0]
        self.peaks: Peaks | None = None
        self.open: set[str] = set()
        self.bare = False
        self.closing = False
        self.before_frame: list[Hook] = []
        self.requests: deque[str] = deque()
        self.recording: float | None = None
        self.recording_speed = 1.0
        self.rolling: set[str] = set()
        self.unsaved: set[str] = set()
        self.exports = Exports(scene, self.say, self.rolling, self.unsaved)
        self.dropped: tuple[Path, ...] = ()
        self.resumes = False
        self.life: Life | None = None
        self.memory: Memory | None = None
        self.read: Callable[[Path], object] = _read
        self.full_screen = False
        self.popup = False
        self.audio: Audio | None = None
        self.sound: PathLike | None = None
        self.sound_offset = 0.0
        self.values: tuple[Float32, Float64] = (np.zeros(68, np.float32), np.zeros(296))
        self.last_input = self._began = clock()
        self._notices: list[Notice] = []
        self._leave_again_until = -math.inf

    def toggle_panel(self, name: str) -> None:
        """Open or close a panel; if everything is hidden, show it."""
        if self.bare:
            self.bare = False
            self.open.add(name)
        else:
            self.open ^= {name}

    def say(self, text: str, kind: str = "done", seconds: float = NOTICE_SECONDS, *, about: str = "") -> None:
        """Show a notice for some seconds. kind: "done", "warning" or "error".

        It replaces an older one about the same subject; by default the subject is the text.
        """
        about = about or text
        self._notices = [notice for notice in self.notices() if notice.about != about][-2:]
        self._notices.append(Notice(text, kind, self.clock() + seconds, about))

    def notices(self) -> list[Notice]:
        """Return the current notices, oldest first."""
        now = self.clock()
        if not self.unsaved:
            self._notices = [notice for notice in self._notices if notice.about != "leave"]
        self._notices = [notice for notice in self._notices if notice.until > now]
        return list(self._notices)

    def request(self, what: str) -> None:
        """Request "screenshot", "transparent", "record", "fullscreen" or "copy_command" from the window."""
        self.requests.append(what)

    def escape(self) -> None:
        """Close what is in the way, one thing a time: a list, the help, a film, full screen, the window."""
        if self.popup:
            self.popup = False
        elif "help" in self.open and not self.bare:
            self.open.discard("help")
        elif self.recording is not None:
            self.request("record")
        elif self.full_screen:
            self.request("fullscreen")
        else:
            self.leave()

    def leave(self) -> None:
        """Close the window; with unsaved work, warn first and close at the second call."""
        if self.unsaved and self.clock() > self._leave_again_until:
            self._leave_again_until = self.clock() + LEAVING_SECONDS
            what = " and ".join(sorted(self.unsaved))
            self.say(f"Unsaved: {what}. Close again to discard", "warning", LEAVING_SECONDS, about="leave")
            return
        self.closing = True

    def drop(self, paths: tuple[Path, ...]) -> None:
        """Leave the scene to open dropped files; if one cannot be read, say so and stay."""
        if not self._can_open(paths):
            return
        self.leave()
        if self.closing:
            self.dropped = paths

    def reload(self, path: Path) -> None:
        """Leave the scene to show its file again, which has changed, from where it is now."""
        if self.unsaved:
            what = " and ".join(sorted(self.unsaved))
            self.say(f"{path.name} has changed; save or discard {what}, then open it again", "warning", 8.0)
        elif self._can_open((path,)):
            self.dropped, self.resumes, self.closing = (path,), True, True

    def _can_open(self, paths: tuple[Path, ...]) -> bool:
        from fba.errors import FbaError

        try:
            with warnings.catch_warnings(action="ignore"):  # given again when they are opened
                for path in paths:
                    self.read(path)
        except (FbaError, OSError) as error:
            self.say(f"Cannot be opened: {error}", "error", 8.0, about="drop")
            return False
        return True

    @property
    def greets(self) -> bool:
        """Whether the hints of the first window are shown."""
        return self.memory is not None and not self.memory.welcomed and not self.bare

    def _now(self) -> float:
        """Return the reading of the clock, which is another while a film is recorded."""
        return self.clock()

    def touched(self) -> None:
        """Note that the user moved the mouse or pressed something, so that hidden controls come back."""
        self.last_input = self.clock()

    @property
    def idle(self) -> float:
        return self.clock() - self.last_input

    @property
    def hides_mouse(self) -> bool:
        """Whether a full screen shows no mouse cursor: it plays, and the user leaves the mouse alone."""
        return self.transport.playing and self.idle > IDLE_MOUSE_SECONDS

    @property
    def restless(self) -> bool:
        """Whether the picture changes without input of the user, for another reason than that it plays."""
        fades_from = self.clock() + NOTICE_FADE_SECONDS
        return (
            self.viewpoint.gliding
            or bool(self.rolling)
            or self.recording is not None
            or (self.peaks is not None and self.peaks.reading)
            or any(notice.until < fades_from for notice in self._notices)
        )

    def shift_sound(self, seconds: float) -> None:
        """Let the sound begin this number of seconds later than now; earlier if negative."""
        self.sound_offset = round(self.sound_offset + seconds, 6)
        if self.audio is not None:
            self.audio.offset = self.sound_offset

    def view(self, time: float, seen: Seen | None = None, *, captured: bool = False) -> View:
        """Return what is drawn at a time in seconds, after the hooks of `before_frame`.

        seen: see `Showable.view_at`. captured: whether it is for a picture or film that is saved.
        """
        scene = self.scene
        lives = self.life if self.transport.playing and self.recording is None and not captured else None
        if not isinstance(scene, Scene) or not (self.before_frame or lives):
            return scene.view_at(time, seen)
        faps, baps = scene.timeline.faps(time).copy(), scene.timeline.baps(time).copy()
        for hook in tuple(self.before_frame):
            hook(faps, baps)
        self.values = (faps, baps)
        if lives is not None:
            faps, baps = faps.copy(), baps.copy()
            lives(self.clock() - self._began, faps, baps)
        return scene.view_for(faps, baps, seen)

    def toggle_view(self) -> None:
        """Switch between the figure and its feature points and bones, where the scene has both views."""
        if isinstance(self.scene, Scene):
            self.scene.view = "figure" if self.scene.view == "points" else "points"

    def switch_key(self, switch: Switch) -> str:
        """Return the key of a switch; "" if it has none, or the window uses that key for something else."""
        return "" if switch.key.lower() in by_name() else switch.key

    def switch_keys(self) -> list[tuple[str, str]]:
        """Return (key, label) of all switches that have a key."""
        rows = ((self.switch_key(switch), switch.label) for switch in SWITCHES.values())
        return [(key, label) for key, label in rows if key]

    def press_switch(self, key: str) -> bool:
        """Turn the switch with this key to its next value; return False without one."""
        for name, switch in SWITCHES.items():
            if self.switch_key(switch).lower() == key:
                self.touched()
                self.scene.switches.press(name)
                self.say(f"{switch.label}: {self.scene.switches.text(name)}", about=name)
                return True
        return False

    def camera(self, time: float) -> Camera:
        return self.viewpoint.camera_at(time)


def _read(path: Path) -> object:
    from fba.formats import read

    return read(path)
