"""Frame rates as text."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fba.errors import FormatError
from fba.formats.text.frame_rates import format_rate, parse_rate


@pytest.mark.parametrize(
    ("text", "rate"),
    [
        ("25", Fraction(25)),
        ("25.0", Fraction(25)),
        ("12.5", Fraction(25, 2)),
        ("29.97", Fraction(30000, 1001)),
        (29.97, Fraction(30000, 1001)),
        ("23.976", Fraction(24000, 1001)),
        ("23.98", Fraction(24000, 1001)),
        ("59.94", Fraction(60000, 1001)),
        ("2997/100", Fraction(2997, 100)),
        ("30000/1001", Fraction(30000, 1001)),
        (".5", Fraction(1, 2)),
        (Fraction(1, 3), Fraction(1, 3)),
        (30, Fraction(30)),
    ],
)
def test_parse(text: str | float | Fraction, rate: Fraction) -> None:
    assert parse_rate(text) == rate


@pytest.mark.parametrize(
    "text",
    [
        "",
        "0",
        "0.0",
        "-25",
        "nan",
        "inf",
        "1e3",
        "1/0",
        "25fps",
        "2 5",
        "1_0",
        "٣",
        0,
        -1,
        float("nan"),
        "9" * 5000,
    ],
)
def test_invalid_rates_are_refused(text: str | float) -> None:
    with pytest.raises(FormatError):
        parse_rate(text)


@pytest.mark.parametrize(
    ("rate", "text"),
    [
        (Fraction(25), "25"),
        (Fraction(30000, 1001), "29.97"),
        (Fraction(24000, 1001), "23.976"),
        (Fraction(25, 2), "12.5"),
        (Fraction(2997, 100), "2997/100"),
        (Fraction(1, 3), "1/3"),
    ],
)
def test_format(rate: Fraction, text: str) -> None:
    assert format_rate(rate) == text


@given(st.fractions(Fraction(1, 1000), 10**9, max_denominator=10**9))
def test_text_reads_back_exactly(rate: Fraction) -> None:
    assert parse_rate(format_rate(rate)) == rate
