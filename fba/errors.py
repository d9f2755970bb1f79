"""Exceptions, which say where something is wrong, what was found, what was expected and what to do.

::

    FbaError
    ├── BitstreamError(plane, bit)          also ValueError   the bits of an FBA stream are damaged
    ├── FormatError(path, line, token)      also ValueError   a file is not what its format says
    ├── RangeError(parameter, value, limits) also ValueError  a value that the syntax cannot carry
    ├── LimitError(limit, found, allowed)   also ValueError   input that takes more than `fba.Limits` allow
    ├── UnsupportedError(what)              also NotImplementedError  correct, but not handled here
    ├── OptionError                         also TypeError    an option that does not exist, or contradicts
    ├── ModelError                          also ValueError   a face or body model is unusable
    └── DisplayError                        also OSError      no window, no OpenGL, no video encoder

Input that is odd, but can be read, is an `FbaWarning`.

If an argument of the called function helps, the error has a `Remedy`, so that the command line can name its
option in place of the argument.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Self


@dataclass(frozen=True)
class Remedy:
    """An argument that helps against an error.

    argument: its name. text: what to do, with `{}` in place of the argument. value: an example, as Python.
    call: the function that takes the argument, if it is not the one that was called.
    """

    argument: str
    text: str
    value: str
    call: str = ""

    def __str__(self) -> str:
        """Return the text for Python: "give one with source_rate=25"."""
        given = f"{self.argument}={self.value}"
        return self.fill_in(f"{self.call}({given})" if self.call else given)

    def fill_in(self, given: str) -> str:
        """Return the text with this in place of the argument; without an argument, the text as it is."""
        return self.text.replace("{}", given) if self.argument else self.text


class _Remediable:
    """An exception with remedies, which its text ends with."""

    remedies: tuple[Remedy, ...] = ()

    @property
    def finding(self) -> str:
        """The text without the remedies."""
        return super().__str__()

    def with_remedies(self, *remedies: Remedy) -> Self:
        """Set the remedies; return the same exception."""
        self.remedies = remedies
        return self

    def __str__(self) -> str:
        return "; ".join([self.finding, *map(str, self.remedies)])


class FbaError(_Remediable, Exception):
    """Base of every error that this package raises on purpose."""


class FbaWarning(_Remediable, UserWarning):
    """The input was read, but something in it was odd; the text says what and what was assumed."""


def warn(text: str, stacklevel: int = 1) -> None:
    """Warn of something odd with an FbaWarning. stacklevel: as of `warnings.warn` in the calling function."""
    warnings.warn(text, FbaWarning, stacklevel=stacklevel + 1)


SAVE_AS_UTF8 = "save it as UTF-8"
"""What to do with a text file in another encoding."""


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return " (did you mean 'joy'?)" for an error about an unknown word, or "" if no known word is close."""
    from difflib import get_close_matches

    near = get_close_matches(word.lower(), list(known), n=1)
    return f" (did you mean {near[0]!r}?)" if near else ""


class BitstreamError(FbaError, ValueError):
    """Damage in an FBA stream.

    message: the text without plane and bit. plane: number (0-based, in stream order) of the damaged plane.
    bit: position of the damage, from the start of the stream. blocks: what `Decoder.finish` decoded before
    it and no earlier call returned.
    """

    blocks: Sequence[Any] = ()

    def __init__(self, message: str, *, plane: int | None = None, bit: int | None = None) -> None:
        self.message = message
        self.plane = plane
        self.bit = bit
        where = []
        if plane is not None:
            where.append(f"plane {plane}")
        if bit is not None:
            where.append(f"bit {bit} (byte {bit // 8})")
        super().__init__(f"{', '.join(where)}: {message}" if where else message)


class FormatError(FbaError, ValueError):
    """A file whose content breaks its format.

    path: the file. line: 1-based line number, where lines exist. token: the offending text.
    """

    def __init__(
        self,
        message: str,
        *,
        path: str | os.PathLike[str] | None = None,
        line: int | None = None,
        token: str | None = None,
    ) -> None:
        self.path = os.fspath(path) if path is not None else None
        self.line = line
        self.token = token if token is None or len(token) <= 40 else token[:37] + "..."
        where = self.path or ""
        if line is not None:
            where += f":{line}" if where else f"line {line}"
        text = f"{where}: {message}" if where else message
        if self.token is not None:
            text += f" (found {self.token!r})"
        super().__init__(text)


class RangeError(FbaError, ValueError):
    """A value beyond what the syntax can carry.

    parameter: its name, e.g. "FAP 3 open_jaw". value: the offending value.
    limits: (smallest, largest) value that would fit. frame: position in the animation, 0-based.
    """

    def __init__(
        self,
        message: str,
        *,
        parameter: str | None = None,
        value: int | None = None,
        limits: tuple[int, int] | None = None,
        frame: int | None = None,
    ) -> None:
        self.parameter = parameter
        self.value = value
        self.limits = limits
        self.frame = frame
        where = [f"frame {frame}"] if frame is not None else []
        if parameter is not None:
            where.append(parameter)
        super().__init__(f"{', '.join(where)}: {message}" if where else message)


class LimitError(FbaError, ValueError):
    """Input that takes more memory or time than `fba.Limits` allow.

    limit: the name of the limit. found: what the input needs. allowed: what the limit allows. blocks: as for
    BitstreamError.
    """

    blocks: Sequence[Any] = ()

    def __init__(self, message: str, *, limit: str, found: int, allowed: int) -> None:
        self.limit = limit
        self.found = found
        self.allowed = allowed
        super().__init__(message)


class UnsupportedError(FbaError, NotImplementedError):
    """Correct input that this implementation does not support; `what` names the feature."""

    def __init__(self, message: str, *, what: str | None = None, **details: Any) -> None:
        self.blocks: Sequence[Any] = ()
        self.what = what if what is not None else message
        self.plane: int | None = details.get("plane")
        self.bit: int | None = details.get("bit")
        super().__init__(message)


class OptionError(FbaError, TypeError):
    """An option that a format does not know, or options that contradict each other."""


class ModelError(FbaError, ValueError):
    """A face or body model that cannot be used; the text names the place in it."""


class DisplayError(FbaError, OSError):
    """No window, no OpenGL context or no video encoder; the text says what to install or set."""
