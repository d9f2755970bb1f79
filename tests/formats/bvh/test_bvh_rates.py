"""Which frame rate a rounded frame time of a BVH file stands for."""

from fractions import Fraction

import pytest

from fba.formats.bvh import _reader as reader


@pytest.mark.parametrize(
    ("frame_time", "rate"),
    [
        ("0.042", Fraction(24)),  # nearer to 23.976, but so coarse a time is that of a whole rate
        ("0.0167", Fraction(60)),
        ("0.0417", Fraction(24000, 1001)),  # much nearer than 24
        ("0.0333667", Fraction(30000, 1001)),
        ("0.0333333", Fraction(30)),
        ("1000.5", Fraction(2, 2001)),
    ],
)
def test_rate_of_a_frame_time(frame_time: str, rate: Fraction) -> None:
    assert reader._rate(frame_time) == rate
