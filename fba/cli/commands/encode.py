"""`fba encode`: FAP and BAP files, motion capture and captured faces to an FBA stream."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import click

from fba.animation import Animation
from fba.cli import capture_report, joint_options, marker_options, options, step_tables
from fba.cli.clamped_values import bring_near, clamped_lines
from fba.cli.coding import capture_options, size_options
from fba.cli.coding.coded_streams import encode_as_epf, encode_stream
from fba.cli.command import Command, examples
from fba.cli.inputs import EXISTING, check_clip, has_markers, has_skeleton
from fba.cli.outputs import Output, Outputs, OutputType, display_name, opening_for
from fba.cli.printing import Progress
from fba.cli.recordings import voice
from fba.cli.recordings.inputs import (
    Moment,
    read_inputs,
    sync_options,
    together_lines,
    together_values,
)
from fba.limits import Limits


class _EncodeCommand(Command):
    """`fba encode`, whose --report takes the next word only if that names a page or a picture."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        pairs = pairwise([*args, ""])
        words = [
            "--report=" if word == "--report" and Path(after).suffix not in capture_report.SUFFIXES else word
            for word, after in pairs
        ]
        return super().parse_args(ctx, words)


@click.command(
    cls=_EncodeCommand,
    epilog=examples(
        "fba encode walk.bvh -o walk.fba",
        "fba encode face.csv -o face.fba",
        "fba encode talk.fap gesture.bap -o both.fba --fps 25 --quant 4 --bap-steps visage",
        "fba encode talk.fap -o talk.fba --tolerance 0.5mm",
        "fba encode talk.fap -o talk.fba --bitrate 1.5kbit/s --buffer 0.5s",
        "fba encode talk.fap -o talk.fba --start-codes --intra-period 2",
        "fba encode talk.fap -o again.fba --epf talk.epf",
        "fba encode walk.bvh -o walk.fba --report --limits report",
        "fba encode face.c3d -o face.fba --fps 25 --map-out markers.toml",
        "fba encode talk.fap -o talk.fba --fit ada.glb    # fba model learn-fit makes that head",
        "fba encode face.csv body.bvh -o both.fba --offset 2.4 --audio speech.wav",
    ),
)
@click.argument("inputs", metavar="IN...", nargs=-1, required=True, type=EXISTING)
@click.option(
    "-o",
    "--output",
    metavar="OUT.fba",
    required=True,
    type=OutputType(),
    help="Stream to write; - for standard output.",
)
@options.no_clobber_option
@options.fps_option("Resample to this frame rate (25, 29.97, 30000/1001); default: the input's own.")
@options.from_option
@options.clip_option
@click.option("--name", help="Name of the sequence, for input without a header.")
@size_options.size_options
@click.option(
    "--intra-period",
    type=options.PeriodType(),
    metavar="SECONDS",
    help="Write an I plane at least this often.",
)
@click.option(
    "--start-codes",
    is_flag=True,
    help="Write start codes before I planes, where a decoder can seek to or resume.",
)
@click.option(
    "--time-codes/--no-time-codes",
    default=True,
    show_default=True,
    help="With --start-codes: I planes at whole seconds with a time code: damage shifts nothing behind it.",
)
@options.written_bap_steps_option
@options.mark_option
@options.choice_option("--unsent", "What a player shows for FAPs that are not sent.", "keep", "interpolate")
@click.option(
    "--gender",
    type=click.Choice(["female", "male"]),
    default="female",
    show_default=True,
    callback=lambda _, __, gender: int(gender == "male"),
    help="Gender of the figure that the stream suggests (suggested_gender).",
)
@click.option(
    "--clamp/--no-clamp",
    default=None,
    help="Limit values to the codable range instead of failing; default: for motion capture only.",
)
@click.option("--epf", type=EXISTING, metavar="FILE", help="Code plane by plane as this EPF file says.")
@capture_options.capture_options
@sync_options
@voice.audio_options
@options.choice_option(
    "--limits",
    "Report where joints exceed normal human motion, or clamp them to it.",
    "off",
    "report",
    "clamp",
)
@click.option(
    "--report",
    is_flag=False,
    flag_value="",
    metavar="[FILE.html|.png]",
    help="Motion capture: print how the result differs from the source; with FILE, show it in pictures, too.",
)
@options.salvage_option
@options.limit_option
@options.json_option
def command(
    inputs: tuple[Path, ...],
    output: Path,
    no_clobber: bool,
    fps: Fraction | None,
    format: str | None,
    clip: str | None,
    name: str | None,
    epf: Path | None,
    maps: tuple[Path | joint_options.Pair, ...],
    map_out: Path | None,
    sync: str | None,
    offset: Moment | None,
    trim: bool,
    audio: Path | None,
    audio_offset: float | None,
    limits: str,
    report: str | None,
    salvage: bool,
    as_json: bool,
    limit: Limits,
    mark: bool | None,
    bap_steps: str,
    **settings: Any,
) -> None:
    """Encode FAP and BAP files, motion capture or captured faces as an FBA stream.

    A face file and a body file together become one stream: captures by their time codes where both have
    them, else from the start on (--sync, --offset). Ranges fit the data. A value that no range can carry is
    an error; --clamp limits it to the codable range. With --epf, only what that file says is written, and no
    mark unless you ask for one.
    """
    from fba.codec import EncoderOptions

    size_options.check_sizes()
    size = size_options.Size.take(settings)
    check_clip(clip, inputs, format)
    page = _report_file(report)
    written = [Output("--output", output), *([Output("--report", page)] if page is not None else [])]
    saved = [] if map_out is None else [Output("--map-out", map_out, True)]
    sounds = voice.check_audio(audio, audio_offset, output)
    read = [*inputs, epf, audio, size.model, size.fit, *(each for each in maps if isinstance(each, Path))]
    outputs = Outputs([*written, *saved, *sounds], read, no_clobber=no_clobber)
    captures = [path for path in inputs if has_skeleton(path, format)]
    marked = [path for path in inputs if has_markers(path, format)]
    capture = capture_options.take_capture_options(settings, inputs, format)
    if map_out is not None and not (captures or marked):
        raise click.UsageError("--map-out goes with motion capture: joints of a body, or markers on a face")
    if (maps or map_out is not None) and captures and marked:
        raise click.UsageError("--map and --map-out go with one capture; encode face and body by themselves")
    joints = places = None
    if marked:
        places = marker_options.read_places(maps, marked, format, limit)
    else:
        joints = joint_options.read_joints(maps, captures, format, clip, limit)
    capture |= {"joints": joints, "markers": places}
    taken = read_inputs(
        inputs, capture=capture, sync=sync, offset=offset, trim=trim, fps=fps, format=format, limits=limit,
        timed=audio is not None, name=name, bap_steps=bap_steps, salvage=salvage, clip=clip,
    )  # fmt: skip
    animation = taken.animation
    spoken = voice.place_voice(audio, audio_offset, taken, sounds[0].path) if audio is not None else None
    if report is not None and (animation.body is None or not captures):
        raise click.UsageError(
            "--report compares motion capture with its result, and there is no body to compare"
        )
    animation, limit_values = capture_report.apply_limits(animation, limits)
    if settings["clamp"] is None:
        settings["clamp"] = taken.is_captured
    mark = mark if mark is not None else epf is None
    table = step_tables.table_to_write(
        bap_steps, made=taken.has_captured_body, marked=mark, read=taken.tables[0] if taken.tables else None
    )
    settings |= size.quantisers() | {"bap_steps": table, "mark": mark}
    if captures and not options.is_given("origin"):
        animation = bring_near(animation, table, settings["bap_quant"])
    with Progress("encoding", None):
        if epf is not None:
            coded = encode_as_epf(epf, animation, settings, limit)
        else:
            coded = encode_stream(animation, EncoderOptions(**settings), size, taken)
    step_tables.warn_of_coarse_steps(animation, table, coded.bap_quant, captured=bool(captures))
    opening = opening_for(output, animation, table, coded.bap_quant, marked=mark)
    outputs.write(output, opening + coded.data)
    if spoken is not None:
        voice.write_voice(outputs, spoken)
    if map_out is not None:
        with outputs.file(map_out) as file:
            if marked:
                mapped = marker_options.write_used_places(file, places, marked[0], format, limit)
            else:
                mapped = joint_options.write_joints(file, joints, captures[0], format, clip, limit)
        what = f"markers of {marked[0]}" if marked else f"joints of {captures[0]}"
        outputs.say(f"{display_name(map_out)}: {mapped} {what}")
    detailed = report is not None
    reports = []
    if captures and animation.body is not None:
        with Progress("comparing", None):
            source, lead = taken.body_of(animation)
            shown = _decode(coded.data, bap_steps=table)
            if len(shown) < len(animation):  # players fill in the frames that were left out
                shown = shown.resample(shown.rate)
            decoded, _ = taken.body_of(shown)
            reports = capture_report.compare_captures(
                captures, source, decoded, coded.clamped, ground=str(capture["ground"]), detailed=detailed,
                format=format, clip=clip, options=capture, lead=lead,
            )  # fmt: skip
            if page is not None:
                draw = capture_report.write_page if page.suffix == ".html" else capture_report.draw_report
                outputs.write(page, draw(reports[0]))
    for one in reports:
        if line := capture_report.poor_line(one, detailed=detailed):
            click.echo(line, err=True)
    if as_json:
        used = {"bap_steps": table if animation.body is not None else None}
        said: dict[str, Any] = {"verdict": reports[0].comparison.verdict} if reports else {}
        if detailed:
            said["captures"] = [capture_report.report_values(one) for one in reports]
        figures = coded.figures(animation)
        if taken.together is not None:
            figures |= together_values(inputs, taken.together)
        if spoken is not None:
            figures |= voice.voice_values(spoken)
        outputs.print_json({"output": str(output), **figures, **used, **said, **limit_values})
        return
    for line in (
        coded.summary(output, animation),
        *coded.lines,
        *(together_lines(inputs, taken.together) if taken.together is not None else ()),
        *((voice.voice_line(spoken),) if spoken is not None else ()),
        *clamped_lines(coded.clamped),
        *(line for one in reports if detailed for line in capture_report.report_lines(one)),
        *capture_report.limit_lines(limit_values),
    ):
        outputs.say(line)
    step_tables.remind(output, animation, table, coded.bap_quant, marked=mark)


def _report_file(report: str | None) -> Path | None:
    """Return the file of `--report`, or None."""
    if not report:
        return None
    path = Path(report)
    if path.suffix not in capture_report.SUFFIXES:
        raise click.UsageError(f"--report={report}: a report is a page, .html, or a picture, .png")
    return path


def _decode(data: bytes, bap_steps: str) -> Animation:
    from fba.codec import decode

    return decode(data, bap_steps=bap_steps)
