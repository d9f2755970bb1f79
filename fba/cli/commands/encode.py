"""`fba encode`: FAP and BAP files, motion capture and captured faces to an FBA stream."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from fba.animation import Animation
from fba.cli import capture_report, joint_options, marker_options, options, step_tables
from fba.cli.clamped_values import bring_near, clamped_lines, clamped_values
from fba.cli.command import Command, examples
from fba.cli.inputs import (
    EXISTING,
    check_capture_options,
    check_clip,
    has_markers,
    has_skeleton,
    input_file,
)
from fba.cli.outputs import Output, Outputs, OutputType, display_name
from fba.cli.printing import Progress, rate_text, seconds_text
from fba.cli.recordings import voice
from fba.cli.recordings.inputs import (
    Moment,
    read_inputs,
    sync_options,
    together_lines,
    together_values,
)
from fba.limits import Limits

if TYPE_CHECKING:
    from fba.codec import ClampedParameter

CAPTURE = ("spine", "ground", "plant", "origin", "rest", "up", "scale", "swap", "face", "neutral", "gaze",
           "head_path", "aspect")  # fmt: skip
"""Options that say how a capture becomes BAPs and FAPs: those that its reader takes count."""


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
        "fba encode talk.fap -o talk.fba --start-codes --intra-period 2",
        "fba encode talk.fap -o again.fba --epf talk.epf",
        "fba encode walk.bvh -o walk.fba --report --limits report",
        "fba encode face.c3d -o face.fba --fps 25 --map-out markers.toml",
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
@options.fap_quant_option
@click.option(
    "--bap-quant",
    type=click.IntRange(0, 31),
    default=1,
    show_default=True,
    help="Quantiser of BAPs (bap_quant); 0: unquantised.",
)
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
@options.choice_option(
    "--preset",
    "What is sent: all that is given (reference); not what never moves (exact); of the FAPs only those that "
    "players do not derive from others (compact).",
    "reference", "exact", "compact",
)  # fmt: skip
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
@options.choice_option(
    "--spine",
    "Motion capture: turn a dozen vertebrae, all, four, or one for each joint of the source.",
    "spread", "full", "simple", "joints",
)  # fmt: skip
@options.choice_option(
    "--ground",
    "Motion capture: feet stand at height 0, at the height of the source's ground, or uncorrected.",
    "floor", "source", "none",
)  # fmt: skip
@click.option(
    "--plant/--no-plant",
    default=True,
    show_default=True,
    help="Motion capture: bend legs a little where feet would otherwise miss the ground, or slip on it.",
)
@options.choice_option(
    "--origin", "Motion capture: what is placed at the default position.", "source", "start", "middle"
)
@joint_options.map_options(out=True)
@click.option(
    "--rest",
    type=joint_options.RestType(),
    default="auto",
    show_default=True,
    metavar="auto|file|first|motion|N",
    help="Motion capture: the rest pose is the file's own, its first frame, frame N, or found in the motion.",
)
@options.choice_option(
    "--up", "Motion capture: the axis that points up.", "auto", "+x", "-x", "+y", "-y", "+z", "-z"
)
@click.option(
    "--scale",
    type=click.FloatRange(1e-6, 1e6),
    metavar="METRES",
    help="Motion capture: metres of the person shown in one unit of the file, in place of what its legs say.",
)
@options.choice_option(
    "--swap",
    "Live Link Face's tables: MouthLeft and MouthRight, JawLeft and JawRight change places.",
    "auto", "yes", "no",
)  # fmt: skip
@options.face_option
@marker_options.marker_options
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
    preset: str,
    **settings: Any,
) -> None:
    """Encode FAP and BAP files, motion capture or captured faces as an FBA stream.

    A face file and a body file together become one stream: captures by their time codes where both have
    them, else from the start on (--sync, --offset). Ranges fit the data. A value that no range can carry is
    an error; --clamp limits it to the codable range. With --epf, only what that file says is written, and no
    mark unless you ask for one.
    """
    if epf is not None:
        _refuse_beside_epf()
    check_clip(clip, inputs, format)
    page = _report_file(report)
    written = [Output("--output", output), *([Output("--report", page)] if page is not None else [])]
    saved = [] if map_out is None else [Output("--map-out", map_out, True)]
    sounds = voice.check_audio(audio, audio_offset, output)
    read = [*inputs, epf, audio, *(each for each in maps if isinstance(each, Path))]
    outputs = Outputs([*written, *saved, *sounds], read, no_clobber=no_clobber)
    captures = [path for path in inputs if has_skeleton(path, format)]
    marked = [path for path in inputs if has_markers(path, format)]
    typed = {name: f"--{name.replace('_', '-')}" for name in CAPTURE if not _is_left_open(name)}
    check_capture_options(typed, inputs, format)
    if map_out is not None and not (captures or marked):
        raise click.UsageError("--map-out goes with motion capture: joints of a body, or markers on a face")
    if (maps or map_out is not None) and captures and marked:
        raise click.UsageError("--map and --map-out go with one capture; encode face and body by themselves")
    joints = places = None
    if marked:
        places = marker_options.read_places(maps, marked, format, limit)
    else:
        joints = joint_options.read_joints(maps, captures, format, clip, limit)
    capture = {option: settings.pop(option) for option in CAPTURE} | {"joints": joints, "markers": places}
    if capture["head_path"] is None:
        capture["head_path"] = len(inputs) == 1  # of two files, the other has a body
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
    settings |= {"bap_steps": table, "mark": mark}
    if captures and _is_left_open("origin"):
        animation = bring_near(animation, table, settings["bap_quant"])
    with Progress("encoding", None):
        if epf is not None:
            coded = _encode_as_epf(epf, animation, settings, limit)
        else:
            coded = _encode(animation, settings, preset)
    step_tables.warn_of_coarse_steps(animation, table, coded.bap_quant, captured=bool(captures))
    outputs.write(output, coded.data)
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
            decoded, _ = taken.body_of(_decode(coded.data, bap_steps=table))
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
        figures = _figures(coded, animation)
        if taken.together is not None:
            figures |= together_values(inputs, taken.together)
        if spoken is not None:
            figures |= voice.voice_values(spoken)
        outputs.print_json({"output": str(output), **figures, **used, **said, **limit_values})
        return
    for line in (
        _summary(output, coded, animation),
        *(together_lines(inputs, taken.together) if taken.together is not None else ()),
        *((voice.voice_line(spoken),) if spoken is not None else ()),
        *clamped_lines(coded.clamped),
        *(line for one in reports if detailed for line in capture_report.report_lines(one)),
        *capture_report.limit_lines(limit_values),
    ):
        outputs.say(line)
    step_tables.remind(output, animation, table, coded.bap_quant, marked=mark)


def _is_left_open(option: str) -> bool:
    """Whether an option has its default value because nobody gave it."""
    source = click.get_current_context().get_parameter_source(option)
    return source is click.core.ParameterSource.DEFAULT


def _report_file(report: str | None) -> Path | None:
    """Return the file of `--report`, or None."""
    if not report:
        return None
    path = Path(report)
    if path.suffix not in capture_report.SUFFIXES:
        raise click.UsageError(f"--report={report}: a report is a page, .html, or a picture, .png")
    return path


class _Encoded(NamedTuple):
    """A stream, and what it took.

    clamped: parameters with values that no plane could carry, by label. bap_quant: the largest of any plane;
    0 if BAPs are unquantised.
    """

    data: bytes
    planes: int
    intra_planes: int
    clamped: dict[str, ClampedParameter]
    bap_quant: int

    @property
    def clamped_count(self) -> int:
        return sum(one.count for one in self.clamped.values())


def _encode(animation: Animation, settings: Mapping[str, Any], preset: str) -> _Encoded:
    """Return the stream of an animation. settings: fields of EncoderOptions."""
    from fba.codec import EncoderOptions, encode_with_statistics

    options = EncoderOptions(**settings)
    if preset == "reference":
        data, statistics = encode_with_statistics(animation, options)
    else:
        from fba.planning import encode_planned

        data, statistics = encode_planned(animation, options, preset=preset)
    return _Encoded(
        data,
        statistics.planes,
        statistics.intra_planes,
        statistics.clamped_parameters,
        settings["bap_quant"],
    )


def _decode(data: bytes, bap_steps: str) -> Animation:
    from fba.codec import decode

    return decode(data, bap_steps=bap_steps)


def _encode_as_epf(epf: Path, animation: Animation, settings: Mapping[str, Any], limits: Limits) -> _Encoded:
    """Return the stream of an animation, coded plane by plane as an EPF file says."""
    from fba.codec import encode_planes, write_mark
    from fba.formats.epf.epf import read_epf

    with input_file(epf) as file:
        planes = read_epf(file, limits=limits)
    table = settings["bap_steps"]
    data = encode_planes(animation, planes, bap_steps=table)
    quant = max((plane.body.quant for plane in planes if plane.body is not None), default=0)
    if settings["mark"] and quant:
        data += write_mark(table)
    return _Encoded(data, len(planes), sum(plane.intra for plane in planes), {}, quant)


def _refuse_beside_epf() -> None:
    """Raise click.UsageError for an option that the EPF file replaces."""
    context = click.get_current_context()
    own = (
        "fap_quant",
        "bap_quant",
        "intra_period",
        "start_codes",
        "time_codes",
        "preset",
        "unsent",
        "gender",
        "clamp",
    )
    for parameter in context.command.params:
        origin = context.get_parameter_source(parameter.name or "")
        if parameter.name in own and origin is click.core.ParameterSource.COMMANDLINE:
            raise click.UsageError(
                f"{parameter.opts[0]} and --epf contradict each other: the EPF file says how planes are coded"
            )


def _bits_per_second(coded: _Encoded, animation: Animation) -> float:
    return 8 * len(coded.data) / float(animation.duration)


def _figures(coded: _Encoded, animation: Animation) -> dict[str, Any]:
    return {
        "size": len(coded.data),
        "frames": coded.planes,
        "intra_planes": coded.intra_planes,
        "rate": str(animation.rate),
        "duration": float(animation.duration),
        "bits_per_second": round(_bits_per_second(coded, animation), 3),
        "clamped": coded.clamped_count,
        "clamped_parameters": clamped_values(coded.clamped),
    }


def _summary(output: Path, coded: _Encoded, animation: Animation) -> str:
    text = (
        f"{display_name(output)}: {coded.planes} frames, {seconds_text(animation.duration)} at "
        f"{rate_text(animation.rate)} frames/s, {len(coded.data)} bytes, "
        f"{_bits_per_second(coded, animation) / 1000:.2f} kbit/s, "
        f"{coded.intra_planes} I plane{'s' if coded.intra_planes != 1 else ''}"
    )
    count = coded.clamped_count
    return f"{text}; {count} value{'s' if count != 1 else ''} clamped" if count else text
