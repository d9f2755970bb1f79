"""Speech as low-level FAPs, each sound bent towards its neighbours.

Cohen and Massaro, "Modeling coarticulation in synthetic visual speech", 1993: every sound pulls at each
parameter with a dominance that falls off exponentially from its centre. Jaw and lips have gains of their
own: Edwards et al., "JALI: an animator-centric viseme model for expressive lip synchronization", 2016.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

from fba.arrays import Bool, Float32, Float64
from fba.errors import OptionError
from fba.face import Definitions
from fba.parameters import FAP_COUNT, fap_numbers
from fba.speech._sounds import Shape
from fba.tracks import FaceTrack

REACH = 0.4
"""Seconds from its centre at which a sound pulls no longer."""
FALL = 18.0
"""How fast the pull falls, per second: at the default, to a half within 0.04 s."""
ROUNDED, AHEAD_FALL = (13, 14), 8.0
"""Visemes that round the lips, and how slowly their pull on the lips rises before them."""
REST_PULL = 0.06
"""Pull towards the neutral face, everywhere."""
CLOSURES = {1: 0.020, 2: 0.010, 3: 0.010}
"""Visemes at which lips, lip and teeth, or tongue and teeth must meet; seconds on each side of the centre for
which they do."""
TONGUE_BETWEEN_TEETH = 3
"""The viseme whose closure leaves it to its neighbours whether lips are rounded or spread."""
RELEASE = 0.035
"""Seconds before and after that within which the lips part."""


@dataclass(frozen=True)
class Style:
    """How clearly somebody speaks. jaw, lips: gains of what opens and what rounds or spreads, 0 to 2.

    Raises OptionError for others.
    """

    jaw: float = 1.0
    lips: float = 1.0

    def __post_init__(self) -> None:
        for name, gain in (("jaw", self.jaw), ("lips", self.lips)):
            if not 0 <= gain <= 2:
                raise OptionError(f"style: the gain of {name} must lie in 0..2, not {gain}")

    @property
    def gains(self) -> Float64:
        """Of each FAP (68,)."""
        return np.where(_columns("rounding"), self.lips, np.where(_columns("jaw"), self.jaw, 1.0))


def find_style(clarity: float) -> Style:
    """Return the style of a clarity from 0, mumbled, by 0.5, normal, to 1, overarticulated."""
    jaw, lips = (float(np.interp(clarity, (0, 0.5, 1), gains)) for gains in ((0.35, 1, 1.5), (0.5, 1, 1.4)))
    return Style(jaw, lips)


def _columns(part: str) -> Bool:
    """Return which FAPs (68,) a part moves: "jaw" with the lips that go with it, or "rounding"."""
    names = fap_numbers()
    result = np.zeros(FAP_COUNT, dtype=bool)
    for name, number in names.items():
        is_jaw = (
            name in ("open_jaw", "depress_chin") or "midlip" in name or "_lip_l" in name or "_lip_r" in name
        )
        rounds = name.startswith(("stretch", "push"))
        result[number - 1] = {"jaw": is_jaw, "rounding": rounds}[part]
    return result


def coarticulate(
    shapes: Sequence[Shape],
    rate: Fraction,
    count: int,
    *,
    style: Style = Style(),
    definitions: Definitions | None = None,
) -> FaceTrack:
    """Return a track of `count` frames of the FAPs that visemes move; frame n is at n / rate seconds."""
    table = (definitions or Definitions.default()).visemes
    moved = table.any(axis=0)
    values = _blend(shapes, rate, count, table)
    _close(values, shapes, rate, table)
    result = style.gains * values
    closed = _closures(shapes, rate, count)
    result = result + (values - result) * closed[:, None]
    mask = np.zeros((count, FAP_COUNT), dtype=bool)
    mask[:, moved] = True
    return FaceTrack(np.rint(result).astype(np.int32), mask)


def _blend(shapes: Sequence[Shape], rate: Fraction, count: int, table: Float32) -> Float64:
    """Return the dominance-weighted mean (T, 68) of the shapes."""
    rounding = _columns("rounding")
    totals = np.zeros((count, FAP_COUNT))
    weights = np.full((count, FAP_COUNT), REST_PULL)
    frames = float(rate)
    for shape in shapes:
        half = (shape.end - shape.start) / 2
        first = max(int(np.ceil((shape.start - REACH) * frames)), 0)
        last = min(int((shape.end + REACH) * frames) + 1, count)
        if first >= last:
            continue
        offset = np.arange(first, last) / frames - shape.centre
        beyond = np.maximum(np.abs(offset) - half * 0.5, 0.0)
        pull = shape.weight * np.exp(-FALL * beyond)
        both = np.repeat(pull[:, None], FAP_COUNT, axis=1)
        if shape.viseme in ROUNDED:
            ahead = shape.weight * np.exp(-np.where(offset < 0, AHEAD_FALL, FALL) * beyond)
            both[:, rounding] = ahead[:, None]
        totals[first:last] += both * (shape.size * table[shape.viseme])
        weights[first:last] += both
    blended: Float64 = totals / weights
    return blended


def _closures(shapes: Sequence[Shape], rate: Fraction, count: int) -> Float64:
    """Return how much each frame (T,) belongs to a closure, 0 to 1."""
    share = np.zeros(count)
    for shape in shapes:
        for first, weights in _closure_frames(shape, rate, count):
            np.maximum(share[first : first + len(weights)], weights, out=share[first : first + len(weights)])
    return share


def _close(values: Float64, shapes: Sequence[Shape], rate: Fraction, table: Float32) -> None:
    """Let lips, teeth and tongue meet at closures, whatever is beside them. The nearest frame is closed."""
    for shape in shapes:
        for first, weights in _closure_frames(shape, rate, len(values)):
            part = values[first : first + len(weights)]
            change = weights[:, None] * (table[shape.viseme] - part)
            if shape.viseme == TONGUE_BETWEEN_TEETH:
                change[:, _columns("rounding")] = 0
            part += change


def _closure_frames(shape: Shape, rate: Fraction, count: int) -> list[tuple[int, Float64]]:
    """Return the first frame and the shares (N,) of a closure, or nothing."""
    hold = CLOSURES.get(shape.viseme)
    if hold is None:
        return []
    frames = float(rate)
    hold = min(max(hold, 0.25 * (shape.end - shape.start)), 0.06)
    first = max(int(np.ceil((shape.centre - hold - RELEASE) * frames)), 0)
    last = min(int((shape.centre + hold + RELEASE) * frames) + 1, count)
    nearest = round(shape.centre * frames)
    first, last = min(first, max(nearest, 0)), max(last, min(nearest + 1, count))
    if first >= last:
        return []
    away = np.abs(np.arange(first, last) / frames - shape.centre)
    weights = np.clip(1 - (away - hold) / RELEASE, 0, 1)
    if first <= nearest < last:
        weights[nearest - first] = 1.0
    return [(first, weights)]
