"""Options that several subcommands share, and what they all do with files and output."""

from __future__ import annotations

import json
import math
import os
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from fba.animation import Animation
from fba.cli import step_tables
from fba.cli.program import as_typed
from fba.errors import FbaError, FbaWarning, FormatError, OptionError, Remedy

if TYPE_CHECKING:
    from fba.codec.stream_info import StreamInfo
    from fba.face.model import FaceModel
    from fba.formats.registry import Format

Decorated = TypeVar("Decorated", bound=Callable[..., Any])

NAMES_OF_STANDARD_INPUT = ("-", "/dev/stdin", "/dev/fd/0", "/proc/self/fd/0")


class InputType(click.Path):
    """An existing file, "-" for standard input."""

    def __init__(self) -> None:
        super().__init__(exists=True, dir_okay=False, allow_dash=True, path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Path:
        if str(value) in NAMES_OF_STANDARD_INPUT:
            return Path("-")
        found = Path(os.fsdecode(super().convert(value, param, ctx)))
        return found if str(found) != "-" else found.absolute()  # it was "./-", a file of that name


EXISTING = InputType()
RATES = (Fraction(1, 3600), Fraction(10_000))
"""Frames a second that make sense to ask for; what BVH files are read with."""
STANDARD_INPUT = "standard input"


class Command(click.Command):
    """A subcommand: takes --debug anywhere, and its help shows commands as the user types them here."""

    def __init__(self, *arguments: Any, **settings: Any) -> None:
        super().__init__(*arguments, **settings)
        about = "Show tracebacks of errors."
        self.params.append(click.Option(["--debug"], is_flag=True, expose_value=False, help=about))

    def get_help(self, ctx: click.Context) -> str:
        return as_typed(super().get_help(ctx), ctx)

    def invoke(self, ctx: click.Context) -> Any:
        try:
            return super().invoke(ctx)
        except FbaError as error:
            error.remedies = in_options(error.remedies, ctx)
            raise


class Group(Command, click.Group):
    """Several subcommands under one name."""

    command_class = Command


OPTIONS = {
    "fps": "fps",
    "rate": "fps",
    "format": "format",
    "salvage": "salvage",
    "clamp": "clamp",
    "points": "points",
    "kind": "kind",
    "replace": "replace",
}
"""Arguments of the library, and the names of the parameters of commands that do the same."""
OTHERS = (("encode",), ("convert",), ("model", "import"))
"""Commands that may have an option which the current one lacks."""


def in_options(remedies: Iterable[Remedy], context: click.Context) -> tuple[Remedy, ...]:
    """The remedies with options in place of arguments: of this command, else of another, else as Python."""
    return tuple(Remedy("", _in_option(remedy, context), "") for remedy in remedies)


def described(error: FbaError | FbaWarning) -> str:
    """The text of an error or a warning in the words of the command that runs now."""
    context = click.get_current_context(silent=True)
    if context is None:
        return str(error)
    return "; ".join([error.finding, *map(str, in_options(error.remedies, context))])


def _in_option(remedy: Remedy, context: click.Context) -> str:
    if not remedy.argument:
        return remedy.text  # was translated before
    name = OPTIONS.get(remedy.argument)
    if remedy.call == "fba.write" and name == "format":
        name = "to"
    given = _option(context.command, name, remedy.value)
    if given is not None:
        return remedy.fill_in(given)
    for words in OTHERS if name is not None else ():
        command: click.Command | None = context.find_root().command
        for word in words:
            assert isinstance(command, click.Group)
            command = command.get_command(context, word)
        given = None if command is None else _option(command, name, remedy.value)
        if given is not None:
            return remedy.fill_in(f"{given} of `fba {' '.join(words)}`")
    call = remedy.call or "fba.read"
    python = f"{call}(FILE, {remedy.argument}={remedy.value})"
    return f"{remedy.fill_in(python)} in Python; the command line has no option for it"


def _option(command: click.Command, name: str | None, value: str) -> str | None:
    """How an option is written with a value, "--fps 25"; None where the command does not have it."""
    for param in command.params:
        if isinstance(param, click.Option) and param.name == name:
            return param.opts[0] if param.is_flag else f"{param.opts[0]} {value.strip(chr(39))}"
    return None


class RateType(click.ParamType[Fraction]):
    """A frame rate: 25, 29.97, 30000/1001."""

    name = "rate"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Fraction:
        from fba.formats.text.frame_rates import parse_rate

        low, high = RATES
        try:
            rate = parse_rate(value)
        except ValueError as error:
            self.fail(f"{error}; it may be {low} to {high}", param, ctx)
        if not low <= rate <= high:
            self.fail(f"{value} frames/s are out of reach: a frame rate may be {low} to {high}", param, ctx)
        return rate


class PeriodType(click.ParamType[Fraction]):
    """A positive number of seconds."""

    name = "seconds"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Fraction:
        try:
            seconds = Fraction(value)
        except (ValueError, ZeroDivisionError):
            self.fail(f"{value!r} is not a number of seconds", param, ctx)
        if seconds <= 0:
            self.fail(f"{value} is not positive", param, ctx)
        return seconds


class MomentType(click.ParamType[float]):
    """A time in an animation, in seconds; it may be negative."""

    name = "seconds"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        try:
            seconds = float(value)
        except ValueError:
            seconds = math.nan
        if not math.isfinite(seconds):
            self.fail(f"{value!r} is not a number of seconds", param, ctx)
        return seconds


class SizeType(click.ParamType[tuple[int, int]]):
    """Width and height in pixels: 1280x720."""

    name = "size"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[int, int]:
        width, _, height = str(value).lower().partition("x")
        if not (width.isdecimal() and height.isdecimal()) or not (0 < int(width) <= 16384 > int(height) > 0):
            self.fail(f"{value!r} is not a size; write e.g. 1280x720", param, ctx)
        return int(width), int(height)


def from_option(command: Decorated) -> Decorated:
    return click.option(
        "--from",
        "format",
        metavar="FORMAT",
        help="Input format, if neither content nor suffix shows it: fap, bap, fba, bvh, gltf.",
    )(command)


def fps_option(text: str) -> Callable[[Decorated], Decorated]:
    return click.option("--fps", type=RateType(), metavar="RATE", help=text)


def bap_steps_option(command: Decorated) -> Decorated:
    return click.option(
        "--bap-steps",
        type=click.Choice(["iso", "visage"]),
        default="iso",
        show_default=True,
        help="Table of BAP quantiser steps: the standard's, or one vendor's. Streams do not say which.",
    )(command)


def model_option(command: Decorated) -> Decorated:
    return click.option(
        "--model",
        type=click.Path(exists=True, path_type=Path),
        metavar="FILE",
        help="The face: a .glb of this project, or another that can be imported. Default: the built-in head.",
    )(command)


def body_option(command: Decorated) -> Decorated:
    return click.option(
        "--body",
        type=click.Path(exists=True, dir_okay=False, path_type=Path),
        metavar="FILE.glb",
        help="The body. Default: the built-in person.",
    )(command)


def read_model(path: Path | None) -> FaceModel | None:
    """The face of `--model`, or None for the built-in one."""
    if path is None:
        return None
    from fba.face.importers import import_model

    return import_model(path)


def camera_option(command: Decorated) -> Decorated:
    return click.option(
        "--camera",
        type=click.Choice(["front", "three-quarter", "profile", "body"]),
        help="Default: one that suits the content.",
    )(command)


def view_option(command: Decorated) -> Decorated:
    return click.option(
        "--view",
        type=click.Choice(["figure", "points"]),
        default="figure",
        show_default=True,
        help="A person, or the face as its feature points and the body as its bones.",
    )(command)


class ShowType(click.ParamType[tuple[str, Any]]):
    """A switch of the player: wireframe, influence=open_jaw, shadows=off."""

    name = "switch"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, Any]:
        from fba_player.view.switches import parse_switch

        try:
            return parse_switch(str(value))
        except ValueError as error:
            self.fail(str(error), param, ctx)


