"""Frame rates: from the text in headers to exact fractions, and back."""

from __future__ import annotations

import re
from fractions import Fraction

from fba.errors import FormatError

Rate = Fraction | int | str
"""A frame rate as callers give it."""
NTSC = {
    text: Fraction(base * 1000, 1001)
    for base, texts in {
        24: ("23.976", "23.98", "23.9760", "23.976024"),
        30: ("29.97", "29.970", "29.9700", "29.97003"),
        48: ("47.952", "47.95"),
        60: ("59.94", "59.940", "59.9400", "59.94006"),
        120: ("119.88", "119.880"),
    }.items()
    for text in texts
}
"""Rounded decimals that programs write for NTSC rates, and the exact rates they mean."""

_NUMBER = re.compile(r"\+?([0-9]{1,40}(\.[0-9]{0,40})?|\.[0-9]{1,40})(/[0-9]{1,40})?")


def parse_rate(text: str | float | Fraction) -> Fraction:
    """Return the frames per second of "25", "12.5", "30000/1001", or an NTSC rate: "29.97" is 30000/1001.

    Raises FormatError for text that is no positive number, or has an exponent or more than 40 digits.
    """
    if isinstance(text, Fraction | int):
        rate = Fraction(text)
    else:
        text = str(text)
        if not _NUMBER.fullmatch(text):
            raise FormatError(
                "a frame rate is a positive number without an exponent, such as 25, 29.97 or 30000/1001",
                token=text,
            )
        numerator, _, denominator = text.partition("/")
        if denominator and not int(denominator):
            raise FormatError("a frame rate cannot be divided by 0", token=text)
        rate = NTSC.get(text) or Fraction(numerator.rstrip(".")) / int(denominator or 1)
    if rate <= 0:
        raise FormatError("the frame rate must be more than 0", token=str(text))
    return rate


def format_rate(rate: Fraction) -> str:
    """Return text that `parse_rate` reads back exactly: an integer, else a decimal, else "p/q"."""
    if rate.denominator == 1:
        return str(rate.numerator)
    for text, ntsc in NTSC.items():
        if rate == ntsc:
            return text
    decimal = f"{float(rate):.6f}".rstrip("0")
    if decimal not in NTSC and Fraction(decimal) == rate:
        return decimal
    return f"{rate.numerator}/{rate.denominator}"
