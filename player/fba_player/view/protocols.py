"""Protocols of what a window, an `Offscreen` or a recording can show.

`Scene` implements them; so do a live stream and several performances side by side.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Generic, Protocol, Self, TypeVar

from fba_player.view._camera import Camera
from fba_player.view._view import Seen, View
from fba_player.view.switches import Switches


class Times(Protocol):
    """The frames of a performance and their times in seconds; both may grow while it is shown."""

    @property
    def frames(self) -> int:
        """Number of frames."""

    @property
    def rate(self) -> Fraction:
        """Frames per second."""

    @property
    def start(self) -> Fraction:
        """Time of the first frame."""

    @property
    def end(self) -> Fraction:
        """Time of the last frame, plus one frame period."""

    @property
    def duration(self) -> Fraction:
        """Seconds from start to end."""

    interpolate: bool
    """Whether values between two frames are interpolated."""

    @property
    def growing(self) -> bool:
        """Whether more frames may arrive."""

    @property
    def arrived(self) -> int:
        """A counter that changes when frames arrive, and when the last one has."""

    def time_of(self, frame: int) -> Fraction:
        """Return exact time of a frame by its index."""

    def position(self, time: float) -> tuple[int, int, float]:
        """Return (frame, next frame, weight of the next) at a time."""


Own = TypeVar("Own", bound=Times)


class Timed(Generic[Own]):
    """The base of scenes: the times of its timeline, its switches, a figure that stays where it is."""

    timeline: Own
    switches: Switches
    follow: str | None = None
    """What the camera follows, one of `FOLLOWS`; None: the head in views of the face, else a figure that
    walks away."""
    orbit: float | None = None
    """Seconds in which the camera turns once around the subject; None if it does not."""

    @property
    def rate(self) -> Fraction:
        """Frames per second; of several performances, those of the first."""
        return self.timeline.rate

    @property
    def start(self) -> Fraction:
        """Time of the first frame, seconds."""
        return self.timeline.start

    @property
    def duration(self) -> Fraction:
        """Seconds from the first frame to the end of the last."""
        return self.timeline.duration

    def show(self, name: str, on: object = True) -> None:
        """Set a switch: True or False, a choice's word, or a FAP by name or number; see `SWITCHES`.

        Raises ValueError for a switch that does not exist or a value that it cannot have.
        """
        self.switches.show(name, on)

    def travel(self, time: float) -> tuple[float, float, float]:
        """Return the offset (x, y, z) of a following camera, metres; zeros if it does not follow."""
        return 0.0, 0.0, 0.0

    def head_travel(self, time: float) -> tuple[float, float, float]:
        """Return the displacement of the head from the start to a time, metres; by default that of all."""
        return self.travel(time)

    def followed(self, time: float, *, of_head: bool = False) -> tuple[float, float, float]:
        """Return the offset (x, y, z) of a camera at a time, metres. of_head: if it looks at the face."""
        if self.follow == "none":
            return 0.0, 0.0, 0.0
        if self.follow == "head" or (self.follow is None and of_head):
            return self.head_travel(time)
        return self.travel(time)


class Closing:
    """A context manager that calls `close` at the end of its block."""

    def close(self) -> None:
        """Release its resources; safe to call twice."""
        raise NotImplementedError

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Showable(Protocol):
    """Something that can be drawn at any time."""

    @property
    def timeline(self) -> Times:
        """The frames and their times."""

    @property
    def switches(self) -> Switches:
        """What is drawn; set by `show`."""

    @property
    def has_body(self) -> bool:
        """Whether it contains a body: then there is a ground, and the camera preset "body"."""

    @property
    def title(self) -> str:
        """Name of what is shown, "" for none."""

    follow: str | None
    """What the camera follows; see `Timed.follow`."""
    orbit: float | None
    """Seconds in which the camera turns once; None if it does not."""

    def show(self, name: str, on: object = True) -> None:
        """Set one of `fba_player.view.switches.SWITCHES`; ValueError for an unknown name or value."""

    def view_at(self, time: float, seen: Seen | None = None) -> View:
        """Return everything to be drawn at a time in seconds; ValueError if it is not finite.

        seen: where from, to leave out detail that is too small to be seen.
        """

    def camera(self, preset: str | None = None, aspect: float = 16 / 9) -> Camera:
        """Return a camera for a preset, or what the content suggests; ValueError for an unknown name."""

    def travel(self, time: float) -> tuple[float, float, float]:
        """Return the offset of a following camera at a time, metres; zeros if it does not follow."""

    def head_travel(self, time: float) -> tuple[float, float, float]:
        """Return the displacement of the head from the start to a time, metres."""

    def followed(self, time: float, *, of_head: bool = False) -> tuple[float, float, float]:
        """Return the offset (x, y, z) of a camera at a time, metres. of_head: if it looks at the face."""
