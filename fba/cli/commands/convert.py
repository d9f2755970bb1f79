"""`fba convert`: from any format that can be read to any that can be written."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli import joint_options, marker_options, options, step_tables, writer_options
from fba.cli.coding.coded_streams import encode_stream
from fba.cli.coding.size_options import Size
from fba.cli.command import Command, examples
from fba.cli.inputs import EXISTING, check_clip, has_markers, has_skeleton, read_input
from fba.cli.outputs import (
    TEXT_FORMATS,
    Output,
    Outputs,
    OutputType,
    display_name,
    find_writer,
    opening_for,
)
from fba.cli.recordings.inputs import Inputs, formats_by_part
from fba.errors import FormatError
from fba.limits import Limits
from fba.source import naming_file

if TYPE_CHECKING:
    from fba.formats.registry import Format


@click.command(
    cls=Command,
    epilog=examples(
        "fba convert old.fap new.fap          # the canonical form",
        "fba convert walk.bvh walk.bap --fps 30",
        "fba convert talk.fba decoded.fap",
        "fba convert walk.bap walk.bvh --joints moving",
        "fba convert both.fba person.glb --model head.glb",
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
@joint_options.map_options(out=False)
@writer_options.writer_options
@options.written_bap_steps_option
@options.mark_option
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
    maps: tuple[Path | joint_options.Pair, ...],
    bap_steps: str,
    mark: bool | None,
    salvage: bool,
    limit: Limits,
    **given: Any,
) -> None:
    """Convert a file into another format; the content of IN and the suffix of OUT say which.

    - is standard input or output. A stream is written as `fba encode` does without options.
    """
    from fba.codec import EncoderOptions
    from fba.formats import write

    writing = find_writer(target, to)  # refuses what cannot be written before anything is read
    outputs = Outputs(
        [Output("OUT", target, writing.name in TEXT_FORMATS)],
        [source, given["model"], given["body"]],
        no_clobber=no_clobber,
    )
    captures = [source] if has_skeleton(source, format) else []
    with_markers = has_markers(source, format)
    bodies_map = maps if given["body"] is not None and not captures and not with_markers else ()
    joints_of_body = joint_options.read_body_joints(bodies_map, given["body"], limit)
    extra = writer_options.settings(target, writing, given, joints_of_body)
    check_clip(clip, [source], format)
    if mark is not None and writing.name != "fba":
        raise click.UsageError(f"--mark is for streams, and {display_name(target)} becomes none")
    joints = places = None
    if with_markers:
        places = marker_options.read_places(maps, [source], format, limit)
    elif not bodies_map:
        joints = joint_options.read_joints(maps, captures, format, clip, limit)
    tables: list[str] = []
    readers: list[Format] = []
    rates: list[Fraction] = []
    animation = read_input(
        source, fps=fps, bap_steps=bap_steps, salvage=salvage, limits=limit, format=format, clip=clip,
        tables=tables, readers=readers, rates=rates, capture={"joints": joints, "markers": places},
    )  # fmt: skip
    marked = mark is not False
    if writing.name == "fba":
        if not len(animation):
            raise FormatError("the file holds no frames; a stream needs one", path=source)
        parts = formats_by_part([animation], readers)
        taken = Inputs(animation, None, None, tuple(tables), parts, animation.rate != rates[0])
        made = taken.is_captured
        table = step_tables.table_to_write(bap_steps, made=made, marked=marked, read=next(iter(tables), None))
        step_tables.warn_of_coarse_steps(animation, table)
        encoder = EncoderOptions(bap_steps=table, mark=marked)
        with naming_file(target):
            coded = encode_stream(animation, encoder, Size(), taken)
        opening = opening_for(target, animation, table, coded.bap_quant, marked=marked)
        outputs.write(target, opening + coded.data)
    else:
        with outputs.file(target) as file:
            write(file, animation, format=writing.name, **extra)
    outputs.say(f"{display_name(target)}: {len(animation)} frames, {writing.written or writing.description}")
    if writing.name == "fba":
        step_tables.remind(target, animation, table, marked=marked)
