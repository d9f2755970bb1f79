"""Entry point of the `fba` command: finds subcommands, turns errors into a line and an exit code."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from typing import Any, NoReturn

import click

from fba import __version__
from fba.cli.command import NAME, Group, describe, examples, program_words, with_program
from fba.cli.interruptions import Interruptions
from fba.cli.startup import INTERRUPTED, TEXT, collect_less
from fba.compiled import compilation_listener
from fba.errors import FbaError, FbaWarning, did_you_mean

_COMMANDS = {
    "info": "Show what a file holds: frames, rate, parameters, bits; --trace lists every syntax element.",
    "encode": "Encode FAP, BAP or motion-capture files as an FBA stream.",
    "capture": "Receive a face or a person over the network, show it, record it as an FBA stream.",
    "send": "Send a stream over a network, or a face to programs that receive Live Link Face.",
    "decode": "Decode FBA streams to FAP, BAP, EPF, BVH and glTF files.",
    "convert": "Convert a file into another format.",
    "play": "Play a file in a window.",
    "export": "Make a page that plays files in any browser, without a network.",
    "serve": "Show files, or a stream while it arrives, in browsers.",
    "render": "Render a file to a picture or a video, without a window.",
    "archive": "Keep many performances in a few Parquet files, draw windows from them, search them.",
    "find": "Find the performance, the frame and the side that the outline of a figure in a picture shows.",
    "verify": "Check FBA streams for damage, and compute digests of their values.",
    "stats": "Show where the bits of FBA streams go.",
    "conformance": "Check this codec, or another program, against test vectors.",
    "bench": "Measure the speed of this codec on a stream.",
    "gait": "Generate a walk by stride and character, or find the steps in one.",
    "speak": "Let a face speak: from a recording, a text, or the timings of other programs.",
    "express": "Show expressions: named ones, mixtures, points of the plane of emotions.",
    "emote": "Play a performance in a mood: angry, surprised, sad, sleepy, happy and others.",
    "emotion": "Read the expressions of a face from any file with FAPs.",
    "markers": "Let captured markers move any head: map them onto it, play, export.",
    "model": "Inspect face models, check them, import, fit and simplify them.",
    "persona": "Learn how an actor moves the face, and play another person's performance so.",
    "demo": "Encode the sample animation, print its size, and play it.",
}
_FOLDERS = {
    "capture": "live.",
    "send": "live.",
    "serve": "live.",
    "archive": "archives.",
    "find": "archives.",
}
"""Subcommands in folders."""

BAD_DATA, BAD_USAGE = 1, 2
"""Exit codes."""
COMPILED_FUNCTIONS = 5
"""Count of functions to be compiled at which the notice is printed; fewer take less than about 2 s."""
COMPILE_SECONDS = {"info": 8, "stats": 5, "decode": 5, "bench": 8, "encode": 13, "convert": 13}
"""Seconds of a core for compiling all functions that a command may need."""
LONGEST_COMPILE_SECONDS = 35
"""Seconds of a core for compiling all functions that any command may need."""


class CompileNotice:
    """Printer of a line to standard error before a command compiles for seconds.

    It is called before each function that is compiled.
    """

    def __init__(self, command: str) -> None:
        self._seconds = COMPILE_SECONDS.get(command, LONGEST_COMPILE_SECONDS)
        self._functions = 0

    def __call__(self) -> None:
        self._functions += 1
        if self._functions == COMPILED_FUNCTIONS:
            click.echo(f"fba: compiling, once (up to about {self._seconds} s)", err=True)


class _OutputClosedError(Exception):
    """The reader of the output has closed it. Not a BrokenPipeError, for which click exits with 1."""


@contextmanager
def _closed_output() -> Iterator[None]:
    try:
        yield
    except BrokenPipeError as error:
        raise _OutputClosedError from error
    except FbaError as error:
        if isinstance(error.__cause__, BrokenPipeError):
            raise _OutputClosedError from error
        raise


class _Commands(Group):
    """The group of all subcommands, which are listed without importing them."""

    def make_context(self, *arguments: Any, **extra: Any) -> click.Context:
        with _closed_output():
            return super().make_context(*arguments, **extra)

    def invoke(self, ctx: click.Context) -> Any:
        with _closed_output():
            return super().invoke(ctx)

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(_COMMANDS)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and not args[0].startswith("-") and self.get_command(ctx, args[0]) is None:
            ctx.fail(f"there is no command {args[0]!r}{did_you_mean(args[0], _COMMANDS)}")
        return super().resolve_command(ctx, args)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in _COMMANDS:
            return None
        folder = _FOLDERS.get(cmd_name, "")
        command: click.Command = import_module(f"fba.cli.commands.{folder}{cmd_name}").command
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(_COMMANDS.items()))


@click.group(
    cls=_Commands,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog=examples("fba encode walk.bvh -o walk.fba", "fba info walk.fba", "fba play walk.fba"),
)
@click.version_option(__version__, prog_name="fba")
def group() -> None:
    """MPEG-4 Face and Body Animation: encode, decode, convert, play and measure."""


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and exit: 0 done, 1 bad data, 2 bad usage, 130 interrupted, 143 terminated.

    If the reader of its output ends early, as `head` does, the exit code is 0, and no message is printed.

    arguments: None for those of the process, which then does nothing else.
    """
    program, whole_process = NAME, arguments is None
    if arguments is None:
        collect_less()
        program = program_words()
        arguments = sys.argv[1:]
    debug = "--debug" in arguments or bool(os.environ.get("FBA_DEBUG"))
    warnings.simplefilter("always", FbaWarning)
    warnings.showwarning = _warning_display()
    interruptions = Interruptions()
    command = next((word for word in arguments if word in _COMMANDS), "")
    notice = CompileNotice(command) if whole_process else None
    try:
        with interruptions, compilation_listener(notice):
            result = group.main(arguments, prog_name=program, standalone_mode=False)
    except click.exceptions.Exit as stop:
        sys.exit(stop.exit_code)
    except click.ClickException as error:
        error.show()
        sys.exit(BAD_USAGE)
    except (KeyboardInterrupt, click.Abort):
        _exit_interrupted(interruptions.exit_code)
    except _OutputClosedError:
        _drop_output()
        sys.exit(0)
    except (FbaError, OSError, MemoryError) as error:
        if debug:
            raise
        try:
            sys.stdout.flush()
        except (OSError, ValueError, AttributeError):  # full, closed, or none
            _drop_output()
        click.echo(f"fba: error: {with_program(_one_line(error), program, _COMMANDS)}", err=True)
        sys.exit(BAD_DATA)
    except Exception as error:
        if debug:
            raise
        if interruptions.caused(error):
            _exit_interrupted(interruptions.exit_code)
        click.echo(
            f"fba: internal error: {type(error).__name__}: {_one_line(error)}; this is a defect of fba: "
            "please report it with what --debug prints",
            err=True,
        )
        sys.exit(BAD_DATA)
    sys.exit(result if isinstance(result, int) else 0)


def _drop_output() -> None:
    """Let what is left for standard output go nowhere: Python would complain of it, and exit with 120."""
    with suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _exit_interrupted(code: int) -> NoReturn:
    click.echo(TEXT if code == INTERRUPTED else "fba: terminated", err=True)
    sys.exit(code)


def _one_line(error: BaseException) -> str:
    if isinstance(error, MemoryError):
        return "not enough memory for this; work on a shorter part, or at a lower frame rate"
    if isinstance(error, OSError) and error.strerror and not isinstance(error, FbaError):
        return f"{error.filename}: {error.strerror}" if error.filename else error.strerror
    return " ".join(str(error).split()) or type(error).__name__


def _warning_display() -> Callable[..., None]:
    """Return a function that prints each warning of a command once.

    Commands that read a file twice would otherwise print its warnings twice.
    """
    shown: set[str] = set()

    def show(message: Warning | str, category: type[Warning], *_: object, **__: object) -> None:
        if issubclass(category, FbaWarning):
            text = describe(message) if isinstance(message, FbaWarning) else str(message)
            if text not in shown:
                shown.add(text)
                click.echo(f"fba: warning: {text}", err=True)

    return show


if __name__ == "__main__":
    main()
