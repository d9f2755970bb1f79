"""`fba encode`: FAP and BAP files, motion capture and captured faces to an FBA stream."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import click

from fba.animation import Animation
from fba.choices import Unsent
from fba.cli import capture_report, map_options, options, step_tables
from fba.cli.coding import capture_options, size_options
from fba.cli.coding.clamped_values import bring_near, clamped_lines
from fba.cli.coding.coded_streams import CodedStream, encode_as_epf, encode_stream
from fba.cli.command import Command, examples
from fba.cli.inputs import Reading, check_clip, has_markers, has_skeleton, warn_of_turned_legs
from fba.cli.option_fields import group, option, option_like, with_options
from fba.cli.outputs import Output, Outputs, display_name, output_option
from fba.cli.printing import Progress
from fba.cli.recordings import voice
from fba.cli.recordings.inputs import Inputs, SyncOptions, read_inputs, together_lines, together_values
from fba.encoder_options import EncoderOptions
from fba.parameters import BapTable


class _EncodeCommand(Command):
    """`fba encode`, whose --report takes the next word only if that names a page or a picture."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        pairs = pairwise([*args, ""])
        words = [
            "--report=" if word == "--report" and Path(after).suffix not in capture_report.SUFFIXES else word
            for word, after in pairs
        ]
        return super().parse_args(ctx, words)


@dataclass(frozen=True, kw_only=True)
class _Planes:
    """How planes are coded: see `fba.EncoderOptions`. clamp: None for motion capture only."""

    intra_period: Fraction | None = option_like(
        EncoderOptions, "intra_period", type=options.PERIOD, metavar="SECONDS"
    )
    start_codes: bool = option_like(EncoderOptions, "start_codes")
    time_codes: bool = option_like(EncoderOptions, "time_codes")
    unsent: Unsent = option_like(EncoderOptions, "unsent")
    gender: int = option(
        default=0,
        typed="female",
        show_default=True,
        type=click.Choice(["female", "male"]),
        callback=lambda _, __, gender: int(gender == "male"),
        help="Gender of the figure that the stream suggests (suggested_gender).",
    )
    clamp: bool | None = option_like(
        EncoderOptions, "clamp", default=None, by_default="for motion capture only"
    )


@dataclass(frozen=True, kw_only=True)
class _Request:
    """What the command line asks for."""

    inputs: tuple[Path, ...]
    output: Path = output_option("OUT.fba", "Stream to write; - for standard output.", required=True)
    no_clobber: bool = options.no_clobber_option
    rate: Fraction | None = options.rate_option(
        "Resample to this frame rate (25, 29.97, 30000/1001); default: the input's own."
    )
    name: str | None = option(help="Name of the sequence, for input without a header.")
    size: size_options.Size
    planes: _Planes
    mark: bool | None = options.mark_option
    epf: Path | None = option(
        type=options.EXISTING, metavar="FILE", help="Code plane by plane as this EPF file says."
    )
    capture: capture_options.CaptureOptions
    sync: SyncOptions
    sound: voice.VoiceOptions
    limits: Literal["off", "report", "clamp"] = option(
        default="off", help="Report where joints exceed normal human motion, or clamp them to it."
    )
    report: str | None = option(
        is_flag=False,
        flag_value="",
        metavar="[FILE.html|.png]",
        help="Motion capture: print how the result differs from the source; with FILE, show it in pictures, "
        "too.",
    )
    reading: Reading = group(bap_steps=options.written_steps_option)
    as_json: bool = options.json_option

    @property
    def marked(self) -> bool:
        """Whether the stream names its table of BAP steps."""
        return self.epf is None if self.mark is None else self.mark


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
@click.argument("inputs", metavar="IN...", nargs=-1, required=True, type=options.EXISTING)
@with_options
def command(request: _Request) -> None:
    """Encode FAP and BAP files, motion capture or captured faces as an FBA stream.

    A face file and a body file together become one stream: captures by their time codes where both have
    them, else from the start on (--sync, --offset). Ranges fit the data. A value that no range can carry is
    an error; --clamp limits it to the codable range. With --epf, only what that file says is written, and no
    mark unless you ask for one.
    """
    plan = _plan(request)
    made = _execute(plan)
    _report(plan, made)


