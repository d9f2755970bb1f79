"""Files that commands read: animations of any format, standard input, models."""

from __future__ import annotations

import os
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
from fba.cli import step_tables
from fba.cli.command import STANDARD_INPUT
from fba.errors import FbaError, FbaWarning, FormatError, OptionError, did_you_mean
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import BAP_STEPS_AUTO
from fba.source import read_whole

if TYPE_CHECKING:
    from fba.body import BodyModel
    from fba.capture import Captured, FaceCapture
    from fba.codec import StreamInfo
    from fba.face import FaceModel
    from fba.formats import Format
    from fba.formats.gltf.bodies import PersonInfo
    from fba.formats.gltf.clips import ClipInfo

NAMES_OF_STANDARD_INPUT = ("-", "/dev/stdin", "/dev/fd/0", "/proc/self/fd/0")


class ExistingPath(click.Path):
    """A file or folder that exists; the error for one that does not names the nearest that does."""

    def __init__(self, *, file_okay: bool = True, dir_okay: bool = True, allow_dash: bool = False) -> None:
        super().__init__(
            exists=True, file_okay=file_okay, dir_okay=dir_okay, allow_dash=allow_dash, path_type=Path
        )

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        path = Path(os.fsdecode(value))
        if not os.path.lexists(path) and not (self.allow_dash and str(path) == "-"):
            self.fail(f"{str(path)!r} does not exist{did_you_mean(path.name, _neighbours(path))}", param, ctx)
        return Path(os.fsdecode(super().convert(value, param, ctx)))


def _neighbours(path: Path) -> list[str]:
    """Return the names in the folder of a path, none if it cannot be listed."""
    try:
        return os.listdir(path.parent)
    except OSError:
        return []


class InputType(ExistingPath):
    """An existing file, "-" for standard input."""

    def __init__(self) -> None:
        super().__init__(dir_okay=False, allow_dash=True)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        if str(value) in NAMES_OF_STANDARD_INPUT:
            return Path("-")
        path = super().convert(value, param, ctx)
        return path if str(path) != "-" else path.absolute()  # it was "./-", a file of that name


EXISTING = InputType()


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

    format: name of the format; None where content and suffix show it. clip: of several animations in a file,
    the one to read, by name or number; without effect where the format holds one. bap_steps: "auto" prints
    which table a stream is decoded with, and why; a table warns if the stream names another one or, where it
    names none, if its BAPs look wrong with these steps. salvage: read what is undamaged.
    """

    format: str | None = None
    clip: str | None = None
    bap_steps: str = BAP_STEPS_AUTO
    salvage: bool = False
    limit: Limits = DEFAULT_LIMITS


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
    table: str | None = None
    doubt: str | None = None


def read_input(
    path: Path,
    reading: Reading,
    *,
    fps: Fraction | None = None,
    header_fps: Fraction | None = None,
    name: str | None = None,
) -> Animation:
    """Return the animation of a file; see `read_file`."""
    return read_file(path, reading, fps=fps, header_fps=header_fps, name=name).animation


def read_file(
    path: Path,
    reading: Reading,
    *,
    fps: Fraction | None = None,
    header_fps: Fraction | None = None,
    name: str | None = None,
    capture: Mapping[str, object] | None = None,
) -> ReadFile:
    """Return the animation of a file of any format, or of the one that `reading` names.

    fps resamples the animation, and motion capture before it is retargeted. It, or header_fps, and name
    replace a header that a file lacks. capture: options for the readers of motion capture.
    """
    from fba.codec import marked_table

    limits, table = reading.limit, reading.bap_steps
    marked: str | None = None
    doubt: str | None = None
    with input_file(path) as file:
        reader = _find_format(file, reading.format)
        is_stream = reader.name == "fba"
        if is_stream:
            data = read_whole(file)
            marked = marked_table(data)
            table = step_tables.table_to_read(path, data, table, limits)
        options: dict[str, object] = {
            "bap_steps": table,
            "fps": fps or header_fps,
            "name": name,
            "salvage": reading.salvage or None,
            "rate": fps,
            "limits": limits,
            "clip": reading.clip,
            **(capture or {}),
        }
        taken = _taken(reader, options)
        captured = reader.read_captured(file, **taken) if reader.is_capture else None
        animation = reader.read(file, **taken) if captured is None else captured.animation
    has_table = is_stream and animation.body is not None
    if has_table and reading.bap_steps != BAP_STEPS_AUTO:
        doubt = step_tables.warn_of_doubt(path, animation, table, marked)
    rate = animation.rate
    if fps is not None and rate != fps:
        animation = animation.resample(fps, limits=limits)
    return ReadFile(path, animation, reader, rate, captured, table if has_table else None, doubt)


def probe_input(path: Path, reading: Reading, *, fps: Fraction | None, face: str | None = None) -> StreamInfo:
    """Return what a file of any format holds.

    fps: the rate of a file that has none. face: the one to read of several.
    """
    from fba.formats import probe

    reader = _find_format(path, reading.format)
    given = {"fps": fps, "salvage": reading.salvage or None, "clip": reading.clip, "face": face}
    options = {} if reader.name == "fba" else _taken(reader, given)
    return probe(path, format=reader.name, limits=reading.limit, **options)


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
    path: Path, fps: Fraction | None, reading: Reading, capture: Mapping[str, object] | None = None
) -> tuple[str, FaceCapture] | None:
    """Return the name of the format and the captured face as it is in a file; None for other files.

    fps: of a file without times. capture: further options of the readers of captures.
    """
    reader = _find_format(path, reading.format)
    if reader.read_face is None:
        return None
    given: dict[str, Any] = {"fps": fps, **(capture or {})}
    options = {name: given[name] for name in given if name in reader.face_options and given[name] is not None}
    return reader.name, reader.read_face(path, limits=reading.limit, **options)


def check_capture_options(given: Mapping[str, str], files: Iterable[Path], reading: Reading) -> None:
    """Raise click.UsageError for options of captures that no reader of the files takes.

    given: those that were typed, by the readers' name for them.
    """
    from fba.formats import formats

    readers = {_find_format(file, reading.format) for file in files if str(file) != "-"}
    for option, flag in given.items():
        if readers and not any(option in reader.read_options for reader in readers):
            able = [one.name.upper() for one in formats() if one.is_capture and option in one.read_options]
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
    from fba.formats.gltf.bodies import read_body as read

    return read(path, joints=joints)