def show_option(command: Decorated) -> Decorated:
    """`--show` as `shows`: names and values for `Scene.show`."""
    return click.option(
        "--show",
        "shows",
        type=ShowType(),
        multiple=True,
        metavar="SWITCH[=VALUE]",
        help="Repeatable: wireframe, points, influence=FAP, skeleton[=only], grid, normals; shadows=off, "
        "eyes=off, teeth=off, hair=off; background=grey or transparent.",
    )(command)


def axes_option(command: Decorated) -> Decorated:
    return click.option(
        "--axes",
        type=click.Choice(["iso", "vreng"]),
        default="iso",
        show_default=True,
        help="Which way BAPs turn: as the standard says, or as in some old files.",
    )(command)


def json_option(command: Decorated) -> Decorated:
    return click.option("--json", "as_json", is_flag=True, help="Print JSON, for programs.")(command)


def salvage_option(command: Decorated) -> Decorated:
    return click.option(
        "--salvage", is_flag=True, help="Read the undamaged parts of damaged input, and list what was lost."
    )(command)


def examples(*lines: str) -> str:
    """An epilog that shows commands as they are typed."""
    return "Examples:\n\n\b\n" + "\n".join(f"  {line}" for line in lines) + "\n"


def print_json(value: object) -> None:
    click.echo(json.dumps(value, indent=2))


