"""`Channel`: which viewer of a stream gets which message."""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable, Iterable
from typing import Generic, TypeVar

from fba.serving._planes import Plane

MOST_UNSENT = 1 << 15
"""Bytes that may wait for a viewer to take them, before frames are left out."""
MOST_KEPT = 1 << 20
"""Bytes since the last I plane that are kept for viewers who come late."""

Viewer = TypeVar("Viewer", bound=Hashable)


class Channel(Generic[Viewer]):
    """A stream and its viewers. All calls are made in one thread.

    titles, number: of all streams, and which of them this is. send: sends a message to viewers, without
    waiting. unsent: returns the number of bytes that wait for a viewer to take them.
    """

    def __init__(
        self,
        titles: Iterable[str],
        number: int,
        send: Callable[[Iterable[Viewer], str | bytes], None],
        unsent: Callable[[Viewer], int],
    ) -> None:
        self._hello = _event("hello", streams=list(titles), stream=number)
        self._send = send
        self._unsent = unsent
        self._following: set[Viewer] = set()
        self._behind: dict[Viewer, int] = {}  # planes that each lost so far
        self._new: set[Viewer] = set()  # who got nothing yet
        self._kept: list[bytes] = []  # since the last I plane at which a viewer can begin
        self._size = 0  # of these
        self._start = ""

    @property
    def viewers(self) -> int:
        """Number of viewers."""
        return len(self._following) + len(self._behind) + len(self._new)

    @property
    def newcomers(self) -> int:
        """Number of viewers who got no plane yet."""
        return len(self._new)

    def join(self, viewer: Viewer) -> None:
        """Add a viewer, who gets all since the last I plane at once, or else begins at the next."""
        self._send([viewer], self._hello)
        if self._kept:
            self._send([viewer], self._start)
            self._send([viewer], b"".join(self._kept))
            self._following.add(viewer)
        else:
            self._new.add(viewer)

    def leave(self, viewer: Viewer) -> None:
        """Remove a viewer."""
        self._following.discard(viewer)
        self._behind.pop(viewer, None)
        self._new.discard(viewer)

    def publish(self, plane: Plane) -> None:
        """Send a plane: to those who have all before it, and to those who wait for a plane to begin at."""
        self._keep(plane)
        for viewer in [one for one in self._following if self._unsent(one) > MOST_UNSENT]:
            self._following.discard(viewer)
            self._behind[viewer] = 0
        if plane.fresh:
            self._new |= self._following
            self._following.clear()
        self._send(self._following, plane.data)
        ready = [one for one in self._behind if plane.opening and not self._unsent(one)]
        for viewer in self._behind.keys() - set(ready):
            self._behind[viewer] += 1
        for viewer in ready:
            self._send([viewer], _event("lost", planes=self._behind.pop(viewer)))
        if plane.opening and (starting := {*ready, *self._new}):
            self._send(starting, self._start)
            self._send(starting, plane.opening)
            self._following |= starting
            self._new.clear()

    def end(self, ending: bytes) -> None:
        """End the stream: send the bytes that end it, and that it has ended."""
        self._kept = []
        self._send(self._following, ending)
        everyone = {*self._following, *self._behind, *self._new}
        self._send(everyone, _event("end"))
        self._following |= {*self._behind, *self._new}
        self._behind.clear()
        self._new.clear()

    def _keep(self, plane: Plane) -> None:
        """Keep what a viewer needs who comes after this plane."""
        if plane.opening:
            self._start = _event("start", time=round(plane.time, 6), rate=round(plane.rate, 6))
            self._kept, self._size = [plane.opening], len(plane.opening)
        elif plane.fresh or self._size + len(plane.data) > MOST_KEPT:
            self._kept = []
        elif self._kept:
            self._kept.append(plane.data)
            self._size += len(plane.data)


def _event(event: str, **values: object) -> str:
    """Return a text message."""
    return json.dumps({"event": event, **values}, separators=(",", ":"))
