"""`fba decode`: FBA streams to FAP, BAP and EPF files, and to files that other programs open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from fba.animation import Animation
from fba.cli import options, step_tables, writer_options
from fba.cli.command import Command, EachFile, as_typed, examples
from fba.cli.inputs import Reading, input_file, read_model, read_stream, warn_of_turned_legs
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import (
    STANDARD,
    TEXT_FORMATS,
    Output,
    Outputs,
    OutputType,
    display_name,
    find_writer,
    further_output_option,
)
from fba.cli.printing import Progress
from fba.parameters import BAP_STEPS_AUTO, BapTable

if TYPE_CHECKING:
    from fba.animation import FaceTrack
    from fba.codec import PlaneSettings
    from fba.formats import Format

_CHUNK_BYTES = 1 << 16
"""Bytes that are decoded at once."""
_SETTINGS_BYTES = 300
"""Memory of the settings of a plane."""
_FOLDER_OR_FILE = OutputType(folders=True)


@dataclass(frozen=True)
class _Target:
    """A file, or a folder, to write to. suffix: of files in a folder. writing: the format; None for EPF."""

    flag: str
    place: Path
    suffix: str
    writing: Format | None

    @property
    def folder(self) -> bool:
        """Whether each stream becomes a file in a folder."""
        return self.place != STANDARD and self.place.is_dir()

    def file(self, source: Path) -> Path:
        """Return the file for the content of a stream."""
        return self.place / f"{_name(source)}{self.suffix}" if self.folder else self.place

    def output(self, source: Path) -> Output:
        """Return the output for the content of a stream."""
        text = self.writing is None or self.writing.name in TEXT_FORMATS
        return Output(self.flag, self.file(source), text, source if self.folder else None)


@dataclass(frozen=True, kw_only=True)
class _Writing:
    """The files or folders to write, and how."""

    fap: Path | None = option(
        type=_FOLDER_OR_FILE,
        metavar="OUT.fap",
        help="File for the FAPs; a folder if there are several inputs.",
    )
    bap: Path | None = option(type=_FOLDER_OR_FILE, metavar="OUT.bap", help="File for the BAPs, or a folder.")
    epf: Path | None = option(
        type=_FOLDER_OR_FILE,
        metavar="OUT.epf",
        help="File for the settings of the planes, for fba encode --epf, or a folder.",
    )
    output: Path | None = option(
        "-o", "--output", type=_FOLDER_OR_FILE, metavar="OUT.bvh|OUT.glb|OUT.csv",
        help="File for other programs, in the format of its suffix, or a folder with --to.",
    )  # fmt: skip
    to: str | None = options.to_option
    visemes: Path | None = further_output_option(
        "OUT.json|.TextGrid",
        "File for the visemes (FAP 1) with their times: JSON, or TextGrid for Praat and others.",
    )
    shown: bool = option(
        default=False,
        help="Write what a face shows, as low-level FAPs: also those that a player derives from others, or "
        "that the face of --model gives.",
    )
    no_clobber: bool = options.no_clobber_option
    options: writer_options.WriterOptions

    def targets(self) -> list[_Target]:
        """Return all files to write; click.UsageError without files, and for options that fit no file."""
        targets = []
        for name in ("fap", "bap", "epf"):
            place = getattr(self, name)
            if place is not None:
                writing = None if name == "epf" else find_writer(place, name)
                targets.append(_Target(f"--{name}", place, f".{name}", writing))
        output, to = self.output, self.to
        if output is not None:
            if output != STANDARD and output.is_dir() and to is None:
                raise click.UsageError(f"{output} is a folder; name the format with --to, as in --to bvh")
            writing = find_writer(output, to)
            if writing.name == "fba":
                others = as_typed("fba convert and fba encode")
                raise click.UsageError(f"{output}: streams are decoded here; {others} write them")
            targets.append(_Target("--output", output, writing.suffixes[0], writing))
        else:
            lonely = [writer_options.flag(name) for name in self.options.given]
            if to is not None or lonely:
                raise click.UsageError(
                    f"{', '.join(lonely) or '--to'} says how to write --output; give that too"
                )
        if not targets and self.visemes is None:
            raise click.UsageError("say what to write: --fap, --bap, --epf, --visemes, --output")
        return targets

    def takes_model(self) -> bool:
        """Whether the writer of `--output` takes a face. Raises where `find_writer` does."""
        if self.output is None or (self.to is None and self.output.is_dir()):
            return False  # `targets` raises the error
        return "model" in find_writer(self.output, self.to).write_options


@dataclass(frozen=True, eq=False)
class _Decoding:
    """How each stream is decoded and written.

    settings: for the writer of `--output`. shows: returns the FAPs that a face shows, to be written; None for
    the FAPs that are sent. visemes: the file for FAP 1.
    """

    targets: list[_Target]
    outputs: Outputs
    settings: dict[str, Any]
    reading: Reading
    shows: Callable[[FaceTrack], FaceTrack] | None
    visemes: Path | None = None

    def decode(self, path: Path) -> dict[str, Any]:
        """Decode a stream to its files; return a report."""
        from fba.codec import marked_table
        from fba.formats.epf.epf import write_epf

        asked = self.reading.bap_steps
        with input_file(path) as file:
            data = read_stream(file, self.reading)
        writings = [target.writing for target in self.targets]
        with_body = any(each is not None and "body" in each.carries for each in writings)
        table = step_tables.table_to_read(path, data, asked, self.reading.limit, shown=with_body)
        animation, planes = _read(data, _name(path), None in writings, table, self.reading)
        if asked != BAP_STEPS_AUTO:
            step_tables.warn_of_doubt(path, animation, table, marked_table(data))
        if with_body and "axes" not in self.settings:
            warn_of_turned_legs(path, animation)
        visemes = None if self.visemes is None else _visemes(path, animation, self.visemes)
        if self.shows is not None and animation.face is not None:
            animation = replace(animation, face=self.shows(animation.face))
        parts = {"face": "FAPs", "body": "BAPs"}
        for target in self.targets:
            carried = parts if target.writing is None else target.writing.carries
            if all(getattr(animation, part) is None for part in carried):
                lacking = " or ".join(parts[part] for part in carried)
                raise click.UsageError(f"{path} carries no {lacking}; leave {target.flag} out")
        written = []
        for target in self.targets:
            place = target.file(path)
            if target.writing is None:
                with self.outputs.file(place) as file:
                    write_epf(file, planes)
            elif target.flag == "--output":
                self.outputs.write_animation(place, animation, target.writing, **self.settings)
            else:  # --fap and --bap name the part, so that no warning tells of the other
                part = _only(animation, target.writing.carries)
                self.outputs.write_animation(place, part, target.writing)
            written.append(str(place))
        if visemes is not None and self.visemes is not None:
            self.outputs.write(self.visemes, visemes.encode())
            written.append(str(self.visemes))
        return {"input": str(path), "frames": len(animation), "rate": str(animation.rate), "written": written}


@click.command(
    cls=Command,
    epilog=examples(
        "fba decode talk.fba --fap decoded.fap",
        "fba decode both.fba --fap face.fap --bap body.bap",
        "fba decode talk.fba --fap decoded.fap --epf talk.epf    # encode --epf makes the same bytes again",
        "fba decode both.fba -o person.glb",
        "fba decode walk.fba -o walk.bvh --joints moving",
        "fba decode talk.fba -o talk.csv",
        "fba decode talk.fba -o talk.vrma",
        "fba decode talk.fba --visemes talk.TextGrid",
        "fba decode talk.fba --fap - | less",
        "fba decode archive/*.fba --fap decoded/",
        "fba decode archive/*.fba -o decoded/ --to glb",
    ),
)
@click.argument("inputs", metavar="IN.fba...", nargs=-1, required=True, type=options.EXISTING)
@with_options
def command(
    inputs: tuple[Path, ...],
    writing: _Writing,
    reading: Reading = group("bap_steps", "salvage", "limit", "track"),
    as_json: bool = options.json_option,
) -> None:
    """Decode FBA streams: to ASCII FAP and BAP files, to EPF files with the settings of their planes, and to
    BVH, glTF and tables of blendshapes (CSV) for other programs.

    One of the files can be -, standard output.
    """
    face = writing.options.model if writing.shown else None
    if face is not None and not writing.takes_model():  # --shown alone uses it
        writing = replace(writing, options=replace(writing.options, model=None))
    targets = writing.targets()
    several = len(inputs) > 1
    for target in targets:
        if several and not target.folder:
            raise click.UsageError(
                f"several inputs need a folder for {target.flag}, and {target.place} is not a folder"
            )
    listed = [target.output(path) for target in targets for path in inputs]
    if writing.visemes is not None:
        if several:
            raise click.UsageError("--visemes takes one stream at a time; give one input")
        listed.append(Output("--visemes", writing.visemes, text=True))
    outputs = Outputs(
        listed, [*inputs, face, writing.options.model, writing.options.body], no_clobber=writing.no_clobber
    )
    written_as = targets[-1].writing if targets else None
    settings: dict[str, Any] = {}
    if writing.output is not None and written_as is not None:
        settings = writer_options.settings(writing.output, written_as, writing.options)
    decoding = _Decoding(
        targets, outputs, settings, reading, _shows(face) if writing.shown else None, writing.visemes
    )
    reports = []
    each = EachFile(inputs)
    with Progress("decoding", len(inputs)) as step:
        for path in inputs:
            with each.file(path):
                reports.append(decoding.decode(path))
            step.advance()
    if as_json:
        outputs.print_json(reports if several else reports[0])
    else:
        for report in reports:
            written = ", ".join(display_name(Path(name)) for name in report["written"])
            outputs.say(f"{report['input']}: {report['frames']} frames to {written}")
    each.finish()


def _shows(model: Path | None) -> Callable[[FaceTrack], FaceTrack]:
    """Return the function from sent FAPs to those that a face shows, by default the built-in head."""
    from fba.face import shown_faps

    face = read_model(model)
    return lambda track: shown_faps(track, face)


def _visemes(path: Path, animation: Animation, output: Path) -> str:
    """Return the file of the visemes that a stream sends."""
    from fba.speech import format_visemes, read_shapes

    shapes = read_shapes(animation)
    if not shapes:
        raise click.UsageError(f"{path} sends no visemes (FAP 1); leave --visemes out")
    return format_visemes(shapes, "textgrid" if output.suffix.lower() == ".textgrid" else "json")


def _name(source: Path) -> str:
    """Return the name of the content of a stream."""
    return "stdin" if source == STANDARD else source.stem


def _only(animation: Animation, parts: tuple[str, ...]) -> Animation:
    face, body = animation.face if "face" in parts else None, animation.body if "body" in parts else None
    return replace(animation, face=face, body=body)


def _read(
    data: bytes, name: str, with_settings: bool, table: BapTable, reading: Reading
) -> tuple[Animation, list[PlaneSettings]]:
    """Return the animation, and with_settings: the settings of its planes. table: of BAP steps."""
    from fba.codec import Decoder, decode

    on_error: Literal["raise", "salvage"] = "salvage" if reading.salvage else "raise"
    animation = replace(decode(data, bap_steps=table, on_error=on_error, limits=reading.limit), name=name)
    if not with_settings:
        return animation, []
    decoder = Decoder(bap_steps=table, on_error=on_error, limits=reading.limit)
    settings: list[PlaneSettings] = []
    for start in range(0, len(data), _CHUNK_BYTES):
        frames = decoder.push(data[start : start + _CHUNK_BYTES])
        settings += [frame.plane.settings for frame in frames if frame.plane is not None]
        reading.limit.check_bytes(len(settings) * _SETTINGS_BYTES, "the list of planes", source=len(data))
    settings += [frame.plane.settings for frame in decoder.finish() if frame.plane is not None]
    return animation, settings
