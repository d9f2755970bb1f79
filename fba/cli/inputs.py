"""Files that commands read: animations of any format, standard input, models."""

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
from fba.errors import FbaError, FbaWarning, FormatError, OptionError
from fba.limits import Limits
from fba.parameters import BAP_STEPS_AUTO, BapTable
from fba.source import read_whole

if TYPE_CHECKING:
    from fba.body import BodyModel
    from fba.capture import Captured, FaceCapture
    from fba.codec import StreamInfo
    from fba.face import FaceModel
    from fba.formats import Format
    from fba.formats.gltf.bodies import PersonInfo
    from fba.formats.gltf.clips import ClipInfo


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
    """Give a temporary file that holds a stream, read to its end.

    name: of the stream, for messages. head: what was read from it before.
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
    """Give a temporary file a name that the user knows in errors and warnings."""
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", FbaWarning)
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

    bap_steps: "auto" prints which table a stream is decoded with, and why; a table warns if the stream names
    another one or, where it names none, if its BAPs look wrong with these steps.
    """

    format: str | None = options.format_option
    source_rate: Fraction | None = option(
        "--source-fps", type=options.RateType(), metavar="RATE", help="Frame rate of a file that has none."
    )
    clip: str | None = option(
        metavar="NAME",
        help="Which animation of a glTF file with several, by name or number; `fba info` lists them.",
    )
    bap_steps: BapTableOrAuto = options.read_steps_option
    salvage: bool = option(
        default=False, help="Read the undamaged parts of damaged input, and list what was lost."
    )
    limit: Limits = options.limit_option


@dataclass(frozen=True, eq=False)
class ReadFile:
    """An animation, and what else its file says.

    path, format: of the file. rate: of the file, before it was resampled. captured: what a capture was made
    of; None for other files. table: of BAP steps, of a stream with a body; else None. doubt: the warning that
    this table looks wrong; None without.
    """

    path: Path
    animation: Animation
    format: Format
    rate: Fraction
    captured: Captured | None = None
    table: BapTable | None = None
    doubt: str | None = None


def read_input(
    path: Path,
    reading: Reading,
    *,
    rate: Fraction | None = None,
    name: str | None = None,
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
    """Return the animation of a file of any format, or of the one that `reading` names.

    rate: to resample the animation to, and motion capture before it is retargeted. name: of a file that has
    none. capture: options for the readers of motion capture.
    """
    from fba.codec import marked_table

    limits = reading.limit
    table: BapTable | None = None
    marked: BapTable | None = None
    doubt: str | None = None
    with input_file(path) as file:
        reader = _find_format(file, reading.format)
        is_stream = reader.name == "fba"
        if is_stream:
            data = read_whole(file)
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
            **(capture or {}),
        }
        taken = _taken(reader, given)
        captured = reader.read_captured(file, **taken) if reader.is_capture else None
        animation = reader.read(file, **taken) if captured is None else captured.animation
    if animation.body is None:
        table = None
    if table is not None and reading.bap_steps != BAP_STEPS_AUTO:
        doubt = step_tables.warn_of_doubt(path, animation, table, marked)
    read_rate = animation.rate
    if rate is not None and read_rate != rate:
        animation = animation.resample(rate, limits=limits)
    return ReadFile(path, animation, reader, read_rate, captured, table, doubt)


def probe_input(path: Path, reading: Reading, *, face: str | None = None) -> StreamInfo:
    """Return what a file of any format holds. face: the one to read of several."""
    from fba.formats import probe

    reader = _find_format(path, reading.format)
    given = {
        "source_rate": reading.source_rate,
        "salvage": reading.salvage or None,
        "clip": reading.clip,
        "face": face,
    }
    taken = {} if reader.name == "fba" else _taken(reader, given)
    return probe(path, format=reader.name, limits=reading.limit, **taken)


def list_clips(path: Path, format: str | None, limits: Limits) -> tuple[ClipInfo, ...]:
    """Return the animations of a file in a format that holds several; none for other formats."""
    reader = _find_format(path, format)
    return () if reader.list_clips is None else reader.list_clips(path, limits=limits)


def describe_person(path: Path, format: str | None, limits: Limits) -> PersonInfo | None:
    """Return what a file without an animation shows; None for a file with one, or without a person."""
    reader = _find_format(path, format)
    return None if reader.describe_person is None else reader.describe_person(path, limits=limits)


def check_clip(reading: Reading, files: Iterable[Path]) -> None:
    """Raise click.UsageError for `--clip` without a file whose format holds several animations."""
    if reading.clip is None:
        return
    formats = {_find_format(file, reading.format) for file in files if str(file) != "-"}
    if formats and all(entry.list_clips is None for entry in formats):
        names = " and ".join(sorted(entry.name.upper() for entry in formats))
        raise click.UsageError(f"--clip is for glTF, which may hold several animations, not for {names}")


def _taken(reader: Format, options: Mapping[str, object]) -> dict[str, Any]:
    """Return the options that are given and that a reader takes."""
    return {key: value for key, value in options.items() if value is not None and key in reader.read_options}


def _find_format(file: Path, format: str | None) -> Format:
    from fba.formats import format_of

    try:
        return format_of(file, format)
    except OptionError as error:
        raise click.BadParameter(str(error), param_hint="--from") from error


def has_skeleton(path: Path, format: str | None) -> bool:
    """Whether a file holds the motion of a skeleton; False for standard input, which is read only once."""
    return str(path) != "-" and _find_format(path, format).read_motion is not None


def has_markers(path: Path, format: str | None) -> bool:
    """Whether a file holds the motion of markers; False for standard input, which is read only once."""
    return str(path) != "-" and _find_format(path, format).has_markers


def read_face(
    path: Path, reading: Reading, capture: Mapping[str, object] | None = None
) -> tuple[str, FaceCapture] | None:
    """Return the name of the format and the captured face as it is in a file; None for other files.

    capture: further options of the readers of captures.
    """
    reader = _find_format(path, reading.format)
    if reader.read_face is None:
        return None
    given: dict[str, Any] = {"source_rate": reading.source_rate, **(capture or {})}
    taken = {name: given[name] for name in given if name in reader.face_options and given[name] is not None}
    return reader.name, reader.read_face(path, limits=reading.limit, **taken)


def check_capture_options(given: Mapping[str, str], files: Iterable[Path], reading: Reading) -> None:
    """Raise click.UsageError for options of captures that no reader of the files takes.

    given: those that were typed, by the readers' name for them.
    """
    from fba.formats import formats

    readers = {_find_format(file, reading.format) for file in files if str(file) != "-"}
    for name, flag in given.items():
        if readers and not any(name in reader.read_options for reader in readers):
            able = [one.name.upper() for one in formats() if one.is_capture and name in one.read_options]
            takers = " and ".join([*([", ".join(able[:-1])] if able[:-1] else []), *able[-1:]])
            names = " and ".join(sorted(one.name.upper() for one in readers))
            raise click.UsageError(f"{flag} is for {takers}, not for {names}")


def read_model(path: Path | None) -> FaceModel | None:
    """Return the face of `--model`, or None for the built-in one."""
    if path is None:
        return None
    from fba.face.importers import import_model

    return import_model(path)


def read_body(path: Path | None, joints: Mapping[str, str] | None = None) -> BodyModel | None:
    """Return the body of `--body`, or None for the built-in one. joints: see `fba.capture.from_skeleton`."""
    if path is None:
        return None
    from fba.formats.gltf.bodies import import_body

    return import_body(path, joints=joints)
