"""The window of `fba capture --play`: a stream goes to the player while it is received."""

from __future__ import annotations

import queue
from collections.abc import Callable
from pathlib import Path

import click

from fba.cli import inputs
from fba.live import Capture, Receiver, StreamRecorder
from fba.tracks import BodyTrack, FaceTrack


class StreamQueue:
    """A target of a recorder whose bytes another thread reads: a `fba_player.playback.live.Readable`."""

    def __init__(self) -> None:
        self._parts: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._ended = False

    def begin(self, opening: bytes) -> None:
        """Begin the stream with what goes before it."""
        self.write(opening, b"")

    def write(self, data: bytes, ending: bytes) -> None:
        """Add bytes."""
        if data:
            self._parts.put(data)

    def close(self) -> None:
        """End the stream."""
        self._parts.put(b"")

    def read1(self, _size: int = -1, /) -> bytes:
        """Return the next bytes; waits for them. b"" at the end."""
        part = b"" if self._ended else self._parts.get()
        self._ended = self._ended or not part
        return part


def show(
    stream: StreamQueue, receiver: Receiver, capture: Capture, recorder: StreamRecorder, model: Path | None
) -> None:
    """Show a stream in a window until that is closed. Waits for its first frames, without a window.

    Raises BitstreamError where it ends before them.
    """
    from fba import player
    from fba.face import FaceModel
    from fba_player.playback.live import LiveAnimation, LiveTimeline, wait_for

    face = inputs.read_model(model) or FaceModel.default()
    live = LiveAnimation(stream, name=capture.kind.description, bap_steps=recorder.options.bap_steps)
    say: Callable[[str], None] = lambda _text: click.echo("fba: waiting for the first face", err=True)  # noqa: E731
    wait_for(live, say)

    def newest() -> tuple[FaceTrack | None, BodyTrack | None]:
        receiver.drain()
        return capture.newest()

    try:
        scene = player.Scene(live, face, timeline=LiveTimeline(live, face))  # type: ignore[arg-type]
        player.play(scene, title=capture.kind.description, newest=newest)
    finally:
        live.close()
