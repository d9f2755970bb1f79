"""`perform`: an animation that shows an expression, eased in and out."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import get_args

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64, Int16
from fba.choices import Sending
from fba.emotion.blending import Blend
from fba.errors import OptionError
from fba.parameters import FIRST_LOW_LEVEL_FAP, fill_from_mates
from fba.sampling import smoothstep
from fba.tracks import FaceTrack

SENDING: tuple[Sending, ...] = get_args(Sending)
"""How an expression is sent: by FAP 2 where possible, by FAP 2, by low-level FAPs."""
MAX_FRAMES = 10_000_000


def animate(
    blend: Blend,
    *,
    seconds: float = 0.0,
    ease: float = 0.0,
    rate: Fraction | int = 25,
    send: Sending = "auto",
) -> Animation:
    """Return an animation that shows an expression: eased in, held, eased out.

    seconds: its length; 0 for one frame at full intensity. ease: seconds from neutral to the expression, and
    back; at most half the length. rate: frames/s. send: one of `SENDING`; for FAP 2, a face shows its own
    definitions, and adds up two expressions.

    Raises OptionError where these contradict each other, or FAP 2 cannot show the expression.
    """
    for name, value in (("seconds", seconds), ("ease", ease)):
        if not math.isfinite(value) or value < 0:
            raise OptionError(f"{name} must be a number of at least 0, not {value:g}")
    if 2 * ease > seconds:
        raise OptionError(f"easing in and out takes {2 * ease:g} s, but the animation has only {seconds:g} s")
    if send not in SENDING:
        raise OptionError(f"send must be one of {', '.join(SENDING)}, not {send!r}")
    if seconds * float(rate) > MAX_FRAMES:
        raise OptionError(f"{seconds:g} s at {float(rate):g} frames/s are more than {MAX_FRAMES} frames")
    count = max(1, round(seconds * Fraction(rate)))
    strength = intensity_curve(count, rate, ease)
    fields = blend.fields
    if fields is None and send == "expression":
        raise OptionError(f"FAP 2 cannot show {blend}, but only one or two of its six expressions")
    if fields is not None and send != "faps":
        face = _by_expression(fields, strength)
    else:
        face = _by_faps(blend, strength)
    return Animation(Fraction(rate), np.arange(count), face, name=str(blend)[:100])


def intensity_curve(count: int, rate: Fraction | int, ease: float) -> Float64:
    """Return the share of the expression in each frame: float64 (count,), 0 to 1, smooth at both ends."""
    if not ease:
        return np.ones(count)
    times = np.arange(count) / float(rate)
    end = (count - 1) / float(rate)
    return smoothstep(np.minimum(times, end - times) / min(ease, end / 2 or 1.0))


def _by_expression(fields: Int16, strength: Float64) -> FaceTrack:
    track = FaceTrack.empty(len(strength))
    mask, expression = track.mask.copy(), np.zeros((len(strength), 6), dtype=np.int16)
    mask[:, 1] = True
    expression[:, [0, 2]] = fields[[0, 2]]
    expression[:, [1, 3]] = np.rint(strength[:, None] * fields[[1, 3]])
    return FaceTrack(track.values, mask, expression=expression)


def _by_faps(blend: Blend, strength: Float64) -> FaceTrack:
    """Return a track of the FAPs that move, and those that would otherwise copy one of them."""
    values = np.rint(strength[:, None].astype(np.float32) * blend.faps).astype(np.int32)
    moving = blend.faps != 0
    copies = fill_from_mates(blend.faps, moving)[1]
    copies[: FIRST_LOW_LEVEL_FAP - 1] = False
    return FaceTrack(values, np.broadcast_to(copies, values.shape))
