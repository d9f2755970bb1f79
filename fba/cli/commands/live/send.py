"""`fba send`: a face to programs that receive Live Link Face."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import click

from fba.cli import options
from fba.cli.command import Command, examples
from fba.cli.inputs import Reading, read_input
from fba.cli.option_fields import group, option, with_options


@click.command(
    cls=Command,
    epilog=examples("fba send talk.fba 192.168.0.20", "fba send talk.fba 127.0.0.1:11111 --name Anna --loop"),
)
@click.argument("file", type=options.EXISTING)
@click.argument("address", metavar="ADDRESS[:PORT]")
@with_options
def command(
    file: Path,
    address: str,
    name: str = option(default="fba", help="Name of the subject, for the receiver."),
    loop: bool = option(default=False, help="Start again at the end."),
    seconds: Fraction | None = option(
        type=options.PERIOD, metavar="SECONDS", help="Stop after that; default: at the end."
    ),
    reading: Reading = group("format", "source_rate", "clip", "limit"),
) -> None:
    """Send a face, at its own pace, as Live Link Face sends it from a telephone.

    Programs that receive that show it: Unreal Engine, Blender with an add-on, `fba capture livelink`. FAPs
    become ARKit's shapes, as they do in the tables that `fba decode` writes. The port is 11111 by default.
    """
    from fba.live.receiver import split_address
    from fba.live.sending import send

    animation = read_input(file, reading)
    target = split_address(address, 11111)
    limit_seconds = None if seconds is None else float(seconds)
    count = send(animation, target, subject=name, loop=loop, seconds=limit_seconds)
    click.echo(f"{count} frames sent to {target[0]}, UDP port {target[1]}")
