"""`fba decode`: FBA streams to FAP, BAP and EPF files, and to files that other programs open."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from fba.animation import Animation
from fba.cli import options, step_tables, writer_options
from fba.cli.command import Command, EachFile, examples
from fba.cli.inputs import EXISTING, input_file, read_model
from fba.cli.outputs import (
    STANDARD,
    TEXT_FORMATS,
    Output,
    Outputs,
    OutputType,
    display_name,
    find_writer,
)
from fba.cli.printing import Progress
from fba.cli.program import as_typed
from fba.limits import Limits
from fba.parameters import BAP_STEPS_AUTO

if TYPE_CHECKING:
    from fba.animation import FaceTrack
    from fba.codec import PlaneSettings
    from fba.formats.registry import Format

_CHUNK = 1 << 16
"""Bytes decoded at once."""
_SETTINGS_BYTES = 300
"""Memory of the settings of a plane."""
_FOLDER_OR_FILE = OutputType(folders=True)


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
        "fba decode talk.fba --fap - | less",
        "fba decode archive/*.fba --fap decoded/",
        "fba decode archive/*.fba -o decoded/ --to glb",
    ),
)
@click.argument("inputs", metavar="IN.fba...", nargs=-1, required=True, type=EXISTING)
@click.option(
    "--fap",
    type=_FOLDER_OR_FILE,
    metavar="OUT.fap",
    help="File for the FAPs; a folder if there are several inputs.",
)
@click.option("--bap", type=_FOLDER_OR_FILE, metavar="OUT.bap", help="File for the BAPs, or a folder.")
@click.option(
    "--epf",
    type=_FOLDER_OR_FILE,
    metavar="OUT.epf",
    help="File for the settings of the planes, for fba encode --epf, or a folder.",
)
@click.option(
    "-o",
    "--output",
    type=_FOLDER_OR_FILE,
    metavar="OUT.bvh|OUT.glb|OUT.csv",
    help="File for other programs, in the format of its suffix, or a folder with --to.",
)
@options.to_option
@click.option(
    "--shown",
    is_flag=True,
    help="Write what a face shows, as low-level FAPs: also those that a player derives from others, or that "
    "the face of --model gives.",
)
@options.no_clobber_option
@writer_options.writer_options
@options.bap_steps_option
@options.salvage_option
@options.limit_option
@options.json_option
def command(
    inputs: tuple[Path, ...],
    fap: Path | None,
    bap: Path | None,
    epf: Path | None,
    output: Path | None,
    to: str | None,
    shown: bool,
    no_clobber: bool,
    bap_steps: str,
    salvage: bool,
    limit: Limits,
    as_json: bool,
    **given: Any,
) -> None:
    """Decode FBA streams: to ASCII FAP and BAP files, to EPF files with the settings of their planes, and to
    BVH, glTF and tables of blendshapes (CSV) for other programs.

    One of the files can be -, standard output.
    """
    face = given["model"] if shown else None
    if face is not None and (output is None or not _takes_model(output, to)):
        given = given | {"model": None}  # it is for --shown alone
    targets = _targets({"--fap": fap, "--bap": bap, "--epf": epf}, output, to, given)
    several = len(inputs) > 1
    for target in targets:
        if several and not target.folder:
            raise click.UsageError(
                f"several inputs need a folder for {target.flag}, and {target.place} is not a folder"
            )
    outputs = Outputs(
        [target.output(path) for target in targets for path in inputs],
        [*inputs, face, given["model"], given["body"]],
        no_clobber=no_clobber,
    )
    written_as = targets[-1].writing
    settings: dict[str, Any] = {}
    if output is not None and written_as is not None:
        settings = writer_options.settings(output, written_as, given)
    shows = _shows(face) if shown else None
    reports = []
    each = EachFile(inputs)
    with Progress("decoding", len(inputs)) as step:
        for path in inputs:
            with each.file(path):
                reports.append(
                    _decode(
                        path,
                        targets,
                        outputs,
                        settings,
                        bap_steps=bap_steps,
                        salvage=salvage,
                        shows=shows,
                        limits=limit,
                    )
                )
            step.advance()
    if as_json:
        outputs.print_json(reports if several else reports[0])
    else:
        for report in reports:
            written = ", ".join(display_name(Path(name)) for name in report["written"])
            outputs.say(f"{report['input']}: {report['frames']} frames to {written}")
    each.finish()


@dataclass(frozen=True)
class _Target:
    """A file or a folder to write to. suffix: of files in a folder. writing: None for EPF."""

    flag: str
    place: Path
    suffix: str
    writing: Format | None

    @property
    def folder(self) -> bool:
        """Whether each stream becomes a file in a folder."""
        return self.place != STANDARD and self.place.is_dir()

    def file(self, source: Path) -> Path:
        """Return the file that the content of a stream is written to."""
        return self.place / f"{_name(source)}{self.suffix}" if self.folder else self.place

    def output(self, source: Path) -> Output:
        """Return that file, to be checked."""
        text = self.writing is None or self.writing.name in TEXT_FORMATS
        return Output(self.flag, self.file(source), text, source if self.folder else None)


def _targets(
    by_flag: dict[str, Path | None], output: Path | None, to: str | None, given: dict[str, Any]
) -> list[_Target]:
    """Return all files to write; click.UsageError without files, or for options that fit no file."""
    targets = []
    for flag, place in by_flag.items():
        if place is not None:
            name = flag.removeprefix("--")
            writing = None if name == "epf" else find_writer(place, name)
            targets.append(_Target(flag, place, f".{name}", writing))
    if output is not None:
        if output != STANDARD and output.is_dir() and to is None:
            raise click.UsageError(f"{output} is a folder; name the format with --to, as in --to bvh")
        writing = find_writer(output, to)
        if writing.name == "fba":
            others = as_typed("fba convert and fba encode")
            raise click.UsageError(f"{output}: streams are decoded here; {others} write them")
        targets.append(_Target("--output", output, writing.suffixes[0], writing))
    else:
        lonely = [writer_options.FLAGS.get(name, "--to") for name in given if given[name] is not None]
        if to is not None or lonely:
            raise click.UsageError(f"{', '.join(lonely) or '--to'} says how to write --output; give that too")
    if not targets:
        raise click.UsageError("say what to write: --fap, --bap, --epf, --output")
    return targets


def _takes_model(output: Path, to: str | None) -> bool:
    """Whether the writer of an output takes a face. As `find_writer`, raises for one that there is not."""
    if to is None and output.is_dir():
        return False  # an error, which is said later
    return "model" in find_writer(output, to).write_options


def _shows(model: Path | None) -> Callable[[FaceTrack], FaceTrack]:
    """Return the function from what a stream sends to what a face shows, by default the built-in one."""
    from fba.face.resolve import shown_faps

    face = read_model(model)
    return lambda track: shown_faps(track, face)


def _name(source: Path) -> str:
    """Return the name of the content of a stream."""
    return "stdin" if source == STANDARD else source.stem


def _decode(
    path: Path,
    targets: list[_Target],
    outputs: Outputs,
    settings: dict[str, Any],
    *,
    bap_steps: str,
    salvage: bool,
    shows: Callable[[FaceTrack], FaceTrack] | None,
    limits: Limits,
) -> dict[str, Any]:
    """Decode a stream to its files; return a report.

    settings: for the writer of `--output`. shows: what a face shows, to write that.
    """
    from fba.codec import marked_table
    from fba.formats import write
    from fba.formats.epf.epf import write_epf

    with input_file(path) as file:
        data = file.read_bytes()
    with_body = any(target.writing is not None and "body" in target.writing.carries for target in targets)
    table = step_tables.table_to_read(path, data, bap_steps, limits, shown=with_body)
    animation, planes = _read(
        data, _name(path), any(t.writing is None for t in targets), table, salvage, limits
    )
    if bap_steps != BAP_STEPS_AUTO:
        step_tables.warn_of_doubt(path, animation, table, marked_table(data))
    if shows is not None and animation.face is not None:
        animation = replace(animation, face=shows(animation.face))
    parts = {"face": "FAPs", "body": "BAPs"}
    for target in targets:
        held = parts if target.writing is None else target.writing.carries
        if all(getattr(animation, part) is None for part in held):
            lacking = " or ".join(parts[part] for part in held)
            raise click.UsageError(f"{path} carries no {lacking}; leave {target.flag} out")
    written = []
    for target in targets:
        place = target.file(path)
        with outputs.file(place) as file:
            if target.writing is None:
                write_epf(file, planes)
            else:
                # --fap and --bap name a part of the stream: only --output may lose one without being told to
                whole = target.flag == "--output"
                part = animation if whole else _only(animation, target.writing.carries)
                write(file, part, format=target.writing.name, **(settings if whole else {}))
        written.append(str(place))
    return {"input": str(path), "frames": len(animation), "rate": str(animation.rate), "written": written}


def _only(animation: Animation, parts: tuple[str, ...]) -> Animation:
    face, body = animation.face if "face" in parts else None, animation.body if "body" in parts else None
    return replace(animation, face=face, body=body)


def _read(
    data: bytes, name: str, with_settings: bool, bap_steps: str, salvage: bool, limits: Limits
) -> tuple[Animation, list[PlaneSettings]]:
    """Return the animation, and if with_settings, how each plane was coded."""
    from fba.codec import Decoder, decode

    on_error: Literal["raise", "salvage"] = "salvage" if salvage else "raise"
    animation = replace(decode(data, bap_steps=bap_steps, on_error=on_error, limits=limits), name=name)
    if not with_settings:
        return animation, []
    decoder = Decoder(bap_steps=bap_steps, on_error=on_error, limits=limits)
    settings: list[PlaneSettings] = []
    for start in range(0, len(data), _CHUNK):
        frames = decoder.push(data[start : start + _CHUNK])
        settings += [frame.plane.settings for frame in frames if frame.plane is not None]
        limits.check_bytes(len(settings) * _SETTINGS_BYTES, "the list of planes", source=len(data))
    settings += [frame.plane.settings for frame in decoder.finish() if frame.plane is not None]
    return animation, settings
