"""The graph behind the timeline: bits of each plane, I planes in another colour, or amount of motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.animation import Animation
from fba.arrays import Array, Bool, Float64, UInt8
from fba.codec import StreamInfo

PREDICTED = (120, 160, 190)
INTRA = (238, 178, 84)
MIN_HEIGHT = 0.06
"""Least height of a plane, as a share of the full height."""
MIN_GAP_WIDTH = 5
"""Pixels per plane from which there is a gap between planes."""
ROWS = 4096
"""Frames processed at once."""


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
        for start in range(0, len(moved) - 1, ROWS):
            part = values[start : start + ROWS + 1][:, used].astype(np.float64)
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
    amounts, shares = trace.amounts, np.clip((trace.times - low) / max(high - low, 1e-9), 0.0, 1.0)
    if not len(amounts) or amounts.max() <= 0:
        return picture
    starts = np.clip(np.floor(shares * (width - 1)).astype(int), 0, width - 1)
    tall = np.zeros(width)
    np.maximum.at(tall, starts, amounts)
    owner = np.maximum.accumulate(np.where(tall > 0, np.arange(width), 0))
    key = np.zeros(width, dtype=bool)
    key[starts[trace.intra]] = True
    key = key[owner]
    tall = np.sqrt(tall[owner] / amounts.max())
    tall[tall > 0] = MIN_HEIGHT + (1 - MIN_HEIGHT) * tall[tall > 0]
    filled = np.bincount(starts, minlength=width) > 0
    if width / len(amounts) >= MIN_GAP_WIDTH:
        tall[np.flatnonzero(filled)[1:] - 1] = 0.0
    level = tall * height
    cover = np.clip(level[None, :] - (height - 1 - np.arange(height))[:, None], 0.0, 1.0)
    picture[..., :3] = np.where(key[:, None], INTRA, PREDICTED)
    picture[..., 3] = np.round(cover * np.where(key, 235, 150 if trace.bits else 90))
    return picture
