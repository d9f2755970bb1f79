"""The type of the fixture `run`: the command line as a function."""

from typing import NamedTuple, Protocol


class Ended(NamedTuple):
    """Exit code, standard output and standard error of a command."""

    code: int
    out: str
    err: str


class Run(Protocol):
    def __call__(self, *arguments: object, code: int | None = 0) -> Ended:
        """Run `fba` with arguments, and fail where it ends with another exit code. code: None for any."""
