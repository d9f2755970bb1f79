"""Options that several subcommands share, and the types of their values."""

from __future__ import annotations

import math
import os
from dataclasses import fields
from fractions import Fraction
from pathlib import Path
from typing import Any

import click

from fba.cli.option_fields import option, option_like
from fba.encoder_options import EncoderOptions
from fba.errors import did_you_mean
from fba.limits import DEFAULT_LIMITS, Limits

RATES = (Fraction(1, 3600), Fraction(10_000))
"""Smallest and largest frame rate that can be asked for, as in BVH files."""
LARGEST_LIMIT = 10**18
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
"""The type of a file to read, or of standard input."""
FILE = ExistingPath(dir_okay=False)


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


class LimitType(click.ParamType[tuple[str, int]]):
    """A limit and its value: frames=10000000."""

    name = "limit"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, int]:
        name, _, number = str(value).partition("=")
        known = [limit.name for limit in fields(Limits)]
        if name not in known:
            self.fail(
                f"there is no limit {name!r}{did_you_mean(name, known)}; they are {', '.join(known)}",
                param,
                ctx,
            )
        try:
            exact = Fraction(number)
        except (ValueError, ZeroDivisionError):
            self.fail(f"{number!r} is not a number; write e.g. {name}={getattr(Limits(), name)}", param, ctx)
        if exact < 1 or exact.denominator != 1 or exact > LARGEST_LIMIT:
            self.fail(f"{name}={number}: a limit is a whole number from 1 to {LARGEST_LIMIT}", param, ctx)
        return name, int(exact)


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


def is_given(name: str) -> bool:
    """Whether an option of the running command, by the name of its field, was given and is no default."""
    source = click.get_current_context().get_parameter_source(name)
    return source is not None and source is not click.core.ParameterSource.DEFAULT


def rate_option(text: str) -> Any:
    """Return `--fps`, the frame rate of the result. text: its help."""
    return option("--fps", type=RateType(), metavar="RATE", help=text)


def size_option(**settings: Any) -> Any:
    """Return `--size` of pictures and films. settings: as for `option`."""
    default = {"help": "Default: 1280x720; of a GIF, 480x270."}
    return option(type=SizeType(), metavar="WxH", **(settings or default))


def model_option(text: str, *flags: str) -> Any:
    """Return an option for a face model, by default `--model`. text: its help."""
    return option(*flags, type=ExistingPath(), metavar="FILE", help=text)


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
    type=LimitType(),
    metavar="NAME=VALUE",
    multiple=True,
    callback=lambda _, __, given: Limits(**dict(given)),
    help="Read more than usual from a file that is to be trusted, e.g. bytes=4e9; "
    f"names: {', '.join(limit.name for limit in fields(Limits))}.",
)
"""`--limit`, several times if need be; its value is `Limits`."""
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
