"""`fba send`: a face to programs that receive Live Link Face."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import click

from fba.cli import options
from fba.cli.command import Command, examples
from fba.cli.inputs import EXISTING, Reading, read_input


@click.command(
    cls=Command,
    epilog=examples(
        "fba send talk.fba 192.168.0.20",
        "fba send talk.fba 127.0.0.1:11111 --name Anna --loop",
    ),
)
@click.argument("file", type=EXISTING)
@click.argument("address", metavar="ADDRESS[:PORT]")
@click.option("--name", default="fba", show_default=True, help="Name of the subject, for the receiver.")
@click.option("--loop", is_flag=True, help="Start again at the end.")
@click.option(
    "--seconds", type=options.PeriodType(), metavar="SECONDS", help="Stop after that; default: at the end."
)
@options.fps_option("Frame rate of a file without a header.")
@options.from_option
@options.clip_option
@options.limit_option
@options.gather(reading=Reading)
def command(
    file: Path,
    address: str,
    name: str,
    loop: bool,
    seconds: Fraction | None,
    fps: Fraction | None,
    reading: Reading,
) -> None:
    """Send a face, at its own pace, as Live Link Face sends it from a telephone.

    Programs that receive that show it: Unreal Engine, Blender with an add-on, `fba capture livelink`. FAPs
    become ARKit's shapes, as they do in the tables that `fba decode` writes. The port is 11111 by default.
    """
    from fba.live.receiver import split_address
    from fba.live.sending import send

    animation = read_input(file, reading, header_fps=fps)
    target = split_address(address, 11111)
    limit_seconds = None if seconds is None else float(seconds)
    count = send(animation, target, subject=name, loop=loop, seconds=limit_seconds)
    click.echo(f"{count} frames sent to {target[0]}, UDP port {target[1]}")
