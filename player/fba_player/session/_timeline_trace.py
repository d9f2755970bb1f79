"""What lies behind and above the timeline.

Behind: a graph of the bits of each plane, I planes in another colour, or of the amount of motion. Above: a
lane of the expressions that a face is read to show.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np

from fba.animation import Animation
from fba.arrays import Array, Bool, Float64, UInt8
from fba.codec import StreamInfo
from fba.emotion import Readings, read_expressions
from fba.emotion.recogniser import NEUTRAL, UNKNOWN
from fba.errors import OptionError
from fba.face import FaceSettings
from fba_player.playback._lanes import Lane

PREDICTED = (120, 160, 190)
INTRA = (238, 178, 84)
MIN_HEIGHT = 0.06
"""Least height of a plane, as a share of the full height."""
MIN_GAP_WIDTH = 5
"""Pixels per plane from which there is a gap between planes."""
FRAMES_AT_ONCE = 4096
"""Frames processed at once."""
MAX_READ_FRAMES = 20_000
"""Longer animations are not read: that would take more than some seconds beside the playing."""


@dataclass(frozen=True, eq=False)
class Trace:
    """Amounts (T,), 0 or more, at times (T,) in seconds. intra (T,): which of them are I planes.

    bits: whether amounts are bits of planes; else they are amounts of motion, without a unit.
    """

    amounts: Float64
    intra: Bool
    times: Float64
    bits: bool


def trace_of_planes(info: StreamInfo) -> Trace | None:
    """Return the bits of a stream's planes; None if it has no planes."""
    if info.plane_bits is None or info.plane_intra is None or info.frame_index is None:
        return None
    times = (info.frame_index - info.frame_index[0]) / float(info.rate) + float(info.start)
    return Trace(info.plane_bits.astype(np.float64), info.plane_intra, times, True)


def trace_of_motion(animation: Animation) -> Trace | None:
    """Return how much each frame differs from the one before; None if nothing moves.

    It is the sum over all parameters of the change divided by the range of values in the animation.
    """
    moved = np.zeros(len(animation))
    face, body = animation.face, animation.body
    tables: list[Array] = [] if face is None else [face.values, face.viseme, face.expression]
    tables += [] if body is None else [body.values]
    for values in tables if len(animation) else []:
        spread = values.max(axis=0).astype(np.float64) - values.min(axis=0)
        used = np.flatnonzero(spread)
        for start in range(0, len(moved) - 1, FRAMES_AT_ONCE):
            part = values[start : start + FRAMES_AT_ONCE + 1][:, used].astype(np.float64)
            moved[start + 1 : start + len(part)] += (np.abs(np.diff(part, axis=0)) / spread[used]).sum(axis=1)
    if not moved.any():
        return None
    times = animation.index / float(animation.rate)
    return Trace(moved, np.zeros(len(moved), dtype=bool), times, False)


def trace_picture(trace: Trace, low: float, high: float, size: tuple[int, int]) -> UInt8:
    """Draw a column for each plane, or frame, from time low to high: uint8 (H, W, 4), else transparent.

    size: width and height in pixels. Heights are proportional to the square root of the amounts, so that
    small planes are visible next to large ones. A pixel that several planes share shows the largest.
    """
    width, height = size
    picture = np.zeros((height, width, 4), dtype=np.uint8)
    largest = trace.amounts.max(initial=0.0)
    first = max(int(np.searchsorted(trace.times, low, side="right")) - 1, 0)
    part = slice(first, int(np.searchsorted(trace.times, high, side="right")))
    amounts, intra = trace.amounts[part], trace.intra[part]
    shares = np.clip((trace.times[part] - low) / max(high - low, 1e-9), 0.0, 1.0)
    if not len(amounts) or largest <= 0:
        return picture
    starts = np.clip(np.floor(shares * (width - 1)).astype(int), 0, width - 1)
    tall = np.zeros(width)
    np.maximum.at(tall, starts, amounts)
    owner = np.maximum.accumulate(np.where(tall > 0, np.arange(width), 0))
    key = np.zeros(width, dtype=bool)
    key[starts[intra]] = True
    key = key[owner]
    tall = np.sqrt(tall[owner] / largest)
    tall[tall > 0] = MIN_HEIGHT + (1 - MIN_HEIGHT) * tall[tall > 0]
    filled = np.bincount(starts, minlength=width) > 0
    if width / len(amounts) >= MIN_GAP_WIDTH:
        tall[np.flatnonzero(filled)[1:] - 1] = 0.0
    level = tall * height
    cover = np.clip(level[None, :] - (height - 1 - np.arange(height))[:, None], 0.0, 1.0)
    picture[..., :3] = np.where(key[:, None], INTRA, PREDICTED)
    picture[..., 3] = np.round(cover * np.where(key, 235, 150 if trace.bits else 90))
    return picture


@dataclass(frozen=True, slots=True)
class Stretch:
    """A time in which a face shows the same.

    start, end: seconds of the timeline. label: a family, an expression without one, "neutral" or "unknown".
    intensity: the mean, 0 to 100.
    """

    start: float
    end: float
    label: str
    intensity: float

    @property
    def shows(self) -> bool:
        """Whether it is an expression, not "neutral" or "unknown"."""
        return self.label not in (NEUTRAL, UNKNOWN)

    def __str__(self) -> str:
        return f"{self.label} {self.intensity:.0f}" if self.shows else self.label


def read_stretches(animation: Animation, model: FaceSettings | None) -> tuple[Stretch, ...]:
    """Return the expressions of an animation in order; none without a face, or for a long animation."""
    if animation.face is None or len(animation) > MAX_READ_FRAMES:
        return ()
    try:
        readings = read_expressions(animation, model)
    except OptionError:
        return ()
    return _stretches(readings, float(animation.index[0] / animation.rate), 1 / float(animation.rate))


def lane_of_stretches(stretches: tuple[Stretch, ...]) -> Lane | None:
    """Return the lane of the expressions that a face is read to show; None without any."""
    shown = [stretch for stretch in stretches if stretch.shows]
    if not shown:
        return None
    labels = tuple(dict.fromkeys(stretch.label for stretch in shown))
    return Lane(
        "felt",
        labels,
        np.array([stretch.start for stretch in shown]),
        np.array([stretch.end for stretch in shown]),
        np.array([labels.index(stretch.label) for stretch in shown]),
        np.array([stretch.intensity / 100 for stretch in shown], dtype=np.float32),
        estimated=True,
    )


def _stretches(readings: Readings, begin: float, step: float) -> tuple[Stretch, ...]:
    stretches = []
    pairs = zip(readings.times.tolist(), readings.readings, strict=True)
    groups = [(label, list(group)) for label, group in groupby(pairs, key=lambda pair: pair[1].label)]
    starts = [group[0][0] for _, group in groups] + [readings.times[-1].item() + step]
    for (label, group), (start, end) in zip(groups, pairwise(starts), strict=True):
        intensity = float(np.mean([reading.intensity for _, reading in group]))
        stretches.append(Stretch(begin + start, begin + end, label, intensity))
    return tuple(stretches)
