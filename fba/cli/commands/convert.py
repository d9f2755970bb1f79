"""`fba convert`: from any format that can be read to any that can be written."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import click

from fba.cli import options, step_tables, writer_options
from fba.cli.command import Command, examples
from fba.cli.inputs import EXISTING, check_clip, read_input
from fba.cli.outputs import (
    TEXT_FORMATS,
    Output,
    Outputs,
    OutputType,
    display_name,
    find_writer,
)
from fba.limits import Limits


@click.command(
    cls=Command,
    epilog=examples(
        "fba convert old.fap new.fap          # the canonical form",
        "fba convert walk.bvh walk.bap --fps 30",
        "fba convert talk.fba decoded.fap",
        "fba convert walk.bap walk.bvh --joints moving",
        "fba convert both.fba person.glb --bap-steps visage --model head.glb",
        "fba convert walk.bvh - --to bap | less",
    ),
)
@click.argument("source", metavar="IN", type=EXISTING)
@click.argument("target", metavar="OUT", type=OutputType())
@options.fps_option("Resample to this frame rate; default: the input's own.")
@options.from_option
@options.clip_option
@options.to_option
@options.no_clobber_option
@writer_options.writer_options
@options.bap_steps_option
@options.salvage_option
@options.limit_option
def command(
    source: Path,
    target: Path,
    fps: Fraction | None,
    format: str | None,
    clip: str | None,
    to: str | None,
    no_clobber: bool,
    bap_steps: str,
    salvage: bool,
    limit: Limits,
    **given: Any,
) -> None:
    """Convert a file into another format; the content of IN and the suffix of OUT say which.

    - is standard input or output. A stream is written with the encoder's defaults: `fba encode` has its
    options.
    """
    from fba.formats import write

    writing = find_writer(target, to)  # refuses what cannot be written before anything is read
    outputs = Outputs(
        [Output("OUT", target, writing.name in TEXT_FORMATS)],
        [source, given["model"], given["body"]],
        no_clobber=no_clobber,
    )
    extra = writer_options.settings(target, writing, given)
    if writing.name == "fba":
        extra["bap_steps"] = bap_steps
    check_clip(clip, [source], format)
    animation = read_input(
        source, fps=fps, bap_steps=bap_steps, salvage=salvage, limits=limit, format=format, clip=clip
    )
    if writing.name == "fba":
        step_tables.warn_of_coarse_steps(animation, bap_steps)
    with outputs.file(target) as file:
        write(file, animation, format=writing.name, **extra)
    outputs.say(f"{display_name(target)}: {len(animation)} frames, {writing.written or writing.description}")
    if writing.name == "fba":
        step_tables.remind(target, animation, bap_steps)
