"""`fba serve`: files and streams in browsers."""

from __future__ import annotations

from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fba.cli import live_streams
from fba.cli.command import STANDARD_INPUT, Command, examples
from fba.cli.inputs import Reading
from fba.cli.interruptions import raise_delayed, stopping
from fba.cli.live_streams import HOST_HELP, Receiving, open_server
from fba.cli.option_fields import group, option, with_options

if TYPE_CHECKING:
    from collections.abc import Callable

    from fba.serving import Stage


@click.command(
    cls=Command,
    epilog=examples(
        "fba serve talk.fba --loop",
        "fba serve talk.fba walk.fba --port 9000",
        "fba serve talk.fba --host 0.0.0.0",
        "fba serve rtp://0.0.0.0:5004",
        "nc host 7000 | fba serve -",
    ),
)
@click.argument("files", type=live_streams.SOURCE, nargs=-1, required=True)
@with_options
def command(
    files: tuple[Path, ...],
    receiving: Receiving,
    port: int = option(default=8080, type=click.IntRange(0, 65_535), help="TCP port; 0: any that is free."),
    host: str | None = option(metavar="ADDRESS", help=HOST_HELP),
    loop: bool = option(default=False, help="Files start again at the end."),
    viewers: int = option(default=200, type=click.IntRange(1, 10_000), help="Most viewers at once."),
    reading: Reading = group("format", "source_rate", "clip", "bap_steps", "limit", "track"),
) -> None:
    """Show files, or a stream while it arrives, in browsers: open the address that is printed.

    All viewers see the same at the same time. A file is shown in real time, from the moment that somebody
    watches. - is standard input: an FBA stream is shown as it comes. So is one that is sent to an address
    of this computer, rtp://HOST:PORT, or to that of a description, FILE.sdp. Ctrl-C ends it.
    """
    if [str(file) for file in files].count("-") > 1:
        raise click.UsageError("standard input (-) can be shown once")
    receiving.check(files)
    with ExitStack() as stack:
        sources = [_source(file, reading, receiving, stack, loop=loop) for file in files]
        titles = [STANDARD_INPUT if str(file) == "-" else file.name for file in files]
        raise_delayed()  # from here on, Ctrl-C ends the server and not the command
        server = stack.enter_context(open_server(titles, host=host, port=port, most_viewers=viewers))
        with stopping(server.stop):
            for number, source in enumerate(sources):
                server.start(number, source)
            server.wait()


def _source(
    file: Path, reading: Reading, receiving: Receiving, stack: ExitStack, *, loop: bool
) -> Callable[[Stage], None]:
    """Return the function that shows a file, standard input, or a stream from a network."""
    from fba.serving import PlaneSplitter, show_file, show_pipe

    if live_streams.is_from_network(file):
        receiver = live_streams.opened(file, receiving, stack)
        return partial(show_pipe, read=receiver.read1, splitter=PlaneSplitter(None, reading.limit))
    if str(file) != "-":
        return partial(show_file, stream=live_streams.file_planes(file, reading), loop=loop)
    read, splitter = live_streams.piped_planes(reading)
    return partial(show_pipe, read=read, splitter=splitter)
