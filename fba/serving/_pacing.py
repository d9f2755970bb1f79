"""Streams at their own pace: files from the moment that somebody watches, pipes as they come."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from typing import Protocol

from fba.serving._planes import Plane, PlaneSplitter

LEAD = 0.5
"""Seconds by which planes of a pipe may come before their time, and are passed on at once nevertheless."""
LONGEST_PAUSE = 10.0
"""Seconds between two planes above which the second does not wait: its time code is that of another clock."""
READ = 1 << 16
"""Most bytes that are read from a pipe at once."""
NOBODY = 0.05
"""Seconds after which it is checked again whether somebody watches."""


class Pace(Protocol):
    """A clock to wait by."""

    def clock(self) -> float:
        """Return the seconds of a monotonic clock."""

    def wait(self, seconds: float) -> bool:
        """Wait for so long; return True, at once, where all is to stop."""


class Stage(Pace, Protocol):
    """Where a stream is shown: a channel, seen from the thread of its source."""

    @property
    def viewers(self) -> int:
        """Number of viewers."""

    @property
    def newcomers(self) -> int:
        """Number of viewers who got no plane yet."""

    def publish(self, plane: Plane) -> None:
        """Send a plane to the viewers."""

    def end(self, ending: bytes) -> None:
        """End the stream, perhaps to begin again."""


def show_file(stage: Stage, stream: tuple[list[Plane], bytes], *, loop: bool = False) -> None:
    """Show the planes of a file in real time, until the server stops.

    It begins when somebody comes to watch who has seen nothing of it; loop: and again, while anybody watches.
    """
    planes, ending = stream
    while True:
        while not (stage.viewers if loop else stage.newcomers):
            if stage.wait(NOBODY):
                return
        for plane in paced(planes, stage):
            stage.publish(plane)
        if stage.wait(1 / planes[-1].rate):  # for as long as the last frame is shown
            return
        stage.end(ending)


def show_pipe(stage: Stage, read: Callable[[int], bytes], splitter: PlaneSplitter) -> None:
    """Show a stream that arrives, to its end.

    read: returns up to a number of bytes that have arrived, b"" at the end. A file that comes faster than
    real time is slowed down to it. Raises BitstreamError for a stream without planes, LimitError, OSError.
    """
    for plane in arriving(read, splitter, stage):
        stage.publish(plane)
    stage.end(splitter.ending)


def arriving(
    read: Callable[[int], bytes], splitter: PlaneSplitter, pace: Pace, *, live: bool = False
) -> Iterator[Plane]:
    """Yield the planes of a stream that arrives, not faster than in real time; see `show_pipe`.

    live: at once, also those that come all together after a delay: nothing that is late may stay late.
    """
    return paced(_arriving(read, splitter), pace, lead=math.inf if live else LEAD)


def _arriving(read: Callable[[int], bytes], splitter: PlaneSplitter) -> Iterator[Plane]:
    while chunk := read(READ):
        yield from splitter.push(chunk)
    yield from splitter.finish()


def paced(planes: Iterable[Plane], pace: Pace, *, lead: float = 0.0) -> Iterator[Plane]:
    """Yield each plane at its time, or `lead` seconds before it, until all is to stop."""
    begun = last = 0.0
    for count, plane in enumerate(planes):
        if not count or not 0 <= plane.time - last <= LONGEST_PAUSE:
            begun = pace.clock() - plane.time
        last = plane.time
        due = begun + plane.time - lead - pace.clock()
        if pace.wait(max(due, 0.0)):
            return
        yield plane
