"""Options that several subcommands share, and the types of their values."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import fields
from fractions import Fraction
from typing import Any

import click

from fba.cli.command import Decorated
from fba.errors import did_you_mean
from fba.limits import Limits
from fba.parameters import BAP_STEP_TABLES, BAP_STEPS_AUTO

RATES = (Fraction(1, 3600), Fraction(10_000))
"""Smallest and largest frame rate that can be asked for, as in BVH files."""
LARGEST_LIMIT = 10**18


def gather(**groups: type) -> Callable[[Decorated], Decorated]:
    """Return a decorator that hands a command its options as dataclasses, by the names of their fields.

    groups: name of the command's argument -> the dataclass; a field with a default may have no option.
    """

    def decorate(command: Decorated) -> Decorated:
        @functools.wraps(command)
        def gathering(**values: Any) -> Any:
            made = {
                name: kind(**{one.name: values.pop(one.name) for one in fields(kind) if one.name in values})
                for name, kind in groups.items()
            }
            return command(**made, **values)

        return gathering  # type: ignore[return-value]

    return decorate


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


from_option = click.option(
    "--from",
    "format",
    metavar="FORMAT",
    help="Input format, if neither content nor suffix shows it: fap, bap, fba, bvh, gltf.",
)
to_option = click.option(
    "--to", metavar="FORMAT", help="Output format, if OUT is - or its suffix does not show it."
)
no_clobber_option = click.option("--no-clobber", is_flag=True, help="Fail if an output file already exists.")
salvage_option = click.option(
    "--salvage", is_flag=True, help="Read the undamaged parts of damaged input, and list what was lost."
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON, for programs.")

clip_option = click.option(
    "--clip",
    metavar="NAME",
    help="Which animation of a glTF file with several, by name or number; `fba info` lists them.",
)

face_option = click.option(
    "--face", metavar="NAME", help="Captures of several faces: the one to read, by its name."
)

limit_option = click.option(
    "--limit",
    "limit",
    type=LimitType(),
    metavar="NAME=VALUE",
    multiple=True,
    callback=lambda _, __, given: Limits(**dict(given)),
    help="Read more than usual from a file that is to be trusted, e.g. bytes=4e9; "
    f"names: {', '.join(limit.name for limit in fields(Limits))}.",
)
"""`--limit`, several times if need be; its value is `Limits`."""


def is_given(option: str) -> bool:
    """Whether an option of the running command, by the name of its parameter, was given and is no default."""
    source = click.get_current_context().get_parameter_source(option)
    return source is not None and source is not click.core.ParameterSource.DEFAULT


def choice_option(flag: str, text: str, *choices: str) -> Callable[[Decorated], Decorated]:
    """Return an option with choices, of which the first is the default. text: its help."""
    return click.option(flag, type=click.Choice(choices), default=choices[0], show_default=True, help=text)


fap_quant_option = click.option(
    "--quant",
    "fap_quant",
    type=click.IntRange(0, 31),
    default=1,
    show_default=True,
    help="Quantiser of FAPs (fap_quant); 0: unquantised.",
)
bap_steps_option = choice_option(
    "--bap-steps",
    "Table of BAP steps of a stream, the standard's or one vendor's; auto: the one that it names, else "
    "the one that looks right.",
    BAP_STEPS_AUTO,
    *BAP_STEP_TABLES,
)
written_bap_steps_option = choice_option(
    "--bap-steps",
    "Table of BAP steps of a stream, the standard's or one vendor's, which is finer; auto: the finer one for "
    "motion capture and walks, that of a stream for what comes from one, else the standard's.",
    BAP_STEPS_AUTO,
    *BAP_STEP_TABLES,
)
mark_option = click.option(
    "--mark/--no-mark",
    default=None,
    help="Name the table of BAP steps behind the end of the stream, where other decoders do not read; "
    "default: yes, if it has a body.",
)


def fps_option(text: str) -> Callable[[Decorated], Decorated]:
    """Return `--fps`. text: its help."""
    return click.option("--fps", type=RateType(), metavar="RATE", help=text)
