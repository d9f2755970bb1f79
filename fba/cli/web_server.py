"""The server of `fba serve` and `fba capture --serve`: its options, its page, and captures as its streams."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from fba.serving import Plane, Server, Stage

HOST_HELP = (
    "Own address to listen on, 0.0.0.0 for all; viewers then need the address with a random token that is "
    "printed. Default: only this computer can watch."
)
INTRA_PERIOD = 2
"""Seconds from one I plane, at which viewers who lost frames go on, to the next, in streams made here."""


def make_page(titles: Sequence[str]) -> bytes:
    """Return the page that shows streams with these titles: faces as a head, bodies as a person."""
    from fba_player.export.page import make_page

    return make_page([], with_body=True, live=True, title=" | ".join(titles)).encode()


@contextmanager
def open_server(
    titles: Sequence[str], *, host: str | None, port: int, most_viewers: int | None = None
) -> Iterator[Server]:
    """Serve streams; print the address of their page. most_viewers: at once, by default `MOST_VIEWERS`."""
    from fba.serving import MOST_VIEWERS, Server

    server = Server(
        make_page(titles), titles, host=host, port=port, most_viewers=most_viewers or MOST_VIEWERS
    )
    with server:
        click.echo(f"fba: open {server.url}", err=True)
        yield server


class StreamTarget:
    """A target of a `fba.live.StreamRecorder` that shows its stream to viewers; to nobody without a stage."""

    def __init__(self, stage: Stage | None = None) -> None:
        from fba.serving import PlaneSplitter

        self._stage = stage
        self._splitter = PlaneSplitter()

    def begin(self, opening: bytes) -> None:
        """Begin the stream with the bytes before it."""
        self.write(opening, b"")

    def write(self, data: bytes, ending: bytes) -> None:
        """Add bytes."""
        self._publish(self._splitter.push(data) if data else [])

    def close(self) -> None:
        """End the stream."""
        if self._splitter.planes:
            self._publish(self._splitter.finish())
            if self._stage is not None:
                self._stage.end(self._splitter.ending)

    def _publish(self, planes: list[Plane]) -> None:
        if self._stage is not None:
            for plane in planes:
                self._stage.publish(plane)
