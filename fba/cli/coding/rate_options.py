"""`--bitrate`: how many bits a second a stream may take, and what holding to that came to."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from fba.cli.option_fields import option
from fba.cli.options import is_given

if TYPE_CHECKING:
    from fba.codec import Encoder
    from fba.planning import LiveEncoder
    from fba.planning.rate import RateEncoder, RateStatistics, ShownErrors

BITS = {"": 1.0, "bit/s": 1.0, "kbit/s": 1e3, "Mbit/s": 1e6}
"""Bits a second of the units that a bit rate may have."""
SECONDS = {"": 1.0, "s": 1.0, "ms": 1e-3}
LARGEST = 1e9
MOST_PARAMETERS = 3
"""Of which errors are named."""


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
        if match[2] not in self._units:
            known = ", ".join(one for one in self._units if one)
            self.fail(f"{match[2]!r} is no unit of a {self.name}; they are {known}", param, ctx)
        amount = number * self._units[match[2]]
        if not 0 < amount <= LARGEST:
            self.fail(
                f"{text} is out of reach: a {self.name} is positive, and at most {LARGEST:g}", param, ctx
            )
        return amount


bit_rate_option = option(
    "--bitrate",
    type=AmountType("bit rate", BITS, "1500 or 1.5kbit/s"),
    metavar="BITS",
    help="Send what loses least at this mean rate: 1500, 1500bit/s, 1.5kbit/s.",
)
buffer_option = option(
    type=AmountType("buffer", SECONDS, "0.5s"),
    default=1.0,
    typed="1s",
    metavar="SECONDS",
    help="With --bitrate: how far ahead of the rate the stream may be at any time.",
)


def check_buffer() -> None:
    """Raise click.UsageError for a buffer without a rate."""
    if is_given("buffer") and not is_given("bit_rate"):
        raise click.UsageError("--buffer goes with --bitrate: it says how closely that is held")


class HeldRate(NamedTuple):
    """What holding to a bit rate came to.

    bit_rate: bits a second. buffer: seconds. quant: of FAPs and BAPs. errors: None where they are not known.
    """

    bit_rate: float
    buffer: float
    statistics: RateStatistics
    quant: int
    errors: ShownErrors | None = None


def held_by(encoder: Encoder | RateEncoder | LiveEncoder) -> HeldRate | None:
    """Return what a live encoder held to; None for one without a rate. Its errors are not known."""
    from fba.planning.rate import RateEncoder

    if not isinstance(encoder, RateEncoder):
        return None
    bucket = encoder.bucket
    return HeldRate(bucket.rate, bucket.size / bucket.rate, encoder.statistics, encoder.options.fap_quant)


def rate_lines(held: HeldRate) -> list[str]:
    """Return what holding to a rate came to, for people."""
    counts = held.statistics
    text = (
        f"held to {held.bit_rate:g} bit/s: at most {counts.peak / held.bit_rate:.2f} s ahead, of "
        f"{held.buffer:g} s; quantiser {held.quant}"
    )
    if counts.left_out:
        text += (
            f"; {counts.left_out} of {counts.frames} frames are not sent, planes are at most "
            f"{counts.longest_gap:.2f} s apart"
        )
    if counts.not_sent:
        text += "; what was sent later did not fit, and is not sent: a larger --buffer would hold it"
    return [text, *(_error_lines(held.errors) if held.errors is not None else ())]


def _error_lines(errors: ShownErrors) -> list[str]:
    """Return how far what is shown is off."""
    if not errors.parameters:
        return ["nothing that is sent is off"]
    lines = []
    if errors.face is not None:
        lines.append(
            f"face: vertices move by at most {errors.face.largest * 1000:.2f} mm, 99 % of them by at most "
            f"{errors.face.percentile * 1000:.2f} mm; the head's angles are within {errors.face.head:.2f} "
            "degrees"
        )
    if errors.body is not None:
        lines.append(
            f"body: points 3 cm off joints move by at most {errors.body.largest * 1000:.1f} mm, 99 % of them "
            f"by at most {errors.body.percentile * 1000:.1f} mm; feet that stand by at most "
            f"{errors.body.feet * 1000:.1f} mm"
        )
    named = [
        f"{one.label} {one.largest:g} (99 %: {one.percentile:g})"
        for one in errors.parameters[:MOST_PARAMETERS]
    ]
    more = len(errors.parameters) - len(named)
    return [
        *lines,
        f"off at most, in units: {', '.join(named)}{f', and {more} parameters less' if more else ''}",
    ]


def rate_values(held: HeldRate) -> dict[str, Any]:
    """Return the same for programs."""
    counts = held.statistics
    values: dict[str, Any] = {
        "bits_per_second": held.bit_rate,
        "buffer": held.buffer,
        "most_ahead": round(counts.peak / held.bit_rate, 6),
        "quantiser": held.quant,
        "frames_left_out": counts.left_out,
        "longest_gap": round(counts.longest_gap, 6),
    }
    return values | (_error_values(held.errors) if held.errors is not None else {})


def _error_values(errors: ShownErrors) -> dict[str, Any]:
    """Return how far what is shown is off, for programs."""
    values: dict[str, Any] = {
        "parameters": {
            one.label: {"largest": one.largest, "percentile_99": one.percentile} for one in errors.parameters
        }
    }
    for name, found in (("face", errors.face), ("body", errors.body)):
        if found is not None:
            values[name] = {
                "largest_mm": round(found.largest * 1000, 6),
                "percentile_99_mm": round(found.percentile * 1000, 6),
            }
    if errors.face is not None:
        values["face"]["head_degrees"] = round(errors.face.head, 6)
    if errors.body is not None:
        values["body"]["feet_mm"] = round(errors.body.feet * 1000, 6)
    return values
