"""`fba convert`: a file of any format to any format with a writer."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Literal

import click

from fba.choices import BapTableOrAuto
from fba.cli import map_options, options, scenes, step_tables, writer_options
from fba.cli.batch import Batch, BatchInput, BatchOutput, convert_folder
from fba.cli.coding.coded_streams import CodedStream, encode_stream
from fba.cli.coding.rate_options import amount_type
from fba.cli.coding.size_options import Size
from fba.cli.command import Command, examples
from fba.cli.inputs import (
    ReadFile,
    Reading,
    check_clip,
    has_markers,
    has_skeleton,
    read_file,
    warn_of_turned_legs,
)
from fba.cli.option_fields import group, option, with_options
from fba.cli.options import is_given
from fba.cli.outputs import Output, Outputs, display_name, find_writer
from fba.cli.recordings.inputs import Inputs
from fba.encoder_options import EncoderOptions
from fba.errors import FormatError
from fba.limits import Limits
from fba.parameters import BAP_STEPS_AUTO, BapTable
from fba.source import naming_file

_DURATION = amount_type("length", {"": 1.0, "s": 1.0, "ms": 0.001}, "2s")


@dataclass(frozen=True, kw_only=True)
class Mp4Options:
    """How an MP4 file is written."""

    fragment: float | None = option(
        type=_DURATION,
        metavar="SECONDS",
        help="MP4: fragments of this length, for streaming, each from an I plane on where there is one.",
    )
    audio_codec: Literal["aac", "opus"] | None = option(
        help="MP4: how the sound is coded; default: AAC and Opus are copied, all else becomes AAC."
    )
    sound: scenes.SoundOptions

    def check(self, name: str) -> None:
        """Raise click.UsageError for options that do not fit a target in the format of this name."""
        scenes.check_sound_options(self.sound)
        for field in ("fragment", "audio_codec", "audio", "no_audio", "audio_offset"):
            if name != "mp4" and is_given(field):
                flag = f"--{field.replace('_', '-')}"
                raise click.UsageError(f"{flag} is for MP4 files, and OUT becomes {name.upper()}")

    def find_sound(self, source: Path) -> Path | None:
        """Return the sound that goes with a file, see `scenes.find_sound`."""
        return scenes.find_sound((source,), self.sound, "written without sound")

    def write(
        self, stream: bytes, source: Path, audio: Path | None, table: BapTable | None, limits: Limits
    ) -> tuple[bytes, str]:
        """Return an MP4 file with a stream and a sound, and words about the sound.

        source: the file of the stream. table: of BAP steps, of a stream that does not name it.
        """
        from fba.carriage.mp4 import write_mp4

        sound, about = None, ""
        if audio is not None:
            from fba_player.sound.coded_sound import read_coded_sound

            sound = read_coded_sound(audio, self.audio_codec)
            coding = {"aac": "AAC", "opus": "Opus"}[sound.coding]
            about = f", with the sound of {audio} as {coding}"
        offset = scenes.find_offset(audio, (source,), self.sound)
        with naming_file(source):
            data = write_mp4(
                stream,
                sound=sound,
                sound_offset=Fraction(offset).limit_denominator(1_000_000),
                fragment=None if self.fragment is None else Fraction(self.fragment).limit_denominator(1000),
                bap_steps=table,
                limits=limits,
            )
        return data, about


@dataclass(frozen=True, kw_only=True)
class Conversion:
    """How a file is converted: the options of the command."""

    rate: Fraction | None = options.rate_option("Resample to this frame rate; default: the input's own.")
    to: str | None = options.to_option
    no_clobber: bool = options.no_clobber_option
    maps: map_options.Maps = map_options.map_option
    given: writer_options.WriterOptions
    mp4: Mp4Options
    mark: bool | None = options.mark_option
    reading: Reading = group(bap_steps=options.written_steps_option)


@click.command(
    cls=Command,
    epilog=examples(
        "fba convert old.fap new.fap          # the canonical form",
        "fba convert walk.bvh walk.bap --fps 30",
        "fba convert talk.fba decoded.fap",
        "fba convert walk.bap walk.bvh --joints moving",
        "fba convert both.fba person.glb --model head.glb",
        "fba convert talk.fba talk.fba.mp4 --audio voice.wav",
        "fba convert talk.fba.mp4 back.fba",
        "fba convert walk.bvh - --to bap | less",
        "fba convert --batch captures/ streams/ --to fba --jobs 4",
    ),
)
@click.argument("source", metavar="IN", type=BatchInput())
@click.argument("target", metavar="OUT", type=BatchOutput())
@with_options
def command(source: Path, target: Path, how: Conversion, batch: Batch) -> None:
    """Convert a file into another format; the content of IN and the suffix of OUT say which.

    - is standard input or output. A stream is written as `fba encode` does without options. Into an MP4 file
    and out of it, a stream goes as it is. With --batch, IN and OUT are folders, --to names the format, and
    OUT/conversions.csv lists what was done.
    """
    if not batch.batch:
        batch.check_alone()
        convert_file(source, target, how)
        return
    if how.mp4.sound.audio is not None:
        raise click.UsageError("--audio goes with one file; with --batch, sounds beside the files are taken")
    convert_folder(source, target, how.to, batch, partial(convert_file, how=how), repr(how))


def convert_file(source: Path, target: Path, how: Conversion) -> None:
    """Convert a file. Its result appears whole or not at all."""
    given, mp4, maps, reading = how.given, how.mp4, how.maps, how.reading
    writing = find_writer(target, how.to)  # raises its errors before anything is read
    mp4.check(writing.name)
    audio = mp4.find_sound(source) if writing.name == "mp4" else None
    read_files = [source, given.model, given.body, audio]
    outputs = Outputs([Output.of_format("OUT", target, writing)], read_files, no_clobber=how.no_clobber)
    captures = [source] if has_skeleton(source, reading.format) else []
    with_markers = has_markers(source, reading.format)
    bodies_map = maps if given.body is not None and not captures and not with_markers else ()
    joints_of_body = map_options.read_body_joints(bodies_map, given.body, reading.limit)
    extra = writer_options.settings(target, writing, given, joints_of_body)
    check_clip(reading, [source])
    if how.mark is not None and writing.name != "fba":
        raise click.UsageError(f"--mark is for streams, and {display_name(target)} becomes none")
    joints = places = None
    if with_markers:
        places = map_options.read_places(maps, [source], reading)
    elif not bodies_map:
        joints = map_options.read_joints(maps, captures, reading)
    read = read_file(source, reading, rate=how.rate, capture={"joints": joints, "markers": places})
    if given.axes is None and "body" in writing.carries:
        warn_of_turned_legs(source, read.animation)
    about = f"{display_name(target)}: {len(read.animation)} frames, {writing.written or writing.description}"
    if writing.name not in ("fba", "mp4"):
        outputs.write_animation(target, read.animation, writing, **extra)
        outputs.say(about)
        return
    if not len(read.animation):
        raise FormatError("the file holds no frames; a stream needs one", path=source)
    marked = how.mark is not False
    asked = None if reading.bap_steps == BAP_STEPS_AUTO else reading.bap_steps
    kept = read.stream if how.rate is None and not reading.salvage else None
    if writing.name == "mp4":
        stream = kept or _encode(read, target, reading.bap_steps, marked=True).data
        data, heard = mp4.write(stream, source, audio, asked, reading.limit)
        outputs.write(target, data)
        outputs.say(about + heard)
    elif kept is not None and read.format.name == "mp4" and how.mark is None and asked in (None, read.table):
        outputs.write(target, kept)
        outputs.say(about)
    else:
        coded = _encode(read, target, reading.bap_steps, marked=marked)
        table = coded.encoded.options.bap_steps
        outputs.write_stream(target, coded.data, read.animation, table, coded.bap_quant, marked=marked)
        outputs.say(about)
        step_tables.remind(target, read.animation, table, marked=marked)


def _encode(read: ReadFile, target: Path, bap_steps: BapTableOrAuto, *, marked: bool) -> CodedStream:
    """Return the content of a file as a stream."""
    animation = read.animation
    taken = Inputs(animation, None, None, (read,), animation.rate != read.rate)
    table = step_tables.table_to_write(bap_steps, made=taken.is_captured, marked=marked, read=read.table)
    step_tables.warn_of_coarse_steps(animation, table)
    with naming_file(target):
        return encode_stream(animation, EncoderOptions(bap_steps=table, mark=marked), Size(), taken)
