"""Outputs of commands: files that are checked before the work begins, or standard output.

Every command that writes files lists them in an `Outputs`, which refuses to overwrite what the command reads,
sends the output "-" to standard output, and keeps everything else off it.
"""

from __future__ import annotations

import errno
import json
import os
import stat
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import click

from fba.cli.inputs import renamed
from fba.cli.option_fields import option
from fba.errors import FormatError
from fba.parameters import BapTable

if TYPE_CHECKING:
    from fba.animation import Animation
    from fba.formats import Format

STANDARD = Path("-")
"""Standard output, or standard input."""
NAMES_OF_STANDARD_OUTPUT = ("-", "/dev/stdout", "/dev/fd/1", "/proc/self/fd/1")
TEXT_FORMATS = ("fap", "bap", "epf", "bvh", "livelink")
"""Formats that a terminal can show."""
REFERRING = (".gltf", ".obj", ".mtl", ".fdp", ".xml")
"""Suffixes of text files that name other files, which are read with them."""
MAX_TEXT_BYTES = 1 << 26
"""Most bytes of such a file that are searched for names."""
CHUNK_BYTES = 1 << 20
"""Bytes that are copied at once."""


class OutputType(click.ParamType[Path]):
    """A file to write, "-" for standard output. folders: whether an existing folder is allowed."""

    name = "file"

    def __init__(self, *, folders: bool = False) -> None:
        self._folders = folders

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        text = os.fspath(value)
        if not text:
            self.fail("the name of a file is missing", param, ctx)
        if text in NAMES_OF_STANDARD_OUTPUT:
            return STANDARD
        if os.path.isdir(text):
            if not self._folders:
                self.fail(f"{text} is a folder; give the name of a file to write", param, ctx)
        elif text.endswith(("/", os.sep)):
            self.fail(f"there is no folder {text}; make it first, or leave the slash out", param, ctx)
        # as a path, "./-" would be "-"
        return Path(text) if Path(text) != STANDARD else Path(os.path.abspath(text))


def output_option(metavar: str, text: str, **settings: Any) -> Any:
    """Return `-o`, `--output`. text: its help. settings: as for `option`."""
    return option("-o", "--output", metavar=metavar, type=OutputType(), help=text, **settings)


def further_output_option(metavar: str, text: str, *flags: str) -> Any:
    """Return an option for a file that is written beside the output. text: its help."""
    return option(*flags, metavar=metavar, type=OutputType(), help=text)


@dataclass(frozen=True)
class Output:
    """A file to write.

    option: on the command line, for messages. path: its name, `STANDARD` for standard output. text: whether a
    terminal can show it. source: the input that it is made from, if there are several.
    """

    option: str
    path: Path
    text: bool = False
    source: Path | None = None

    def __str__(self) -> str:
        return f"{self.option} {self.path}"

    @staticmethod
    def of_format(option: str, path: Path, writing: Format) -> Output:
        """Return the output for an animation in a format."""
        return Output(option, path, writing.name in TEXT_FORMATS)

    @property
    def standard(self) -> bool:
        return self.path == STANDARD


