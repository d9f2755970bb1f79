"""Streams over networks on the command line: addresses, how they arrive, planes to send, the web server."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli import options, step_tables
from fba.cli.inputs import Reading, find_format, read_file, read_stream
from fba.cli.option_fields import option
from fba.encoder_options import EncoderOptions
from fba.errors import FbaError, RangeError
from fba.limits import Limits
from fba.parameters import BAP_STEPS_AUTO, BapTable
from fba.source import naming_file, read_head

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


if TYPE_CHECKING:
    from collections.abc import Callable

    from fba.carriage.sdp import Session
    from fba.live.addresses import StreamAddress
    from fba.live.streams import StreamReceiver
    from fba.serving import Plane, PlaneSplitter

DESCRIPTION = ".sdp"
"""How names of descriptions of sessions end."""
ADDRESSES = "rtp://HOST:PORT"
"""An address as it is typed, for help."""


class SourceType(options.InputType):
    """An existing file, "-" for standard input, or the address of a stream.

    An address is a Path, too, which keeps one of its slashes.
    """

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        if "://" not in str(value):
            return super().convert(value, param, ctx)
        from fba.live.addresses import parse_address

        try:
            return Path(str(parse_address(str(value))))
        except FbaError as error:
            self.fail(str(error), param, ctx)


SOURCE = SourceType()

_BODY = 0x40
"""Bit of the first byte of a plane that says that it carries BAPs: of fba_object_mask, behind is_intra."""


@dataclass(frozen=True, kw_only=True)
class Receiving:
    """How a stream is received."""

    delay: float = option(
        default=100.0, type=options.FloatRange(0, 10_000), metavar="MS",
        help="Of a stream from a network: milliseconds that a packet waits for one before it, which may come "
        "later. In order, none waits.",
    )  # fmt: skip
    wait: float | None = option(
        type=options.FloatRange(0, min_open=True), metavar="SECONDS",
        help="Of a stream from a network: give up if it has not begun by then. Default: wait for it.",
    )  # fmt: skip

    def open(self, source: StreamAddress | Session) -> StreamReceiver:
        """Return the receiver of a stream."""
        from fba.live.streams import StreamReceiver

        return StreamReceiver(source, delay=self.delay / 1000, wait=self.wait)

    def check(self, files: tuple[Path, ...]) -> None:
        """Raise click.UsageError for options of a network without a stream from one."""
        for name in ("delay", "wait"):
            if options.is_given(name) and not any(is_from_network(file) for file in files):
                raise click.UsageError(f"--{name} goes with a stream from a network, such as {ADDRESSES}")


def is_from_network(file: Path) -> bool:
    """Whether this is the address of a stream, or the description of a session."""
    return file.as_posix().startswith(("rtp:/", "udp:/", "tcp:/")) or file.suffix.lower() == DESCRIPTION


def network_source(file: Path) -> StreamAddress | Session:
    """Return where a stream comes from. Raises FbaError."""
    from fba.carriage.sdp import read_sdp
    from fba.live.addresses import parse_address

    if file.suffix.lower() != DESCRIPTION:
        return parse_address(file.as_posix())
    with naming_file(file):
        return read_sdp(read_head(file))


def opened(file: Path, receiving: Receiving, stack: ExitStack) -> StreamReceiver:
    """Return the receiver of a stream, which the stack closes; what it received is printed then."""
    receiver = stack.enter_context(receiving.open(network_source(file)))
    stack.callback(report, receiver)
    return receiver


def report(receiver: StreamReceiver) -> None:
    """Print what a receiver received, and what was left out."""
    for line in receiver.counts.lines() if receiver.counts.packets else ():
        click.echo(f"fba: {receiver.address}: {line}", err=True)


def file_planes(
    file: Path, reading: Reading, *, period: float = INTRA_PERIOD, again: bool = False
) -> tuple[list[Plane], bytes]:
    """Return the planes of a file, which are made where it is no stream, and the bytes that end them.

    period: seconds from one I plane to the next, where they are made. again: they are also made, with the
    same values, of a stream longer than that which can be entered only at its beginning.
    """
    from fba.codec import encode_animation

    limits = reading.limit
    reader = find_format(file, reading.format)
    if reader.read_stream is not None:
        data = read_stream(file, reading, reader)
        table = step_tables.table_to_read(file, data, reading.bap_steps, limits)
        planes, ending = _split(data, table, limits)
        single = (
            again
            and planes[-1].time - planes[0].time > period
            and not any(plane.opening for plane in planes[1:])
        )
        return (_entered_anywhere(file, data, table, period, limits) if single else None) or (planes, ending)
    animation = read_file(file, reading).animation
    made = EncoderOptions(clamp=True, bap_steps="visage", start_codes=True, intra_period=period)
    return _split(encode_animation(animation, made)[0], made.bap_steps, limits)


def _split(data: bytes, table: BapTable, limits: Limits) -> tuple[list[Plane], bytes]:
    """Return the planes of a stream, and the end. Before a face alone, its headers name no BAP steps."""
    from fba.serving import split_stream

    planes, ending = split_stream(data, table, limits)
    if any(unit[0] & _BODY for plane in planes for unit in plane.units):
        return planes, ending
    return split_stream(data, None, limits)


def _entered_anywhere(
    file: Path, data: bytes, table: BapTable, period: float, limits: Limits
) -> tuple[list[Plane], bytes] | None:
    """Return the planes of a stream with more I planes, and the end; None where they would change values."""
    from fba.codec import Decoder, decode, encode_animation

    first = Decoder(bap_steps=table, on_error="salvage").push_blocks(data[: 1 << 16])[0].settings
    options = EncoderOptions(
        fap_quant=1 if first.face is None else first.face.quant,
        bap_quant=1 if first.body is None else first.body.quant,
        bap_steps=table, start_codes=True, intra_period=period,
    )  # fmt: skip
    animation = decode(data, bap_steps=table, on_error="salvage", limits=limits)
    try:
        made = encode_animation(animation, options)[0]
    except RangeError:
        made = b""
    if made and decode(made, bap_steps=table, limits=limits) == animation:
        click.echo(
            f"fba: {file.name} has one I plane: sent with one every {period:g} s, the same values, and "
            f"{len(made)} bytes in place of {len(data)}",
            err=True,
        )
        return _split(made, table, limits)
    click.echo(
        f"fba: {file.name} has one I plane: receivers who come late, or lose a packet, see nothing from then "
        f"on; encode its source with --start-codes --intra-period {period:g}",
        err=True,
    )
    return None


def piped_planes(reading: Reading) -> tuple[Callable[[int], bytes], PlaneSplitter]:
    """Return what reads standard input, and what splits the stream in it into planes."""
    from fba.serving import PlaneSplitter

    table = None if reading.bap_steps == BAP_STEPS_AUTO else reading.bap_steps
    return open_pipe("a stream").read, PlaneSplitter(table, reading.limit)


def open_pipe(what: str) -> FileIO:
    """Return standard input, unbuffered. what: is expected there. Raises click.UsageError for a keyboard."""
    if sys.stdin.isatty():
        raise click.UsageError(f"- reads standard input, which is the keyboard here: pipe {what} into it")
    # Unbuffered: a thread that waits in a buffer's lock would hold up the end of the program.
    return FileIO(sys.stdin.fileno(), closefd=False)