@contextmanager
def input_file(path: Path) -> Iterator[Path]:
    """The file itself, or for "-" a temporary one that holds standard input."""
    if str(path) != "-":
        yield path
        return
    with tempfile.TemporaryDirectory(prefix="fba-") as folder:
        spooled = Path(folder) / "stdin"
        with spooled.open("wb") as file:
            while chunk := sys.stdin.buffer.read(1 << 20):
                file.write(chunk)
        with renamed(spooled, STANDARD_INPUT):
            yield spooled


@contextmanager
def renamed(path: Path, name: str) -> Iterator[None]:
    """Errors and warnings about a temporary file call it by a name that the user knows."""
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
            said = warning.message
            if isinstance(said, FbaWarning):
                said.args = (said.finding.replace(str(path), name),)
            warnings.warn(said, warning.category, stacklevel=3)


def read_input(
    path: Path,
    *,
    bap_steps: str = "iso",
    fps: Fraction | None = None,
    header_fps: Fraction | None = None,
    name: str | None = None,
    salvage: bool = False,
    capture: Mapping[str, object] | None = None,
    said: list[str] | None = None,
    format: str | None = None,
) -> Animation:
    """Read a file of any format, or of the one that `format` names.

    Warns where the BAPs of a stream look wrong with these steps.

    fps resamples what was read, motion capture while it still turns by rotations; it, or header_fps, and name
    stand in for a header that a file lacks. capture: options for the readers of motion capture. said: takes
    the text of that warning.
    """
    from fba.formats import read

    wanted: dict[str, object] = {"bap_steps": bap_steps, "fps": fps or header_fps, "name": name}
    wanted |= {"salvage": salvage or None, "rate": fps, **(capture or {})}
    with input_file(path) as file:
        found = _format_of(file, format)
        taken = {
            key: value for key, value in wanted.items() if value is not None and key in found.read_options
        }
        animation = read(file, format=found.name, **taken)
    if found.name == "fba" and (doubt := step_tables.warn_of_doubt(path, animation, bap_steps)):
        (said if said is not None else []).append(doubt)
    if fps is not None and animation.rate != fps:
        animation = animation.resample(fps)
    return animation


def probed(
    path: Path, *, bap_steps: str, fps: Fraction | None, format: str | None, salvage: bool
) -> StreamInfo:
    """What a file of any format holds; fps: the rate of one that says none."""
    from fba.formats import probe

    found = _format_of(path, format)
    wanted: dict[str, object] = {"fps": fps, "salvage": salvage or None}
    taken = {key: value for key, value in wanted.items() if value is not None and key in found.read_options}
    return probe(path, bap_steps=bap_steps, format=found.name, **({} if found.name == "fba" else taken))


