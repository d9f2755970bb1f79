"""`--bitrate`: how many bits a second a stream may take, and what holding to that came to."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from fba.cli.command import Decorated
from fba.cli.options import is_given

if TYPE_CHECKING:
    from fba.planning.rate import RateStatistics, ShownErrors

BITS = {"": 1.0, "bit/s": 1.0, "kbit/s": 1e3, "mbit/s": 1e6}
"""Bits a second of the units that a bit rate may have."""
SECONDS = {"": 1.0, "s": 1.0, "ms": 1e-3}
LARGEST = 1e9
MOST_PARAMETERS = 3
"""Of which errors are named."""
DEFAULT_BUFFER = 1.0


class AmountType(click.ParamType[float]):
    """A positive number with a unit. what: its name. units: what each unit counts; "" for none."""

    def __init__(self, what: str, units: Mapping[str, float], example: str) -> None:
        self.name = what
        self._units = units
        self._example = example

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        text = str(value).strip()
        match = re.fullmatch(r"([0-9.eE+-]+)\s*([a-zA-Z/]*)", text)
        try:
            number = float(match[1]) if match else math.nan
        except ValueError:
            number = math.nan
        if match is None or math.isnan(number):
            self.fail(f"{text!r} is no {self.name}; write e.g. {self._example}", param, ctx)
        unit = match[2].lower()
        if unit not in self._units:
            known = ", ".join(one for one in self._units if one)
            self.fail(f"{match[2]!r} is no unit of a {self.name}; they are {known}", param, ctx)
        amount = number * self._units[unit]
        if not 0 < amount <= LARGEST:
            self.fail(f"{text} is out of reach: a {self.name} is positive, and at most {LARGEST:g}", param, ctx)
        return amount


def rate_options(command: Decorated) -> Decorated:
    """Add `--bitrate` and `--buffer`; the command takes them as `bitrate` and `buffer`, None if not given."""
    buffer = click.option(
        "--buffer",
        type=AmountType("buffer", SECONDS, "0.5s"),
        metavar="SECONDS",
        help="With --bitrate: how far ahead of the rate the stream may be at any time. Default: 1s.",
    )
    bitrate = click.option(
        "--bitrate",
        type=AmountType("bit rate", BITS, "1500 or 1.5kbit/s"),
        metavar="BITS",
        help="Send what loses least at this mean rate: 1500, 1500bit/s, 1.5kbit/s.",
    )
    decorated: Any = bitrate(buffer(command))
    return decorated  # type: ignore[no-any-return]


def check_buffer() -> None:
    """Raise click.UsageError for a buffer without a rate."""
    if is_given("buffer") and not is_given("bitrate"):
        raise click.UsageError("--buffer goes with --bitrate: it says how closely that is held")


def rate_lines(
    bitrate: float, buffer: float, statistics: RateStatistics, quant: int, errors: ShownErrors | None
) -> list[str]:
    """Return what holding to a rate came to, for people."""
    text = (
        f"held to {bitrate:g} bit/s: never more than {statistics.peak / bitrate:.2f} s ahead, of {buffer:g} s; "
        f"quantiser {quant}"
    )
    if statistics.left_out:
        text += (
            f"; {statistics.left_out} of {statistics.frames} frames are not sent, for {statistics.longest_gap:.2f} s "
            "at most"
        )
    return [text, *(error_lines(errors) if errors is not None else ())]


def error_lines(errors: ShownErrors) -> list[str]:
    """Return how far what is shown is off."""
    if not errors.parameters:
        return ["nothing that is sent is off"]
    lines = []
    if errors.face is not None:
        lines.append(
            f"face: vertices move by at most {errors.face.largest * 1000:.2f} mm, 99 % of them by at most "
            f"{errors.face.percentile * 1000:.2f} mm; the head's angles are within {errors.face.head:.2f} degrees"
        )
    if errors.body is not None:
        lines.append(
            f"body: points 3 cm off joints move by at most {errors.body.largest * 1000:.1f} mm, 99 % of them by "
            f"at most {errors.body.percentile * 1000:.1f} mm; feet that stand by at most "
            f"{errors.body.feet * 1000:.1f} mm"
        )
    named = [
        f"{one.label} {one.largest:g} (99 %: {one.percentile:g})" for one in errors.parameters[:MOST_PARAMETERS]
    ]
    more = len(errors.parameters) - len(named)
    return [*lines, f"off at most, in units: {', '.join(named)}{f', and {more} parameters less' if more else ''}"]


def rate_values(
    bitrate: float, buffer: float, statistics: RateStatistics, errors: ShownErrors | None
) -> dict[str, Any]:
    """Return the same for programs."""
    values: dict[str, Any] = {
        "bits_per_second": bitrate,
        "buffer": buffer,
        "largest_in_buffer": round(statistics.peak / bitrate, 6),
        "frames_left_out": statistics.left_out,
        "longest_gap": round(statistics.longest_gap, 6),
    }
    if errors is not None:
        values["parameters"] = {
            one.label: {"largest": one.largest, "percentile_99": one.percentile} for one in errors.parameters
        }
        if errors.face is not None:
            values["face"] = {
                "largest_mm": round(errors.face.largest * 1000, 6),
                "percentile_99_mm": round(errors.face.percentile * 1000, 6),
                "head_degrees": round(errors.face.head, 6),
            }
        if errors.body is not None:
            values["body"] = {
                "largest_mm": round(errors.body.largest * 1000, 6),
                "percentile_99_mm": round(errors.body.percentile * 1000, 6),
                "feet_mm": round(errors.body.feet * 1000, 6),
            }
    return values