@dataclass(frozen=True)
class _Plan:
    """Checked inputs and outputs.

    sound: the WAV file to write. page: the file of `--report`. captures, marked: inputs with the motion of a
    skeleton, and of markers on a face. capture: options of their readers, with the places of `--map`.
    """

    request: _Request
    outputs: Outputs
    sound: Path | None
    page: Path | None
    captures: list[Path]
    marked: list[Path]
    capture: dict[str, Any]

    @property
    def detailed(self) -> bool:
        """Whether a report was asked for."""
        return self.request.report is not None


@dataclass(frozen=True, eq=False)
class _Encoded:
    """The content that was read, coded and written.

    animation: as coded, limited by `--limits`. table: of BAP steps. limits: report of `--limits`.
    """

    taken: Inputs
    animation: Animation
    table: BapTable
    coded: CodedStream
    spoken: voice.Voice | None
    limits: dict[str, Any]
    reports: list[capture_report.CaptureReport]


def _plan(request: _Request) -> _Plan:
    """Return the plan; click.UsageError for options that contradict each other or the inputs."""
    inputs, reading, capture, size = request.inputs, request.reading, request.capture, request.size
    size_options.check_sizes()
    check_clip(reading, inputs)
    page = _report_file(request.report)
    written = [Output("--output", request.output)]
    written += [] if page is None else [Output("--report", page)]
    written += [] if capture.map_out is None else [Output("--map-out", capture.map_out, True)]
    sounds = request.sound.check(request.output)
    read = [
        *inputs,
        request.epf,
        request.sound.audio,
        size.model,
        size.fit,
        *map_options.files_of(capture.maps),
    ]
    outputs = Outputs([*written, *sounds], read, no_clobber=request.no_clobber)
    captures = [path for path in inputs if has_skeleton(path, reading.format)]
    marked = [path for path in inputs if has_markers(path, reading.format)]
    taken = capture.for_readers(inputs, reading)
    if capture.map_out is not None and not (captures or marked):
        raise click.UsageError("--map-out goes with motion capture: joints of a body, or markers on a face")
    if (capture.maps or capture.map_out is not None) and captures and marked:
        raise click.UsageError("--map and --map-out go with one capture; encode face and body by themselves")
    taken |= {"joints": None, "markers": None}
    if marked:
        taken["markers"] = map_options.read_places(capture.maps, marked, reading)
    else:
        taken["joints"] = map_options.read_joints(capture.maps, captures, reading)
    sound = sounds[0].path if sounds else None
    return _Plan(request, outputs, sound, page, captures, marked, taken)


def _execute(plan: _Plan) -> _Encoded:
    """Read the inputs, encode them, and write all files."""
    request, outputs = plan.request, plan.outputs
    taken = read_inputs(
        request.inputs,
        request.reading,
        capture=plan.capture,
        sync=request.sync,
        rate=request.rate,
        name=request.name,
    )
    for file in taken.files:
        warn_of_turned_legs(file.path, file.animation)
    spoken = None if plan.sound is None else voice.place_voice(request.sound, taken, plan.sound)
    if plan.detailed and (taken.animation.body is None or not plan.captures):
        raise click.UsageError(
            "--report compares motion capture with its result, and there is no body to compare"
        )
    animation, limits = capture_report.apply_limits(taken.animation, request.limits)
    table = step_tables.table_to_write(
        request.reading.bap_steps,
        made=taken.has_captured_body,
        marked=request.marked,
        read=taken.tables[0] if taken.tables else None,
    )
    quantisers = request.size.quantisers()
    if plan.captures and not options.is_given("origin"):
        animation = bring_near(animation, table, quantisers["bap_quant"])
    coded = _encode(request, animation, taken, table)
    step_tables.warn_of_coarse_steps(animation, table, coded.bap_quant, captured=bool(plan.captures))
    outputs.write_stream(request.output, coded.data, animation, table, coded.bap_quant, marked=request.marked)
    if spoken is not None:
        voice.write_voice(outputs, spoken)
    _write_map(plan, taken)
    reports = _compare(plan, taken, animation, coded, table)
    return _Encoded(taken, animation, table, coded, spoken, limits, reports)


