"""Sine, cosine and arc tangent without calls or branches, so that loops over angles are vectorised.

An angle is first reduced to an eighth of a turn; there the truncated Taylor series are exact to rounding.
"""

from __future__ import annotations

import math

from fba.compiled import inlined

PER_RADIAN = 2.0 / math.pi
QUARTER_HIGH = math.floor(math.pi / 2 * 2.0**32) / 2.0**32
"""The first 33 bits of a quarter turn: products with whole numbers below 2^20 are exact."""
QUARTER_LOW = (math.pi / 2 - QUARTER_HIGH) + math.sin(math.pi) / 2
"""The rest of a quarter turn; sin(math.pi) is the rounding error of math.pi."""
S3, S5, S7, S9, S11, S13, S15 = ((-1.0) ** (n // 2) / math.factorial(n) for n in range(3, 16, 2))
C2, C4, C6, C8, C10, C12, C14, C16 = ((-1.0) ** (n // 2) / math.factorial(n) for n in range(2, 17, 2))

EIGHTH = math.tan(math.pi / 8)
T3, T5, T7, T9, T11, T13, T15, T17, T19, T21, T23 = ((-1.0) ** (n // 2) / n for n in range(3, 24, 2))


@inlined
def sine_cosine(angle: float) -> tuple[float, float]:
    """Return sine and cosine of an angle in radians, |angle| < 10^6, within 3e-16."""
    quarters = math.floor(angle * PER_RADIAN + 0.5)
    x = (angle - quarters * QUARTER_HIGH) - quarters * QUARTER_LOW
    z = x * x
    s = x + x * z * (S3 + z * (S5 + z * (S7 + z * (S9 + z * (S11 + z * (S13 + z * S15))))))
    c = 1.0 + z * (C2 + z * (C4 + z * (C6 + z * (C8 + z * (C10 + z * (C12 + z * (C14 + z * C16)))))))
    # quarter of the turn, 0.0 to 3.0; used in selections, not in branches
    quarter = quarters - 4.0 * math.floor(quarters * 0.25)
    odd = quarter - 2.0 * math.floor(quarter * 0.5)
    sine = c if odd > 0.5 else s
    cosine = s if odd > 0.5 else c
    sine = -sine if quarter > 1.5 else sine
    cosine = -cosine if 0.5 < quarter < 2.5 else cosine
    return sine, cosine


@inlined
def arc_tangent(y: float, x: float) -> float:
    """Return the angle of the direction (x, y) as `math.atan2`, within 1e-11; 0 for (0, 0)."""
    high = max(abs(x), abs(y))
    low = min(abs(x), abs(y))
    ratio = low / (high if high > 0.0 else 1.0)
    steep = ratio > EIGHTH
    t = (ratio - 1.0) / (ratio + 1.0) if steep else ratio  # the angle less an eighth of a turn
    z = t * t
    angle = t * (1.0 + z * (T3 + z * (T5 + z * (T7 + z * (T9 + z * (T11 + z * (T13
        + z * (T15 + z * (T17 + z * (T19 + z * (T21 + z * T23)))))))))))  # fmt: skip
    angle = angle + 0.25 * math.pi if steep else angle
    angle = 0.5 * math.pi - angle if abs(y) > abs(x) else angle
    angle = math.pi - angle if x < 0.0 else angle
    return -angle if y < 0.0 else angle