class Outputs:
    """The files that a command writes.

    inputs: the files that it reads, `STANDARD` for standard input; None is ignored. no_clobber: do not
    overwrite existing files.

    Raises click.UsageError if an output is an input, also by another name or through a link, or a file that
    an input refers to; if two outputs are one file; if binary data would go to a terminal. Raises FormatError
    if a file cannot be written, or exists and no_clobber is set.
    """

    def __init__(
        self, outputs: Iterable[Output], inputs: Iterable[Path | None] = (), *, no_clobber: bool = False
    ) -> None:
        listed = list(outputs)
        read = [path for path in inputs if path is not None]
        self.standard = any(output.standard for output in listed)
        if read.count(STANDARD) > 1:
            raise click.UsageError("standard input (-) can be read only once")
        for output in listed:
            _check_inputs(output, read)
        _check_each_other(listed)
        for output in listed:
            if output.standard:
                _check_terminal(output)
            else:
                _check_place(output.path, no_clobber=no_clobber)

    def say(self, line: str) -> None:
        """Print a line of a report on standard output, or on standard error if data goes to the former."""
        click.echo(line, err=self.standard)

    def print_json(self, value: object) -> None:
        """Print a report for programs, to the same stream as `say`."""
        self.say(json.dumps(value, indent=2))

    def write(self, path: Path, data: bytes) -> None:
        """Write a whole file, for an output."""
        from fba.atomic import atomic

        with self.file(path) as name, atomic(name) as file:
            file.write(data)

    def write_animation(self, path: Path, animation: Animation, writing: Format, **settings: Any) -> None:
        """Write an animation in a format, for an output. settings: of the writer."""
        from fba.formats import write

        with self.file(path) as file:
            write(file, animation, format=writing.name, **settings)

    def write_stream(
        self, path: Path, data: bytes, animation: Animation, table: BapTable, quant: int = 1, *, marked: bool
    ) -> None:
        """Write the stream of an animation, for an output.

        A stream with a mark goes to a pipe with its table of BAP steps before it, as others may read it while
        it arrives; but not without BAPs, or with unquantised ones, which are the same with every table.
        """
        from fba.codec import write_opening

        if marked and animation.body is not None and quant and _goes_to_pipe(path):
            data = write_opening(table) + data
        self.write(path, data)

    @contextmanager
    def file(self, path: Path, suffix: str = "") -> Iterator[Path]:
        """Give the name of a file to write for an output, for a `with` statement.

        That is the output itself if it is a file. For standard output, a device or a pipe, and for a name
        without the suffix that the writer needs, it is a temporary file, which is copied there at the end.
        """
        if not _is_direct(path) and suffix in ("", path.suffix.lower()):
            yield path
            return
        with tempfile.TemporaryDirectory(prefix="fba-") as folder:
            temporary = Path(folder) / f"animation{suffix}"
            with renamed(temporary, display_name(path)):
                yield temporary
            with temporary.open("rb") as file, _opened(path) as target:
                while chunk := file.read(CHUNK_BYTES):
                    target.write(chunk)


def find_writer(path: Path, to: str | None) -> Format:
    """Return the format to write. to: value of `--to`.

    Raises click.UsageError for standard output without `to`, and as `fba.formats.writer_for` does.
    """
    from fba.formats import writer_for

    if path == STANDARD and to is None:
        raise click.UsageError("name the format for standard output with --to, as in --to fap")
    return writer_for(path, to)


def display_name(path: Path) -> str:
    """Return the name of an output in a report."""
    return "standard output" if path == STANDARD else str(path)


def check_glb(output: Path) -> None:
    """Raise click.UsageError for a suffix that a face model does not have."""
    if output != STANDARD and output.suffix.lower() not in ("", ".glb"):
        name = output.with_suffix(".glb").name
        raise click.UsageError(f"--output {output}: face models are written as glTF; name it {name}")


def _check_inputs(output: Output, inputs: list[Path]) -> None:
    for path in inputs:
        if _same(output.path, path, 0):
            name = "standard input" if path == STANDARD else f"the input {path}"
            both = "" if path == output.path else ", the same file by another name"
            raise click.UsageError(f"{output} would overwrite {name}{both}; choose another name")
    if output.standard or not output.path.is_file():
        return
    for path in inputs:
        if path != STANDARD and path.is_dir() and _within(output.path, path):
            raise click.UsageError(
                f"{output} would overwrite a file of the folder {path}, which is read; choose another name"
            )
        if path != STANDARD and _refers(path, output.path):
            raise click.UsageError(
                f"{output} would overwrite a file that belongs to the input {path}, which names it; "
                "choose another name"
            )


def _check_each_other(outputs: list[Output]) -> None:
    for number, output in enumerate(outputs):
        for other in outputs[:number]:
            if output.standard and other.standard:
                raise click.UsageError(
                    f"{other.option} and {output.option} both go to standard output, which takes one of them"
                )
            if not _same(output.path, other.path, 1):
                continue
            if output.source is not None and output.option == other.option:
                if output.source == other.source:
                    raise click.UsageError(f"{output.source} is given twice")
                raise click.UsageError(
                    f"{other.source} and {output.source} would both become {output.path}; "
                    "write them to two folders, one after the other"
                )
            raise click.UsageError(f"{other} and {output} are the same file; give each a name of its own")


def _check_terminal(output: Output) -> None:
    if sys.stdout is None:
        raise FormatError("standard output is closed; give the name of a file")
    if not output.text and sys.stdout.isatty():
        raise click.UsageError(
            f"{output}: a terminal cannot show this format; give {output.option} FILE, or send it "
            "to another program (|)"
        )


