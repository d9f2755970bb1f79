"""`--bitrate`: the bits per second that a stream may take, and reports of the result."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from fba.cli.option_fields import option
from fba.cli.options import TextType, is_given

if TYPE_CHECKING:
    from fba.codec import Encoder
    from fba.planning import LiveEncoder
    from fba.planning.rate import RateEncoder, RateStatistics, ShownErrors

BITS = {"": 1.0, "bit/s": 1.0, "kbit/s": 1e3, "Mbit/s": 1e6}
"""Bits per second of each unit of a bit rate."""
SECONDS = {"": 1.0, "s": 1.0, "ms": 1e-3}
"""Seconds of each unit of a buffer."""
MAX_AMOUNT = 1e9
"""Largest bit rate and buffer."""
NAMED_PARAMETERS = 3
"""Most parameters whose errors are printed."""


def amount_type(name: str, units: Mapping[str, float], example: str) -> TextType:
    """Return the type of a positive number with a unit. units: their factors; "" for a missing unit."""

    def parse(typed: str) -> float:
        text = typed.strip()
        match = re.fullmatch(r"([0-9.eE+-]+)\s*([a-zA-Z/]*)", text)
        try:
            number = float(match[1]) if match else math.nan
        except ValueError:
            number = math.nan
        if match is None or math.isnan(number):
            raise ValueError(f"{text!r} is no {name}; write e.g. {example}")
        if match[2] not in units:
            raise ValueError(
                f"{match[2]!r} is no unit of a {name}; they are {', '.join(filter(None, units))}"
            )
        amount = number * units[match[2]]
        if not 0 < amount <= MAX_AMOUNT:
            raise ValueError(f"{text} is out of reach: a {name} is positive, and at most {MAX_AMOUNT:g}")
        return amount

    return TextType(name, parse)


bit_rate_option = option(
    "--bitrate",
    type=amount_type("bit rate", BITS, "1500 or 1.5kbit/s"),
    metavar="BITS",
    help="Send what loses least at this mean rate: 1500, 1500bit/s, 1.5kbit/s.",
)
buffer_option = option(
    type=amount_type("buffer", SECONDS, "0.5s"),
    default=1.0,
    typed="1s",
    metavar="SECONDS",
    help="With --bitrate: how far ahead of the rate the stream may be at any time.",
)


def check_buffer() -> None:
    """Raise click.UsageError for a buffer without a rate."""
    if is_given("buffer") and not is_given("bit_rate"):
        raise click.UsageError("--buffer goes with --bitrate: it says how closely that is held")


class KeptRate(NamedTuple):
    """A bit rate that a stream kept, in bits per second, and the result.

    buffer: seconds. quant: of FAPs and BAPs. errors: None if unknown.
    """

    bit_rate: float
    buffer: float
    statistics: RateStatistics
    quant: int
    errors: ShownErrors | None = None


def rate_of(encoder: Encoder | RateEncoder | LiveEncoder) -> KeptRate | None:
    """Return the bit rate that a live encoder kept, without errors; None for an encoder without a rate."""
    from fba.planning.rate import RateEncoder

    if not isinstance(encoder, RateEncoder):
        return None
    bucket = encoder.bucket
    return KeptRate(bucket.rate, bucket.size / bucket.rate, encoder.statistics, encoder.options.fap_quant)


def rate_lines(kept: KeptRate) -> list[str]:
    """Return the result of a bit rate, for people."""
    counts = kept.statistics
    text = (
        f"held to {kept.bit_rate:g} bit/s: at most {counts.peak / kept.bit_rate:.2f} s ahead, of "
        f"{kept.buffer:g} s; quantiser {kept.quant}"
    )
    if counts.left_out:
        text += (
            f"; {counts.left_out} of {counts.frames} frames are not sent, planes are at most "
            f"{counts.longest_gap:.2f} s apart"
        )
    if counts.not_sent:
        text += "; what was sent later did not fit, and is not sent: a larger --buffer would hold it"
    return [text, *(_error_lines(kept.errors) if kept.errors is not None else ())]


def _error_lines(errors: ShownErrors) -> list[str]:
    """Return the errors of the shown face and body, for people."""
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
        f"{error.label} {error.largest:g} (99 %: {error.percentile:g})"
        for error in errors.parameters[:NAMED_PARAMETERS]
    ]
    more = len(errors.parameters) - len(named)
    return [
        *lines,
        f"off at most, in units: {', '.join(named)}{f', and {more} parameters less' if more else ''}",
    ]


def rate_values(kept: KeptRate) -> dict[str, Any]:
    """Return the result of a bit rate, for programs."""
    counts = kept.statistics
    values: dict[str, Any] = {
        "bits_per_second": kept.bit_rate,
        "buffer": kept.buffer,
        "most_ahead": round(counts.peak / kept.bit_rate, 6),
        "quantiser": kept.quant,
        "frames_left_out": counts.left_out,
        "longest_gap": round(counts.longest_gap, 6),
    }
    return values | (_error_values(kept.errors) if kept.errors is not None else {})


def _error_values(errors: ShownErrors) -> dict[str, Any]:
    """Return the errors of the shown face and body, for programs."""
    values: dict[str, Any] = {
        "parameters": {
            error.label: {"largest": error.largest, "percentile_99": error.percentile}
            for error in errors.parameters
        }
    }
    for name, part in (("face", errors.face), ("body", errors.body)):
        if part is not None:
            values[name] = {
                "largest_mm": round(part.largest * 1000, 6),
                "percentile_99_mm": round(part.percentile * 1000, 6),
            }
    if errors.face is not None:
        values["face"]["head_degrees"] = round(errors.face.head, 6)
    if errors.body is not None:
        values["body"]["feet_mm"] = round(errors.body.feet * 1000, 6)
    return values
