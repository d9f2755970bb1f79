"""Inputs of commands: animations of any format, standard input, models."""

from __future__ import annotations

import sys
import tempfile
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import click

from fba.animation import Animation
from fba.choices import BapTableOrAuto
from fba.cli import options, step_tables
from fba.cli.command import STANDARD_INPUT
from fba.cli.option_fields import option
from fba.errors import FbaError, FbaWarning, FormatError, OptionError, warn
from fba.limits import Limits
from fba.parameters import BAP_STEPS_AUTO, BapTable
from fba.source import read_head

if TYPE_CHECKING:
    from fba.body import BodyModel
    from fba.capture import Captured
    from fba.codec import StreamInfo
    from fba.face import FaceModel
    from fba.formats import Format


@contextmanager
def input_file(path: Path) -> Iterator[Path]:
    """Give the file itself, or for "-" a temporary one that holds standard input."""
    if str(path) != "-":
        yield path
        return
    with spooled(sys.stdin.buffer, STANDARD_INPUT) as file:
        yield file


@contextmanager
def spooled(source: BinaryIO, name: str, head: bytes = b"") -> Iterator[Path]:
    """Give a temporary file with the content of a stream, read to its end.

    name: of the stream, for messages. head: the bytes that were read before.
    """
    with tempfile.TemporaryDirectory(prefix="fba-") as folder:
        path = Path(folder) / "stdin"
        with path.open("wb") as file:
            file.write(head)
            while chunk := source.read(1 << 20):
                file.write(chunk)
        with renamed(path, name):
            yield path


@contextmanager
def renamed(path: Path, name: str) -> Iterator[None]:
    """Name a temporary file in errors and warnings as the user does."""
    try:
        with warnings.catch_warnings(record=True, action="always", category=FbaWarning) as caught:
            yield
    except FbaError as error:
        error.args = (error.finding.replace(str(path), name),)
        if isinstance(error, FormatError) and error.path == str(path):
            error.path = name
        raise
    finally:
        for warning in caught:
            message = warning.message
            if isinstance(message, FbaWarning):
                message.args = (message.finding.replace(str(path), name),)
            warnings.warn(message, warning.category, stacklevel=3)


@dataclass(frozen=True, kw_only=True)
class Reading:
    """How files are read: options that most commands share.

    bap_steps: "auto" prints the table with which a stream is decoded, and why; a table warns if the stream
    names another table or, without a name, if its BAPs look wrong with these steps.
    """

    format: str | None = options.format_option
    source_rate: Fraction | None = option(
        "--source-fps", type=options.RATE, metavar="RATE", help="Frame rate of a file that has none."
    )
    clip: str | None = option(
        metavar="NAME",
        help="Which animation of a glTF file with several, by name or number; `fba info` lists them.",
    )
    bap_steps: BapTableOrAuto = options.read_steps_option
    track: int | None = option(
        type=click.IntRange(1, 0xFFFFFFFF),
        metavar="NUMBER",
        help="Which FBA track of an MP4 file with several; the error for such a file lists them.",
    )
    salvage: bool = option(
        default=False, help="Read the undamaged parts of damaged input, and list what was lost."
    )
    limit: Limits = options.limit_option


@dataclass(frozen=True, eq=False)
class ReadFile:
    """An animation and its file.

    rate: of the file, before it was resampled. captured: a capture with its animation; None for other files.
    stream: the bytes of the FBA stream in the file; None for other files.
    table: of BAP steps, of a stream with a body; else None. doubt: the warning that this table looks wrong,
    or None.
    """

    path: Path
    animation: Animation
    format: Format
    rate: Fraction
    captured: Captured | None = None
    table: BapTable | None = None
    doubt: str | None = None
    stream: bytes | None = None


def read_input(
    path: Path, reading: Reading, *, rate: Fraction | None = None, name: str | None = None
) -> Animation:
    """Return the animation of a file; see `read_file`."""
    return read_file(path, reading, rate=rate, name=name).animation


def read_file(
    path: Path,
    reading: Reading,
    *,
    rate: Fraction | None = None,
    name: str | None = None,
    capture: Mapping[str, object] | None = None,
) -> ReadFile:
    """Return the animation of a file of any format, or of the format that `reading` names.

    rate: to which the animation is resampled, and motion capture before it is retargeted. name: of a file
    without a name. capture: options for the readers of motion capture.
    """
    limits = reading.limit
    table: BapTable | None = None
    marked: BapTable | None = None
    doubt: str | None = None
    data: bytes | None = None
    with input_file(path) as file:
        reader = find_format(file, reading.format)
        if reader.read_stream is not None:
            from fba.codec import marked_table

            data = read_stream(file, reading, reader)
            marked = marked_table(data)
            table = step_tables.table_to_read(path, data, reading.bap_steps, limits)
        given: dict[str, object] = {
            "bap_steps": table,
            "source_rate": reading.source_rate,
            "name": name,
            "salvage": reading.salvage or None,
            "rate": rate,
            "limits": limits,
            "clip": reading.clip,
            "track": reading.track,
            **(capture or {}),
        }
        taken = taken_options(given, reader.read_options)
        captured = reader.read_captured(file, **taken) if reader.is_capture else None
        animation = reader.read(file, **taken) if captured is None else captured.animation
    if animation.body is None:
        table = None
    if table is not None and reading.bap_steps != BAP_STEPS_AUTO:
        doubt = step_tables.warn_of_doubt(path, animation, table, marked)
    read_rate = animation.rate
    if rate is not None and read_rate != rate:
        animation = animation.resample(rate, limits=limits)
    return ReadFile(path, animation, reader, read_rate, captured, table, doubt, data)


