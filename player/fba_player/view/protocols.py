"""What a window, an `Offscreen` or a recording can show: the least that they need of a scene.

`Scene` is one; a live stream that grows and several performances side by side are others.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Generic, Protocol, TypeVar

from fba.arrays import Float32, Float64
from fba_player.view.camera import Camera
from fba_player.view.switches import Switches
from fba_player.view.view import View


class Times(Protocol):
    """The frames of a performance and their times, seconds; all may grow while it is shown."""

    @property
    def frames(self) -> int:
        """How many there are."""

    @property
    def rate(self) -> Fraction:
        """Frames a second."""

    @property
    def start(self) -> Fraction:
        """Time of the first."""

    @property
    def end(self) -> Fraction:
        """One frame period after the last."""

    @property
    def duration(self) -> Fraction:
        """From start to end."""

    interpolate: bool
    """Whether what is shown between two frames lies between them."""

    @property
    def growing(self) -> bool:
        """Whether more frames may arrive."""

    @property
    def arrived(self) -> int:
        """Changes whenever some did, and when no more will."""

    def time_of(self, frame: int) -> Fraction:
        """Exact time of a frame, counted from 0."""

    def position(self, time: float) -> tuple[int, int, float]:
        """(frame, next frame, share of the next) at a time."""


class Course(Times, Protocol):
    """What parameters a performance shows at any time."""

    def faps(self, time: float) -> Float32:
        """(68,) as `fba.face.resolve` gives them; zeros where there is no face."""

    def baps(self, time: float) -> Float64:
        """(296,); zeros where there is no body."""


Own = TypeVar("Own", bound=Times)


class InTime(Generic[Own]):
    """A scene's times, as its own kind of timeline says."""

    timeline: Own

    @property
    def rate(self) -> Fraction:
        """Frames a second; of several performances, the first's."""
        return self.timeline.rate

    @property
    def start(self) -> Fraction:
        """Time of the first frame, seconds."""
        return self.timeline.start

    @property
    def duration(self) -> Fraction:
        """Seconds from the first frame to the end of the last."""
        return self.timeline.duration


class Showable(Protocol):
    """Something that can be drawn at any time."""

    @property
    def timeline(self) -> Times:
        """The frames and their times."""

    @property
    def switches(self) -> Switches:
        """What is drawn, set by `show`."""

    @property
    def has_body(self) -> bool:
        """Whether there is a body in it: it has a ground, and a camera can show it whole."""

    @property
    def title(self) -> str:
        """Its name, "" for none."""

    def show(self, name: str, on: object = True) -> None:
        """Set one of `fba_player.scene.scene.SWITCHES`; ValueError for what does not exist."""

    def at(self, time: float) -> View:
        """Everything to be drawn at a time, seconds; ValueError for one that is not finite."""

    def camera(self, preset: str | None = None, aspect: float = 16 / 9) -> Camera:
        """The named view, or the one that suits the content; ValueError for another name."""

    def travel(self, time: float) -> tuple[float, float, float]:
        """How far a following camera has gone, metres; zeros where it stands still."""
