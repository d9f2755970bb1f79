"""`fba gait`: generates walks, and detects the steps of a walk."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fba.choices import BapTableOrAuto
from fba.cli import options, step_tables
from fba.cli.command import Command, examples, usage_errors
from fba.cli.inputs import Reading, read_input
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import Output, Outputs, display_name, find_writer, output_option
from fba.cli.printing import print_json, seconds_text
from fba.encoder_options import EncoderOptions

if TYPE_CHECKING:
    from fba.animation import Animation

DEFAULT_RATE = Fraction(30)


@dataclass(frozen=True, kw_only=True)
class _Walk:
    """The walk to make: arguments of `fba.body.gait.walk`."""

    stride: float | None = option(
        metavar="METRES",
        help="Length of two steps, from one contact of a foot to its next; sets the speed. Default: the "
        "character's own.",
    )
    character: str = option(default="normal", metavar="NAME", help="One of --list.")
    cycles: float | None = option(metavar="N", help="Number of strides; default: 4.")
    seconds: float | None = option(metavar="SECONDS", help="Duration, instead of --cycles.")
    in_place: bool = option(default=False, help="Walk on the spot.")

    def check(self, *, made: bool) -> None:
        """Raise click.UsageError for options that contradict each other, or for any where no walk is made."""
        if self.cycles is not None and self.seconds is not None:
            raise click.UsageError("give either --cycles or --seconds, not both")
        lengths = {"--cycles": self.cycles, "--seconds": self.seconds}
        given = {"--stride": self.stride, **lengths, "--in-place": self.in_place or None}
        for flag, value in given.items() if not made else ():
            if value is not None:
                raise click.UsageError(f"{flag} goes with -o: it is of a walk that is made")
        for flag, length in lengths.items():
            if length is not None and not length > 0:
                raise click.UsageError(f"{flag} must be a positive number, not {length:g}")


@dataclass(frozen=True, kw_only=True)
class _Target:
    """Where a walk goes."""

    output: Path | None = output_option(
        "OUT", "File to write; its suffix says in which format. - for standard output."
    )
    to: str | None = options.to_option
    no_clobber: bool = options.no_clobber_option
    mark: bool | None = options.mark_option


@click.command(
    cls=Command,
    epilog=examples(
        "fba gait --stride 0.7 --character bored -o walk.fba",
        "fba gait --character hurried --seconds 10 --fps 25 -o walk.bap",
        "fba gait --list",
        "fba gait --find walk.bap",
    ),
)
@with_options
def command(
    walk: _Walk,
    target: _Target,
    rate: Fraction = option(
        "--fps", type=options.RATE, default=DEFAULT_RATE, metavar="RATE", help="Frame rate of the walk."
    ),
    listed: bool = option("--list", default=False, help="List the characters."),
    find: Path | None = option(
        type=options.EXISTING, metavar="FILE", help="Print the cycles and poses in a walk."
    ),
    reading: Reading = group("format", "source_rate", "limit", bap_steps=options.written_steps_option),
    as_json: bool = options.json_option,
) -> None:
    """Generate a walk: body animation from four characteristic poses and a character.

    A foot on the ground does not move. The standard's BAP steps (--bap-steps iso) move the body by 64 mm at a
    time; a stream gets finer ones, and says so.
    """
    if sum((target.output is not None, listed, find is not None)) != 1:
        raise click.UsageError("give one of -o OUT, --list and --find FILE")
    if target.to is not None and target.output is None:
        raise click.UsageError("--to goes with -o")
    walk.check(made=target.output is not None)
    if listed:
        _print_characters(as_json)
    elif find is not None:
        _print_steps(find, reading, as_json)
    elif target.output is not None:
        if as_json:
            raise click.UsageError("--json goes with --list and --find")
        _write_walk(walk, rate, target.output, target, reading.bap_steps)


def _write_walk(
    walk: _Walk, rate: Fraction, output: Path, target: _Target, bap_steps: BapTableOrAuto
) -> None:
    """Make a walk, write it to the output and print a summary."""
    from fba.body import gait
    from fba.planning import encode

    writing = find_writer(output, target.to)  # raises its errors before a walk is made
    outputs = Outputs([Output.of_format("--output", output, writing)], no_clobber=target.no_clobber)
    with usage_errors("walk: "):
        animation = gait.walk(rate=rate, **asdict(walk))
    marked = target.mark is not False
    table = step_tables.table_to_write(bap_steps, made=True, marked=marked)
    if writing.name == "fba":
        step_tables.warn_of_coarse_steps(animation, table)
        data = encode(animation, EncoderOptions(bap_steps=table, mark=marked, clamp=True))
        outputs.write_stream(output, data, animation, table, marked=marked)
    else:
        outputs.write_animation(output, animation, writing)
    outputs.say(_summary(animation, output, walk.character, in_place=walk.in_place))
    if writing.name == "fba":
        step_tables.remind(output, animation, table, marked=marked)


def _summary(animation: Animation, output: Path, character: str, *, in_place: bool) -> str:
    from fba.body import gait

    way = gait.advance(animation) / 1000.0
    line = f"{display_name(output)}: {character}, {len(animation)} frames, {seconds_text(animation.duration)}"
    if not in_place and len(animation) > 1:
        speed = way / float((len(animation) - 1) / animation.rate)
        line += f", {way:.2f} m at {speed:.2f} m/s"
    return line


def _print_characters(as_json: bool) -> None:
    from fba.body import gait

    characters = [gait.Character.named(name) for name in gait.characters()]
    if as_json:
        rows = [
            {"name": c.name, "about": c.about, "stride": c.stride, "seconds": c.seconds} for c in characters
        ]
        print_json(rows)
        return
    width = max(len(c.name) for c in characters)
    for c in characters:
        pace = f"{c.stride:.2f} m in {c.seconds:.2f} s"
        click.echo(f"{c.name:{width}}  {pace}  {c.about}")


def _print_steps(file: Path, reading: Reading, as_json: bool) -> None:
    from fba.body import gait
    from fba.errors import FormatError

    animation = read_input(file, reading)
    if animation.body is None:
        raise FormatError("has no body to walk with", path=file)
    detected = gait.detect(animation)
    if as_json:
        print_json(detected.as_dict())
        return
    for line in detected.lines():
        click.echo(line)
