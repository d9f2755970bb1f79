"""`fba send`: a stream over a network, or a face to programs that receive Live Link Face."""

from __future__ import annotations

import ipaddress
import socket
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from fba.cli import live_streams, options
from fba.cli.command import Command, examples
from fba.cli.inputs import Reading, read_input
from fba.cli.interruptions import raise_delayed, stopping
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import Output, Outputs, further_output_option

if TYPE_CHECKING:
    from fba.live.addresses import StreamAddress
    from fba.live.streams import Pacer
    from fba.serving import Plane

MOST_PLANES = 100
INTRA_PERIOD = 1.0
"""Seconds from one I plane, at which receivers who lost a packet go on, to the next, in streams made here."""


@dataclass(frozen=True, kw_only=True)
class _Stream:
    """How a stream is sent, to an address such as rtp://HOST:PORT."""

    payload: Literal["3640", "6416"] = option(
        default="3640",
        help="RFC of the RTP payload: 3640 has sizes, and is smaller with several planes a packet; 6416 has "
        "start codes, for receivers that know only MPEG-4 visual streams.",
    )
    planes_per_packet: int = option(
        default=1, type=click.IntRange(1, MOST_PLANES),
        help="Planes in a packet: fewer bytes of headers, but all planes wait for the last.",
    )  # fmt: skip
    sdp: Path | None = further_output_option(
        "FILE.sdp", "Description of the session to write, for receivers."
    )
    no_clobber: bool = options.no_clobber_option


@click.command(
    cls=Command,
    epilog=examples(
        "fba send talk.fba rtp://192.168.0.20:5004",
        "fba send talk.fba rtp://239.1.2.3:5004 --sdp talk.sdp --loop",
        "fba send talk.fba tcp://192.168.0.20:5004",
        "fba send - --live rtp://192.168.0.20:5004",
        "fba send talk.fba 127.0.0.1:11111 --name Anna --loop",
    ),
)
@click.argument("file", type=options.EXISTING)
@click.argument("address", metavar=f"[{live_streams.ADDRESSES}|ADDRESS[:PORT]]")
@with_options
def command(
    file: Path,
    address: str,
    stream: _Stream,
    name: str | None = option(help='Name of the subject, for receivers of Live Link Face. Default: "fba".'),
    loop: bool = option(default=False, help="Start again at the end."),
    live: bool = option(
        default=False,
        help="Send what comes on standard input at once. Without it, planes wait for their time, counted "
        "from the first, so that a stream that comes faster is sent at its own pace.",
    ),
    seconds: Fraction | None = option(
        type=options.PERIOD, metavar="SECONDS", help="Stop after that; default: at the end."
    ),
    reading: Reading = group("format", "source_rate", "clip", "bap_steps", "limit"),
) -> None:
    """Send a stream at its own pace, to `fba play`, `fba capture`, `fba serve` and other receivers.

    rtp://HOST:PORT sends RTP packets, which lose and overtake each other; tcp:// the same over a connection;
    udp:// bytes of the stream alone. - is standard input: an FBA stream is sent as it comes. Files of other
    formats are encoded first.

    An address without rtp://, udp:// or tcp:// gets a face as Live Link Face sends it from a telephone, for
    Unreal Engine, Blender with an add-on, `fba capture livelink`. FAPs become ARKit's shapes, as they do in
    the tables that `fba decode` writes. The port is 11111 by default.
    """
    limit_seconds = None if seconds is None else float(seconds)
    if live and str(file) != "-":
        raise click.UsageError("--live goes with standard input (-): a file is sent at its own pace")
    if "://" in address:
        if name is not None:
            raise click.UsageError("--name is for receivers of Live Link Face, whose address has no ://")
        _send_stream(file, address, stream, reading, loop=loop, live=live, seconds=limit_seconds)
        return
    for option_name in ("payload", "planes_per_packet", "sdp"):
        if options.is_given(option_name):
            flag = "--" + option_name.replace("_", "-")
            raise click.UsageError(f"{flag} goes with an address such as {live_streams.ADDRESSES}")
    from fba.live.receiver import split_address
    from fba.live.sending import send

    animation = read_input(file, reading)
    target = split_address(address, 11111)
    count = send(animation, target, subject=name or "fba", loop=loop, seconds=limit_seconds)
    click.echo(f"{count} frames sent to {target[0]}, UDP port {target[1]}")


def _send_stream(
    file: Path, text: str, stream: _Stream, reading: Reading, *, loop: bool, live: bool, seconds: float | None
) -> None:
    """Send planes of a file, or of standard input."""
    from fba.live.addresses import parse_address
    from fba.live.streams import Pacer, StreamSender

    address = parse_address(text)
    if stream.sdp is not None and address.scheme != "rtp":
        raise click.UsageError("--sdp describes streams by RTP: give an address such as rtp://HOST:PORT")
    if options.is_given("payload") and address.scheme == "udp":
        raise click.UsageError("--payload is for RTP: give an address such as rtp://HOST:PORT")
    if loop and str(file) == "-":
        raise click.UsageError("--loop repeats a file; standard input (-) comes once")
    written = [] if stream.sdp is None else [Output("--sdp", stream.sdp)]
    outputs = Outputs(written, [file], no_clobber=stream.no_clobber)
    planes = None
    if str(file) != "-":
        planes = live_streams.file_planes(file, reading, period=INTRA_PERIOD, again=True)[0]
    raise_delayed()  # from here on, Ctrl-C ends the sending and not the command
    pace = Pacer(seconds)
    sender = StreamSender(address, kind=stream.payload, planes_per_packet=stream.planes_per_packet)
    with sender, stopping(pace.stop):
        count = 0
        for plane, time in _timed(planes, reading, pace, loop=loop, live=live):
            if not count:
                _describe(outputs, file, address, stream, plane)
            sender.send(plane, time)
            count += 1
        if count:
            sender.finish()
    click.echo(f"{count} planes sent to {address}: {sender.packets} packets, {sender.bytes} bytes")


def _timed(
    planes: list[Plane] | None, reading: Reading, pace: Pacer, *, loop: bool, live: bool
) -> Iterator[tuple[Plane, float]]:
    from fba.live.streams import repeated
    from fba.serving import arriving

    if planes is not None:
        yield from repeated(planes, pace, loop=loop)
        return
    read, splitter = live_streams.piped_planes(reading)
    for plane in arriving(read, splitter, pace, live=live):
        yield plane, plane.time


def _describe(outputs: Outputs, file: Path, address: StreamAddress, stream: _Stream, first: Plane) -> None:
    """Print how much later planes come, and write the description of the session, before the first plane."""
    from fba.carriage.payloads import full_configuration
    from fba.carriage.sdp import Session, write_sdp

    if stream.planes_per_packet > 1:
        late = 1000 * (stream.planes_per_packet - 1) / first.rate
        click.echo(f"fba: {stream.planes_per_packet} planes a packet: up to {late:.0f} ms later", err=True)
    if stream.sdp is not None:
        title = "FBA" if str(file) == "-" else file.stem
        configuration = full_configuration(first.configuration)
        host = _number_of(address.host or "127.0.0.1", address.port)
        session = Session(host, address.port, stream.payload, configuration=configuration, title=title)
        outputs.write(stream.sdp, write_sdp(session).encode())


def _number_of(host: str, port: int) -> str:
    """Return the address of a name, which has been found before."""
    return str(ipaddress.ip_address(socket.getaddrinfo(host, port)[0][4][0]))
