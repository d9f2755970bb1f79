"""Options that several subcommands share, and the types of their values."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import fields
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

import click

from fba.cli.option_fields import option, option_like
from fba.encoder_options import EncoderOptions
from fba.errors import did_you_mean
from fba.limits import DEFAULT_LIMITS, Limits

MIN_RATE = Fraction(1, 3600)
"""Lowest frame rate, as in BVH files."""
MAX_FRAME_RATE = Fraction(10_000)
"""Highest frame rate, as in BVH files."""
MAX_LIMIT = 10**18
MAX_SIZE = 16384
"""Largest width and height of a picture, in pixels."""
NAMES_OF_STANDARD_INPUT = ("-", "/dev/stdin", "/dev/fd/0", "/proc/self/fd/0")


class ExistingPath(click.Path):
    """A file or folder that exists; the error for another path suggests a similar name."""

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
    """Return the names in the folder of a path; none if it cannot be listed."""
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
        return path if str(path) != "-" else path.absolute()  # "./-" is a file


EXISTING = InputType()
"""The type of a file to read, or of standard input."""
FILE = ExistingPath(dir_okay=False)


class TextType(click.ParamType[Any]):
    """A value that is typed as text.

    name: of the value. parse: returns it; its ValueError is the text of a usage error.
    """

    def __init__(self, name: str, parse: Callable[[str], Any]) -> None:
        self.name = name
        self._parse = parse

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if not isinstance(value, str):
            return value  # a default
        try:
            return self._parse(value)
        except ValueError as error:
            self.fail(str(error), param, ctx)


class FloatRange(click.FloatRange):
    """A number in a range, which NaN is in none of, though it is not beyond a limit."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if math.isnan(number := super().convert(value, param, ctx)):
            self.fail(f"{value!r} is not a number", param, ctx)
        return number


def parse_number(text: str) -> float:
    """Return a finite number; NaN for other text."""
    try:
        number = float(text)
    except ValueError:
        return math.nan
    return number if math.isfinite(number) else math.nan


def _parse_rate(text: str) -> Fraction:
    from fba.formats.text.frame_rates import parse_rate

    try:
        rate = parse_rate(text)
    except ValueError as error:
        raise ValueError(f"{error}; it may be {MIN_RATE} to {MAX_FRAME_RATE}") from error
    if not MIN_RATE <= rate <= MAX_FRAME_RATE:
        allowed = f"{MIN_RATE} to {MAX_FRAME_RATE}"
        raise ValueError(f"{text} frames/s are out of reach: a frame rate may be {allowed}")
    return rate


def _parse_period(text: str) -> Fraction:
    try:
        seconds = Fraction(text)
    except (ValueError, ZeroDivisionError):
        raise ValueError(f"{text!r} is not a number of seconds") from None
    if seconds <= 0:
        raise ValueError(f"{text} is not positive")
    return seconds


def _parse_moment(text: str) -> float:
    seconds = parse_number(text)
    if math.isnan(seconds):
        raise ValueError(f"{text!r} is not a number of seconds")
    return seconds


def _parse_limit(text: str) -> tuple[str, int]:
    name, _, number = text.partition("=")
    known = [limit.name for limit in fields(Limits)]
    if name not in known:
        raise ValueError(
            f"there is no limit {name!r}{did_you_mean(name, known)}; they are {', '.join(known)}"
        )
    try:
        exact = Fraction(number)
    except (ValueError, ZeroDivisionError):
        example = f"{name}={getattr(Limits(), name)}"
        raise ValueError(f"{number!r} is not a number; write e.g. {example}") from None
    if exact < 1 or exact.denominator != 1 or exact > MAX_LIMIT:
        raise ValueError(f"{name}={number}: a limit is a whole number from 1 to {MAX_LIMIT}")
    return name, int(exact)


def _parse_size(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    is_size = width.isdecimal() and height.isdecimal()
    if not is_size or not (0 < int(width) <= MAX_SIZE > int(height) > 0):
        raise ValueError(f"{text!r} is not a size; write e.g. 1280x720")
    return int(width), int(height)


RATE = TextType("rate", _parse_rate)
"""A frame rate: 25, 29.97, 30000/1001."""
PERIOD = TextType("seconds", _parse_period)
"""A positive number of seconds."""
MOMENT = TextType("seconds", _parse_moment)
"""A time in an animation, in seconds; it may be negative."""
LIMIT = TextType("limit", _parse_limit)
"""A limit and its value: frames=10000000."""
SIZE = TextType("size", _parse_size)
"""Width and height in pixels: 1280x720."""


def is_given(name: str) -> bool:
    """Whether an option of the running command was given. name: of its field."""
    source = click.get_current_context().get_parameter_source(name)
    return source is not None and source is not click.core.ParameterSource.DEFAULT


def rate_option(text: str) -> Any:
    """Return `--fps`, the frame rate of the result. text: its help."""
    return option("--fps", type=RATE, metavar="RATE", help=text)


def size_option(**settings: Any) -> Any:
    """Return `--size` of pictures and films. settings: as for `option`."""
    default = {"help": "Default: 1280x720; of a GIF, 480x270."}
    return option(type=SIZE, metavar="WxH", **(settings or default))


def model_option(text: str, *flags: str) -> Any:
    """Return an option for a face model, by default `--model`. text: its help."""
    return option(*flags, type=ExistingPath(), metavar="FILE", help=text)


Figure = Literal["alex", "ruth"]
"""The figures that come with the library, `fba.figures.FIGURES`."""
figure_option = option(
    default=None,
    help="A figure that comes with fba: alex, a young man (the built-in person), or ruth, a woman of about "
    "sixty-five. --model and --body replace its face and its body.",
)
"""`--figure`."""
format_option = option(
    "--from",
    metavar="FORMAT",
    help="Input format, if neither content nor suffix shows it: fap, bap, fba, bvh, gltf.",
)
to_option = option(
    "--to", metavar="FORMAT", help="Output format, if OUT is - or its suffix does not show it."
)
no_clobber_option = option(default=False, help="Fail if an output file already exists.")
json_option = option("--json", default=False, help="Print JSON, for programs.")
face_option = option(metavar="NAME", help="Captures of several faces: the one to read, by its name.")
limit_option = option(
    "--limit",
    default=DEFAULT_LIMITS,
    type=LIMIT,
    metavar="NAME=VALUE",
    multiple=True,
    callback=lambda _, __, given: Limits(**dict(given)),
    help="Read more than usual from a file that is to be trusted, e.g. bytes=4e9; "
    f"names: {', '.join(limit.name for limit in fields(Limits))}.",
)
"""`--limit`, which is repeatable; its value is `Limits`."""
read_steps_option = option(
    default="auto",
    help="Table of BAP steps of a stream, the standard's or one vendor's; auto: the one that it names, else "
    "the one that looks right.",
)
written_steps_option = option(
    default="auto",
    help="Table of BAP steps of a stream, the standard's or one vendor's, which is finer; auto: the finer "
    "one for motion capture and walks, that of a stream for what comes from one, else the standard's.",
)
mark_option = option_like(EncoderOptions, "mark", default=None, by_default="yes")
