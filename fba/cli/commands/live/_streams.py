"""Recording of a stream that comes from a network, as it is."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fba.cli.interruptions import stopping
from fba.cli.outputs import Outputs, display_name
from fba.codec import write_mark, write_opening
from fba.errors import FbaError

if TYPE_CHECKING:
    from fba.face import FaceModel
    from fba.live.recording import Target
    from fba.live.streams import StreamReceiver

_OBJECT = b"\0\0\1\xba"
_END = b"\0\0\1\xb1"


class Recording:
    """A stream that is written to targets while it is read; a `fba_player.playback.live.Readable`.

    size: bytes written so far.
    """

    def __init__(self, receiver: StreamReceiver, targets: Sequence[Target]) -> None:
        self.receiver = receiver
        self.size = 0
        self._targets = targets
        self._ending = b""

    def read1(self, size: int = -1, /) -> bytes:
        """Return the next bytes of the stream, once they are written; b"" at its end."""
        data = self.receiver.read1(size)
        if data:
            self._write(data)
        return data

    def _write(self, data: bytes) -> None:
        """Write bytes; those before the object go to targets that read the stream while it grows."""
        if not self.size:
            table = self.receiver.table
            data = data[data.find(_OBJECT) :]
            self._ending = _END + (write_mark(table) if table else b"")
            opening = write_opening(table) if table else b""
            for target in self._targets:
                target.begin(opening)
        self.size += len(data)
        for target in self._targets:
            target.write(data, self._ending)

    def finish(self) -> None:
        """End the stream, and close the targets."""
        for target in self._targets:
            if self.size:
                target.write(self._ending, b"")
            target.close()
        self.size += len(self._ending)

    def report(self, outputs: Outputs, output: Path | None, *, as_json: bool) -> None:
        """Print counts of what was received, and what was written. Raises FbaError if that is nothing."""
        counts = self.receiver.counts
        if not counts.planes:
            raise FbaError(self.receiver.nothing())
        kbit = 8 * self.size / counts.seconds / 1000
        if as_json:
            written = {"output": None if output is None else str(output), "size": self.size}
            outputs.print_json(written | {"kbit_per_second": round(kbit, 3)} | counts.values())
            return
        for line in counts.lines():
            outputs.say(f"fba: {line}")
        if output is not None:
            outputs.say(
                f"{display_name(output)}: {counts.planes} planes, {counts.seconds:.2f} s, {self.size} bytes, "
                f"{kbit:.2f} kbit/s"
            )


def record(recording: Recording, seconds: float | None, face: FaceModel | None, *, play: bool) -> None:
    """Record a stream to its end, for a number of seconds, or until Ctrl-C. play: show it meanwhile."""
    receiver = recording.receiver
    click.echo(f"fba: listening at {receiver.address}", err=True)
    timer = None if seconds is None else threading.Timer(seconds, receiver.stop)
    try:
        if timer is not None:
            timer.start()
        with stopping(receiver.stop):
            if play:
                _show(recording, face)
            else:
                while recording.read1():
                    pass
    finally:
        if timer is not None:
            timer.cancel()
        receiver.stop()
        recording.finish()


def _show(recording: Recording, face: FaceModel | None) -> None:
    """Show a stream in a window until it is closed; nothing if no frame comes."""
    from fba import player
    from fba.face import FaceModel
    from fba_player.playback.live import LiveAnimation, LiveTimeline, wait_for

    name = str(recording.receiver.address)
    live = LiveAnimation(recording, name=name, bap_steps="auto")
    recording.receiver.say = live.tell
    try:
        wait_for(live, lambda text: click.echo(f"fba: {text}", err=True))
        model = face or FaceModel.default()
        scene = player.Scene(live, model, timeline=LiveTimeline(live, model))  # type: ignore[arg-type]
        player.play(scene, title=name)
    except FbaError:
        if recording.receiver.counts.planes:
            raise
    finally:
        recording.receiver.stop()
        live.wait_end(10)
        live.close()
