"""`fba convert`: from any format that can be read to any that can be written."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import click

from fba.cli import options, writer_options


@click.command(
    cls=options.Command,
    epilog=options.examples(
        "fba convert old.fap new.fap          # the canonical form",
        "fba convert walk.bvh walk.bap --fps 30",
        "fba convert talk.fba talk.fap",
        "fba convert walk.bap walk.bvh --joints moving",
        "fba convert both.fba person.glb --bap-steps visage --model head.glb",
    ),
)
@click.argument("source", metavar="IN", type=options.EXISTING)
@click.argument("target", metavar="OUT", type=click.Path(dir_okay=False, path_type=Path))
@options.fps_option("Resample to this frame rate; default: the input's own.")
@click.option("--to", metavar="FORMAT", help="Format to write, where the suffix of OUT does not say it.")
@writer_options.writer_options
@options.bap_steps_option
@options.salvage_option
def command(
    source: Path,
    target: Path,
    fps: Fraction | None,
    to: str | None,
    bap_steps: str,
    salvage: bool,
    **given: Any,
) -> None:
    """Convert a file into another format; the content of IN and the suffix of OUT say which.

    A stream is written with the encoder's defaults: `fba encode` has its options.
    """
    from fba.formats import write, writer_for

    writing = writer_for(target, to)  # refuses what cannot be written before anything is read
    extra = writer_options.settings(target, writing, given)
    if writing.name == "fba":
        extra["bap_steps"] = bap_steps
    animation = options.read_input(source, fps=fps, bap_steps=bap_steps, salvage=salvage)
    write(target, animation, format=writing.name, **extra)
    click.echo(f"{target}: {len(animation)} frames, {writing.description}")
