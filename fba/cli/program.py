"""The words with which the user starts this program, for usage lines and hints."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import sys
from collections.abc import Iterable

import click

NAME = "fba"
DEV = "FBA_DEV"
"""Environment variable that `./dev` sets for the commands it starts: its own path, as the user typed it."""


def program_words() -> str:
    """Return the words that start this program again from the user's folder.

    "fba" where that is on the PATH, else as it was started: ".venv/bin/fba", "python3 -m fba", "./dev fba".
    Quoted for a shell.
    """
    dev = os.environ.get(DEV)
    if dev:
        return f"{shlex.quote(dev)} {NAME}"
    if os.path.basename(sys.argv[0]) == "__main__.py":
        return f"{_typed(sys.orig_argv[0])} -m {NAME}"
    return _typed(sys.argv[0])


def with_program(text: str, program: str, commands: Iterable[str]) -> str:
    """Return a text in which every command, such as `fba info FILE`, starts with the words of `program`.

    commands: the names of the subcommands; "fba" before another word stays.
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
    """Return the name alone if the PATH leads to this very file, else the path."""
    folder, name = os.path.split(path)
    if os.name == "nt":
        name = name.removesuffix(".exe")
    # An installed script is given its whole path, whatever was typed. Links are not followed: the Python of a
    # virtual environment is a link to another.
    first = shutil.which(name)
    on_path = first is not None and os.path.abspath(os.path.dirname(first)) == os.path.abspath(folder)
    return name if on_path or not folder else shlex.quote(path)