def _format_of(file: Path, format: str | None) -> Format:
    from fba.formats import format_of

    try:
        return format_of(file, format)
    except OptionError as error:
        raise click.BadParameter(str(error), param_hint="--from") from error


class EachFile:
    """Works through files of which some may be bad: their errors name them, and the others go on.

    ::

        each = EachFile(files)
        for path in files:
            with each.file(path):
                ...
        each.finish()
    """

    def __init__(self, files: Sequence[Path]) -> None:
        self._several = len(files) > 1
        self._failed = 0

    @contextmanager
    def file(self, path: Path) -> Iterator[None]:
        """Around all that is done with one file. The error of a lone file is raised on, with its name."""
        name = STANDARD_INPUT if str(path) == "-" else str(path)
        try:
            yield
        except FbaError as error:
            if name not in error.finding:
                error.args = (f"{name}: {error.finding}",)
            if not self._several:
                raise
            self._fail(described(error))
        except click.UsageError as error:
            if not self._several:
                raise
            self._fail(error.message if name in error.message else f"{name}: {error.message}")
        except OSError as error:
            if not self._several:
                raise
            self._fail(f"{name}: {error.strerror or error}")

    def _fail(self, text: str) -> None:
        self._failed += 1
        click.echo(f"fba: error: {as_typed(' '.join(text.split()))}", err=True)

    def finish(self) -> None:
        """Ends the command with exit code 1 where a file failed."""
        if self._failed:
            raise click.exceptions.Exit(1)


@contextmanager
def usage_errors(prefix: str = "") -> Iterator[None]:
    """What is wrong with options, a plain ValueError, is a usage error. prefix: left out of its text."""
    try:
        yield
    except ValueError as error:
        if type(error) is not ValueError:
            raise
        raise click.UsageError(str(error).removeprefix(prefix)) from error


def seconds(value: Fraction | float) -> str:
    return f"{float(value):.2f} s"


def rate_text(rate: Fraction) -> str:
    """25, 30.5, 29.97 for 30000/1001."""
    return f"{float(rate):.3f}".rstrip("0").rstrip(".")


class Progress:
    """Steps of a long job, shown as a bar on standard error where that is a terminal."""

    def __init__(self, label: str, total: int | None) -> None:
        self._label, self._total = label, total
        self._bar: Any = None
        self._task: Any = None

    def __enter__(self) -> Progress:
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.progress import (
                BarColumn,
                MofNCompleteColumn,
                Task,
                TextColumn,
                TimeElapsedColumn,
                TimeRemainingColumn,
            )
            from rich.progress import Progress as Bar
            from rich.text import Text

            class Steps(MofNCompleteColumn):
                def render(self, task: Task) -> Text:
                    return Text() if task.total is None else super().render(task)  # not "0/?"

            class Time(TimeRemainingColumn):
                def render(self, task: Task) -> Text:
                    return TimeElapsedColumn().render(task) if task.total is None else super().render(task)

            columns = (
                TextColumn("{task.description}"),
                BarColumn(),
                Steps(),
                Time(),
            )
            self._bar = Bar(*columns, console=Console(stderr=True), transient=True)
            self._bar.start()
            self._task = self._bar.add_task(self._label, total=self._total)
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, done: int) -> None:
        """That many more steps are done."""
        if self._bar is not None:
            self._bar.update(self._task, advance=done)

    def of(self, done: int, total: int) -> None:
        """So many steps of so many are done."""
        if self._bar is not None:
            self._bar.update(self._task, completed=done, total=total)


def progress(label: str, total: int | None) -> Progress:
    """A progress bar for a `with` statement; call it with the number of steps done.

    Where the total is None, and until `Progress.of` tells it, the bar only moves, with the seconds so far.
    """
    return Progress(label, total)
