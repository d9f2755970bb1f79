"""Commands: `--debug`, help, errors in the words of the command line, the words that start the program."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import click

from fba.errors import FbaError, FbaWarning, OptionError, Remedy

Decorated = TypeVar("Decorated", bound=Callable[..., Any])

NAME = "fba"
DEV = "FBA_DEV"
"""Environment variable that `./dev` sets for the commands it starts: its own path, as the user typed it."""
OPTIONS = {name: name for name in (
    "source_rate", "rate", "bit_rate", "buffer", "format", "salvage", "clamp", "points", "kind", "replace",
    "clip", "track", "face", "aspect", "neutral", "sync", "offset", "rest", "up", "scale",
)} | {"limits": "limit", "joints": "maps", "markers": "maps"}  # fmt: skip
"""Parameters of commands, by the arguments of the library that do the same."""
OTHER_COMMANDS = (("encode",), ("convert",), ("model", "import"))
"""Commands that may have an option which the current command lacks."""
STANDARD_INPUT = "standard input"


class Command(click.Command):
    """A subcommand with `--debug`, whose help shows commands as the user types them."""

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
            error.remedies = _as_options(error.remedies, ctx)
            raise


class Group(Command, click.Group):
    """Several subcommands under one name."""

    command_class = Command


def examples(*lines: str) -> str:
    """Return an epilog of the help that shows commands."""
    return "Examples:\n\n\b\n" + "\n".join(f"  {line}" for line in lines) + "\n"


def describe(error: FbaError | FbaWarning) -> str:
    """Return the text of an error or a warning, with the options of the command that runs now."""
    context = click.get_current_context(silent=True)
    if context is None:
        return str(error)
    return "; ".join([error.finding, *map(str, _as_options(error.remedies, context))])


def _as_options(remedies: Iterable[Remedy], context: click.Context) -> tuple[Remedy, ...]:
    """Return remedies that name options, of this command or another, in place of arguments, else Python."""
    return tuple(Remedy("", _remedy_text(remedy, context), "") for remedy in remedies)


def _remedy_text(remedy: Remedy, context: click.Context) -> str:
    if not remedy.argument:
        return remedy.text  # was translated before
    name = OPTIONS.get(remedy.argument)
    if remedy.call == "fba.write" and name == "format":
        name = "to"
    if remedy.call.endswith(".import_body") and not any(
        param.name == "body" for param in context.command.params
    ):
        name = None  # joints of a body that is shown, not of a capture
    option = _option_text(context.command, name, remedy.value)
    if option is not None:
        return remedy.fill_in(option)
    for words in OTHER_COMMANDS if name is not None else ():
        command: click.Command | None = context.find_root().command
        for word in words:
            assert isinstance(command, click.Group)
            command = command.get_command(context, word)
        option = None if command is None else _option_text(command, name, remedy.value)
        if option is not None:
            return remedy.fill_in(f"{option} of `fba {' '.join(words)}`")
    python = f"{remedy.call or 'fba.read'}(FILE, {remedy.argument}={remedy.value})"
    return f"{remedy.fill_in(python)} in Python; the command line has no option for it"


def _option_text(command: click.Command, name: str | None, value: str) -> str | None:
    """Return an option with a value as it is typed, "--fps 25"; None if the command does not have it."""
    for param in command.params:
        if isinstance(param, click.Option) and param.name == name:
            text = value.removeprefix("fba.Limits(").removesuffix(")").strip("'")
            if pair := re.match(r"\{'(.*?)': '(.*?)'", text):  # the first pair of a mapping
                text = "=".join(pair.groups())
            return param.opts[0] if param.is_flag else f"{param.opts[0]} {text}"
    return None


@contextmanager
def usage_errors(prefix: str = "") -> Iterator[None]:
    """Turn a plain ValueError, which options caused, into a usage error. prefix: removed from its text."""
    try:
        yield
    except ValueError as error:
        if type(error) is not ValueError:
            raise
        raise click.UsageError(str(error).removeprefix(prefix)) from error


@contextmanager
def option_errors(prefix: str = "") -> Iterator[None]:
    """Turn an OptionError into a usage error. prefix: put before its text."""
    try:
        yield
    except OptionError as error:
        raise click.UsageError(f"{prefix}{error}") from error


class EachFile:
    """Loop over files that goes on after a bad file, and names the bad ones.

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
        """Print the error of one of several files; raise that of a single file. Both name the file."""
        name = STANDARD_INPUT if str(path) == "-" else str(path)
        try:
            yield
        except (FbaError, click.UsageError, OSError) as error:
            if isinstance(error, FbaError) and name not in error.finding:
                error.args = (f"{name}: {error.finding}",)
            if not self._several:
                raise
            if isinstance(error, FbaError):
                text = describe(error)
            elif isinstance(error, OSError):
                text = f"{name}: {error.strerror or error}"
            else:
                text = error.message if name in error.message else f"{name}: {error.message}"
            self._failed += 1
            click.echo(f"fba: error: {as_typed(' '.join(text.split()))}", err=True)

    def finish(self) -> None:
        """End the command with exit code 1 if a file failed."""
        if self._failed:
            raise click.exceptions.Exit(1)


def program_words() -> str:
    """Return the words that start this program again from the user's folder, quoted for a shell.

    That is "fba" if it is on the PATH, else ".venv/bin/fba", "python3 -m fba" or "./dev fba", as it was
    started.
    """
    dev = os.environ.get(DEV)
    if dev:
        return f"{shlex.quote(dev)} {NAME}"
    if os.path.basename(sys.argv[0]) == "__main__.py":
        return f"{_typed(sys.orig_argv[0])} -m {NAME}"
    return _typed(sys.argv[0])


def with_program(text: str, program: str, commands: Iterable[str]) -> str:
    """Return a text in which every command, such as `fba info FILE`, starts with the words of `program`.

    commands: the names of the subcommands; "fba" before other words stays.
    """
    if program == NAME:
        return text
    mention = rf"(?<![\w./-]){NAME} (?=(?:{'|'.join(commands)})\b)"
    return re.sub(rf"{re.escape(program)} |{mention}", lambda _: f"{program} ", text)


def as_typed(text: str, context: click.Context | None = None) -> str:
    """Return a text with its commands as the user types them, such as `./dev fba info` for `fba info`."""
    root = (context or click.get_current_context()).find_root()
    assert isinstance(root.command, click.Group)
    return with_program(text, root.info_name or NAME, root.command.list_commands(root))


def _typed(path: str) -> str:
    """Return the name of a file alone if the PATH leads to it, else its path."""
    folder, name = os.path.split(path)
    if os.name == "nt":
        name = name.removesuffix(".exe")
    # An installed script gets its whole path, whatever was typed. Links are not followed: the Python of a
    # virtual environment is a link to another Python.
    first = shutil.which(name)
    on_path = first is not None and os.path.abspath(os.path.dirname(first)) == os.path.abspath(folder)
    return name if on_path or not folder else shlex.quote(path)
