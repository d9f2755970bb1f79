"""`fba serve`: files and streams in browsers."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fba.cli import options, step_tables
from fba.cli.command import STANDARD_INPUT, Command, examples
from fba.cli.inputs import Reading, find_format, read_file, read_stream
from fba.cli.interruptions import raise_delayed, stopping
from fba.cli.option_fields import group, option, with_options
from fba.cli.web_server import HOST_HELP, INTRA_PERIOD, open_server
from fba.encoder_options import EncoderOptions
from fba.parameters import BAP_STEPS_AUTO

if TYPE_CHECKING:
    from collections.abc import Callable

    from fba.serving import Plane, Stage


@click.command(
    cls=Command,
    epilog=examples(
        "fba serve talk.fba --loop",
        "fba serve talk.fba walk.fba --port 9000",
        "fba serve talk.fba --host 0.0.0.0",
        "nc host 7000 | fba serve -",
    ),
)
@click.argument("files", type=options.EXISTING, nargs=-1, required=True)
@with_options
def command(
    files: tuple[Path, ...],
    port: int = option(default=8080, type=click.IntRange(0, 65_535), help="TCP port; 0: any that is free."),
    host: str | None = option(metavar="ADDRESS", help=HOST_HELP),
    loop: bool = option(default=False, help="Files start again at the end."),
    viewers: int = option(default=200, type=click.IntRange(1, 10_000), help="Most viewers at once."),
    reading: Reading = group("format", "source_rate", "clip", "bap_steps", "limit", "track"),
) -> None:
    """Show files, or a stream while it arrives, in browsers: open the address that is printed.

    All viewers see the same at the same time. A file is shown in real time, from the moment that somebody
    watches. - is standard input: an FBA stream is shown as it comes. Ctrl-C ends it.
    """
    if [str(file) for file in files].count("-") > 1:
        raise click.UsageError("standard input (-) can be shown once")
    sources = [_source(file, reading, loop=loop) for file in files]
    titles = [STANDARD_INPUT if str(file) == "-" else file.name for file in files]
    raise_delayed()  # from here on, Ctrl-C ends the server and not the command
    with open_server(titles, host=host, port=port, most_viewers=viewers) as server, stopping(server.stop):
        for number, source in enumerate(sources):
            server.start(number, source)
        server.wait()


def _source(file: Path, reading: Reading, *, loop: bool) -> Callable[[Stage], None]:
    """Return the function that shows a file, or standard input."""
    from fba.serving import PlaneSplitter, show_file, show_pipe

    if str(file) != "-":
        return partial(show_file, stream=_read(file, reading), loop=loop)
    if sys.stdin.isatty():
        raise click.UsageError("- reads standard input, which is the keyboard here: pipe a stream into it")
    table = None if reading.bap_steps == BAP_STEPS_AUTO else reading.bap_steps
    # Unbuffered: a thread that waits in a buffer's lock would hold up the end of the program.
    piped = open(sys.stdin.fileno(), "rb", buffering=0, closefd=False)  # noqa: SIM115 - open for as long as the program runs
    return partial(show_pipe, read=piped.read, splitter=PlaneSplitter(table, reading.limit))


def _read(file: Path, reading: Reading) -> tuple[list[Plane], bytes]:
    """Return the planes of a file, which are made where it is no stream, and the bytes that end them."""
    from fba.codec import encode_animation
    from fba.serving import split_stream

    limits = reading.limit
    reader = find_format(file, reading.format)
    if reader.read_stream is not None:
        data = read_stream(file, reading, reader)
        return split_stream(data, step_tables.table_to_read(file, data, reading.bap_steps, limits), limits)
    animation = read_file(file, reading).animation
    options = EncoderOptions(clamp=True, bap_steps="visage", start_codes=True, intra_period=INTRA_PERIOD)
    return split_stream(encode_animation(animation, options)[0], options.bap_steps, limits)