def find_in_body(animation: Animation) -> str | None:
    """Return what is odd about a body, and the options that help; None if nothing is."""
    from fba.body.turned_legs import find_turned_legs

    if animation.body is None or (finding := find_turned_legs(animation.body)) is None:
        return None
    return f"{finding} --axes vreng shows it so, fba convert OLD NEW.bap --axes vreng mends it"


def warn_of_turned_legs(name: str | Path, animation: Animation) -> None:
    """Warn if a body bends its knees forward."""
    if finding := find_in_body(animation):
        warn(f"{STANDARD_INPUT if str(name) == '-' else name}: {finding}", stacklevel=2)


def read_stream(file: Path, reading: Reading, reader: Format | None = None) -> bytes:
    """Return the bytes of the FBA stream in a file: of the file itself, or of a track of an MP4 file.

    reader: the format of the file, if that is known. A file of another format is taken for a stream, so that
    its decoder says what is wrong.
    """
    from fba.formats import formats

    by_name = {each.name: each for each in formats()}
    if reader is None:
        reader = by_name["mp4" if by_name["mp4"].sniff(read_head(file), "") else "fba"]
    assert reader.read_stream is not None
    return reader.read_stream(file, track=reading.track, salvage=reading.salvage, limits=reading.limit)


def probe_input(path: Path, reading: Reading) -> StreamInfo:
    """Return the content of a file of any format."""
    from fba.formats import probe

    reader = find_format(path, reading.format)
    given = {
        "source_rate": reading.source_rate,
        "salvage": reading.salvage or None,
        "clip": reading.clip,
        "track": reading.track,
    }
    taken = {} if reader.name == "fba" else taken_options(given, reader.read_options)
    return probe(path, format=reader.name, limits=reading.limit, **taken)


def check_clip(reading: Reading, files: Iterable[Path]) -> None:
    """Raise click.UsageError for `--clip` without a file whose format holds several animations."""
    if reading.clip is None:
        return
    formats = {find_format(file, reading.format) for file in files if str(file) != "-"}
    if formats and all(entry.describe is None for entry in formats):
        names = " and ".join(sorted(entry.name.upper() for entry in formats))
        raise click.UsageError(f"--clip is for glTF, which may hold several animations, not for {names}")


def taken_options(given: Mapping[str, object], known: Iterable[str]) -> dict[str, Any]:
    """Return the given options that are not None and that a reader knows."""
    return {name: value for name, value in given.items() if value is not None and name in known}


def find_format(file: Path, format: str | None) -> Format:
    """Return the format of a file. format: value of `--from`."""
    from fba.formats import format_of

    try:
        return format_of(file, format)
    except OptionError as error:
        raise click.BadParameter(str(error), param_hint="--from") from error


def has_skeleton(path: Path, format: str | None) -> bool:
    """Whether a file holds the motion of a skeleton; False for standard input, which is read only once."""
    return str(path) != "-" and find_format(path, format).read_motion is not None


def has_markers(path: Path, format: str | None) -> bool:
    """Whether a file holds the motion of markers; False for standard input, which is read only once."""
    return str(path) != "-" and find_format(path, format).has_markers


def check_capture_options(given: Mapping[str, str], files: Iterable[Path], reading: Reading) -> None:
    """Raise click.UsageError for options of captures that no reader of the files takes.

    given: the readers' names of the options that were typed, and their flags.
    """
    from fba.formats import formats

    readers = {find_format(file, reading.format) for file in files if str(file) != "-"}
    for name, flag in given.items():
        if readers and not any(name in reader.read_options for reader in readers):
            able = [each.name.upper() for each in formats() if each.is_capture and name in each.read_options]
            takers = " and ".join(filter(None, [", ".join(able[:-1]), *able[-1:]]))
            names = " and ".join(sorted(each.name.upper() for each in readers))
            raise click.UsageError(f"{flag} is for {takers}, not for {names}")


def read_model(path: Path | None, figure: str | None = None) -> FaceModel | None:
    """Return the face of `--model`, else of `--figure`, or None for the built-in head."""
    if path is None:
        if figure is None:
            return None
        from fba import figures

        return figures.face(figure)
    from fba.face.importers import import_model

    return import_model(path)


def read_body(
    path: Path | None, joints: Mapping[str, str] | None = None, figure: str | None = None
) -> BodyModel | None:
    """Return the body of `--body`, else of `--figure`, or None for the built-in person.

    joints: see `from_skeleton`.
    """
    if path is None:
        if figure is None:
            return None
        from fba import figures

        return figures.body(figure)
    from fba.formats.gltf.bodies import import_body

    return import_body(path, joints=joints)