def _encode(request: _Request, animation: Animation, taken: Inputs, table: BapTable) -> CodedStream:
    """Return the stream. table: of BAP steps."""
    with Progress("encoding", None):
        if request.epf is not None:
            return encode_as_epf(request.epf, animation, table, request.reading.limit, marked=request.marked)
        given = asdict(request.planes) | request.size.quantisers()
        if given["clamp"] is None:
            given["clamp"] = taken.is_captured
        settings = EncoderOptions(**given, bap_steps=table, mark=request.marked)
        return encode_stream(animation, settings, request.size, taken)


def _write_map(plan: _Plan, taken: Inputs) -> None:
    """Write the joints or markers that were used to the file of `--map-out`."""
    target, reading = plan.request.capture.map_out, plan.request.reading
    if target is None:
        return
    with plan.outputs.file(target) as file:
        if plan.marked:
            places = plan.capture["markers"]
            mapped = map_options.write_used_places(file, places, taken.capture_of(plan.marked[0]))
        else:
            motion = taken.capture_of(plan.captures[0])
            if motion is None:  # the input has a face alone, or BAPs, which need no skeleton
                motion = map_options.read_capture(plan.captures[0], reading)
            mapped = map_options.write_used_joints(file, plan.capture["joints"], motion)
    what = f"markers of {plan.marked[0]}" if plan.marked else f"joints of {plan.captures[0]}"
    plan.outputs.say(f"{display_name(target)}: {mapped} {what}")


def _compare(
    plan: _Plan, taken: Inputs, animation: Animation, coded: CodedStream, table: BapTable
) -> list[capture_report.CaptureReport]:
    """Return comparisons of captured bodies with the decoded stream; write the page of `--report`."""
    from fba.codec import decode

    if not plan.captures or animation.body is None:
        return []
    with Progress("comparing", None):
        before, lead = taken.body_of(animation)
        shown = decode(coded.data, bap_steps=table)
        if len(shown) < len(animation):  # players fill in missing frames
            shown = shown.resample(shown.rate)
        after, _ = taken.body_of(shown)
        body = capture_report.CodedBody(before, after, coded.clamped, lead)
        files = [file for file in taken.files if file.path in plan.captures]
        reports = capture_report.compare_captures(
            files, body, plan.capture, plan.request.reading, detailed=plan.detailed
        )
        if plan.page is not None:
            is_page = plan.page.suffix == ".html"
            draw = capture_report.write_page if is_page else capture_report.draw_report
            plan.outputs.write(plan.page, draw(reports[0]))
    return reports


def _report(plan: _Plan, made: _Encoded) -> None:
    """Print the result, for people or for programs."""
    request, coded, animation = plan.request, made.coded, made.animation
    inputs, together, spoken = request.inputs, made.taken.together, made.spoken
    for report in made.reports:
        if line := capture_report.poor_line(report, detailed=plan.detailed):
            click.echo(line, err=True)
    if request.as_json:
        said: dict[str, Any] = {"output": str(request.output), **coded.figures(animation)}
        if together is not None:
            said |= together_values(inputs, together)
        if spoken is not None:
            said |= voice.voice_values(spoken)
        said["bap_steps"] = made.table if animation.body is not None else None
        if made.reports:
            said["verdict"] = made.reports[0].comparison.verdict
        if plan.detailed:
            said["captures"] = [capture_report.report_values(report) for report in made.reports]
        plan.outputs.print_json(said | made.limits)
        return
    for line in (
        coded.summary(request.output, animation),
        *coded.lines,
        *(together_lines(inputs, together) if together is not None else ()),
        *((voice.voice_line(spoken),) if spoken is not None else ()),
        *clamped_lines(coded.clamped),
        *(line for report in made.reports if plan.detailed for line in capture_report.report_lines(report)),
        *capture_report.limit_lines(made.limits),
    ):
        plan.outputs.say(line)
    step_tables.remind(request.output, animation, made.table, coded.bap_quant, marked=request.marked)


def _report_file(report: str | None) -> Path | None:
    """Return the file of `--report`, or None."""
    if not report:
        return None
    path = Path(report)
    if path.suffix not in capture_report.SUFFIXES:
        raise click.UsageError(f"--report={report}: a report is a page, .html, or a picture, .png")
    return path
