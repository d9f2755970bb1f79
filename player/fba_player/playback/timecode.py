"""Times as people write them."""

from __future__ import annotations

import math
from fractions import Fraction

from fba_player.playback.timeline import FRAME_ROUNDING


def timecode(time: float, rate: Fraction) -> str:
    """ "h:mm:ss:ff" of seconds at a frame rate; see `Transport.timecode`."""
    at = time * rate.numerator / rate.denominator
    nearest = round(at)
    index = nearest if abs(at - nearest) < FRAME_ROUNDING else math.floor(at)
    sign, index = ("-", -index) if index < 0 else ("", index)
    seconds = index * rate.denominator // rate.numerator
    first = -(-seconds * rate.numerator // rate.denominator)
    minutes, seconds = divmod(seconds, 60)
    hours, minutes = divmod(minutes, 60)
    return f"{sign}{hours}:{minutes:02d}:{seconds:02d}:{index - first:02d}"


def clock_text(seconds: float | Fraction) -> str:
    """Seconds as minutes, or hours where there are any: "0:07.040", "1:02:03.500"."""
    thousandths = round(float(seconds) * 1000)
    minutes, rest = divmod(thousandths, 60_000)
    hours, minutes = divmod(minutes, 60)
    text = f"{rest // 1000:02d}.{rest % 1000:03d}"
    return f"{hours}:{minutes:02d}:{text}" if hours else f"{minutes}:{text}"