def _check_place(path: Path, *, no_clobber: bool) -> None:
    from fba.atomic import check_target

    target = check_target(path)
    if no_clobber and target.mode is not None and not target.direct:
        raise FormatError(
            "exists already; choose another name, or leave --no-clobber out to overwrite it", path=path
        )


def _state(path: Path, number: int) -> os.stat_result | None:
    """Return the status of a file, or None. number: of the open file that "-" stands for."""
    try:
        return os.fstat(number) if path == STANDARD else os.stat(path)
    except (OSError, ValueError):
        return None


def _same(output: Path, other: Path, standard: int) -> bool:
    """Whether writing to one path would change the other: a file under two names, or the same name.

    standard: 0 if the other is read, 1 if it is written.
    """
    first, second = _state(output, 1), _state(other, standard)
    if first is not None and second is not None:
        # devices such as /dev/null, terminals and the two ends of a socket may be read and written
        named = STANDARD not in (output, other)
        return os.path.samestat(first, second) and (
            stat.S_ISREG(first.st_mode) or (named and stat.S_ISFIFO(first.st_mode))
        )
    if first is not None or second is not None or STANDARD in (output, other):
        return False
    names = [os.path.normcase(os.path.realpath(path)) for path in (output, other)]
    if names[0] == names[1]:
        return True
    return names[0].casefold() == names[1].casefold() and _ignores_case(os.path.dirname(names[0]))


def _ignores_case(folder: str) -> bool:
    """Whether names that differ in their case mean the same file in a folder, as its own name shows."""
    while os.path.basename(folder):
        parent, name = os.path.split(folder)
        if name.swapcase() != name:
            try:
                return os.path.samefile(folder, os.path.join(parent, name.swapcase()))
            except OSError:
                return False
        folder = parent
    return False


def _within(path: Path, folder: Path) -> bool:
    return Path(os.path.realpath(folder)) in Path(os.path.realpath(path)).parents


def _refers(source: Path, output: Path) -> bool:
    """Whether a text file, or a material file that it names, names an existing output in its folder."""
    folder = Path(os.path.realpath(source)).parent
    if source.suffix.lower() not in REFERRING or not _within(output, folder):
        return False
    text = _text(source)
    if _named(output.name, text):
        return True
    materials = (path for path in folder.glob("*.[mM][tT][lL]") if _named(path.name, text))
    return any(_named(output.name, _text(path)) for path in materials)


def _named(name: str, text: bytes) -> bool:
    from urllib.parse import quote

    return os.fsencode(name) in text or quote(name).encode() in text


def _text(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(MAX_TEXT_BYTES)
    except OSError:
        return b""  # its reader says why


def _goes_to_pipe(path: Path) -> bool:
    """Whether others may read an output while it is written: a pipe or a device, but not a file."""
    if path != STANDARD:
        return path.exists() and not path.is_file()
    try:
        return not stat.S_ISREG(os.fstat(sys.stdout.fileno()).st_mode)
    except (OSError, ValueError):
        return True


def _is_direct(path: Path) -> bool:
    """Whether data must go to an existing pipe or device, which no new file can replace."""
    from fba.atomic import check_target

    return path == STANDARD or check_target(path).direct


@contextmanager
def _opened(path: Path) -> Iterator[BinaryIO]:
    from fba.atomic import atomic

    if path == STANDARD:
        yield sys.stdout.buffer
        sys.stdout.buffer.flush()
    elif (pipe := _named_pipe(path)) is not None:
        with pipe:
            yield pipe
    else:
        with atomic(path) as file:
            yield file


def _named_pipe(path: Path) -> BinaryIO | None:
    """Return a named pipe, opened as soon as it has a reader; None for other paths."""
    if not path.is_fifo() or str(path).startswith(("/dev/fd/", "/proc/")):
        return None
    try:
        handle = os.open(path, os.O_WRONLY | os.O_NONBLOCK)
    except OSError as error:
        if error.errno != errno.ENXIO:
            raise
        click.echo(f"fba: waiting for a reader to open {path}", err=True)
        return path.open("wb")
    os.set_blocking(handle, True)
    return os.fdopen(handle, "wb")
