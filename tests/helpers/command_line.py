"""The command line as a function: the type of the fixture `run`, and what comes in on standard input."""

import io
from typing import NamedTuple, Protocol

import pytest


class Ended(NamedTuple):
    """Exit code, standard output and standard error of a command."""

    code: int
    out: str
    err: str


class Run(Protocol):
    def __call__(self, *arguments: object, code: int | None = 0) -> Ended:
        """Run `fba` with arguments, and fail where it ends with another exit code. code: None for any."""


def pipe_in(monkeypatch: pytest.MonkeyPatch, data: bytes, terminal: bool = False) -> None:
    """Let standard input hold these bytes, as of a pipe. terminal: it is said to be a terminal."""

    class Stdin:
        buffer = io.BufferedReader(io.BytesIO(data))

        def isatty(self) -> bool:
            return terminal

    monkeypatch.setattr("sys.stdin", Stdin())
