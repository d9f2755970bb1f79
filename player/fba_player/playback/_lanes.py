"""What is said and felt over time: names with intensities, as they are drawn in lanes of the timeline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fba.animation import Animation
from fba.arrays import Array, Float32, Float64, Int64, UInt8
from fba.parameters import EXPRESSIONS, INTENSITY_MAX, VISEMES

if TYPE_CHECKING:
    from fba.codec import DecodedFrames

JOINED_SECONDS = 1e-6
"""Seconds between two segments of a name that count as none."""
OPACITY = 0.8
"""Opacity of the coloured area of a name."""

Run = tuple[float, float, str]


@dataclass(frozen=True, eq=False)
class Lane:
    """Names with intensities over time, in segments that are sorted by their start.

    name: "visemes", "expressions" or "felt". estimated: whether the names are read from the motion, not sent.
    labels: the names by number. starts, ends: seconds (N,). which: number of the name (N,), int64. shares:
    intensities (N,), 0 to 1.
    """

    name: str
    labels: tuple[str, ...]
    starts: Float64
    ends: Float64
    which: Int64
    shares: Float32
    estimated: bool = False

    @cached_property
    def longest(self) -> float:
        """Seconds of the longest segment."""
        return float((self.ends - self.starts).max(initial=0.0))

    @cached_property
    def runs(self) -> tuple[Float64, Float64, Int64]:
        """Starts (M,), ends (M,) and names (M,) of segments of one name that follow each other, by start."""
        order = np.lexsort((self.starts, self.which))
        starts, ends, which = self.starts[order], self.ends[order], self.which[order]
        new = np.ones(len(order), dtype=bool)
        new[1:] = (which[1:] != which[:-1]) | (starts[1:] > ends[:-1] + JOINED_SECONDS)
        first = np.flatnonzero(new)
        last = np.append(first[1:], len(order)) - 1 if len(order) else first
        joined = starts[first], ends[last], which[first]
        by_start = np.argsort(joined[0], kind="stable")
        return joined[0][by_start], joined[1][by_start], joined[2][by_start]

    def named(self, low: float, high: float, least: float) -> list[Run]:
        """Return (start, end, name) of the visible part, from low to high, of runs that are long enough.

        least: seconds that must be visible.
        """
        starts, ends, which = self.runs
        seen = np.minimum(ends, high) - np.maximum(starts, low) >= max(least, JOINED_SECONDS)
        chosen = np.flatnonzero(seen)
        rows = zip(starts[chosen].tolist(), ends[chosen].tolist(), which[chosen].tolist(), strict=True)
        return [(max(start, low), min(end, high), self.labels[name]) for start, end, name in rows]

    def at(self, time: float) -> list[tuple[str, float]]:
        """Return (name, intensity) at a time in seconds, the strongest first."""
        first, last = np.searchsorted(self.starts, (time - self.longest, time + JOINED_SECONDS))
        part = slice(int(first), int(last))
        now = np.flatnonzero(self.ends[part] > time + JOINED_SECONDS) + part.start
        rows = [(self.labels[int(self.which[row])], float(self.shares[row])) for row in now]
        return sorted(rows, key=lambda row: -row[1])

    def text(self, time: float) -> str:
        """Return the names and intensities at a time as text: "A: 70 %, e 30 %", or "joy 40 of 63"."""
        if self.name == "visemes":
            parts = [f"{name} {share:.0%}" for name, share in self.at(time)]
        elif self.estimated:
            parts = [f"{name} {100 * share:.0f}" for name, share in self.at(time)]
        else:
            most = f"of {INTENSITY_MAX}"
            parts = [f"{name} {INTENSITY_MAX * share:.0f} {most}" for name, share in self.at(time)]
        return ", ".join(parts)


def lane_of_visemes(animation: Animation | DecodedFrames) -> Lane | None:
    """Return the visemes that frames send, with their shares of the blend; None without any.

    As the mouth moves evenly from frame to frame, a viseme begins halfway between the frame that sends it and
    the frame before it.
    """
    face = animation.face
    if face is None:
        return None
    blend = np.clip(face.viseme[:, 2] / np.float32(INTENSITY_MAX), 0.0, 1.0)
    shares = np.stack([blend, 1 - blend], axis=1)
    times = animation.index / float(animation.rate)
    halfway = np.append(times[:1], (times[1:] + times[:-1]) / 2)
    return _lane("visemes", animation, face.mask[:, 0], face.viseme[:, :2], shares, VISEMES, halfway)


def lane_of_expressions(animation: Animation | DecodedFrames) -> Lane | None:
    """Return the expressions that frames send, with their intensities; None without any."""
    face = animation.face
    if face is None:
        return None
    shares = np.clip(face.expression[:, [1, 3]] / np.float32(INTENSITY_MAX), 0.0, 1.0)
    return _lane("expressions", animation, face.mask[:, 1], face.expression[:, [0, 2]], shares, EXPRESSIONS)


def _lane(
    name: str,
    animation: Animation | DecodedFrames,
    sent: Array,
    selected: Array,
    shares: Array,
    labels: Sequence[str],
    begins: Float64 | None = None,
) -> Lane | None:
    """Return the lane of two names in each frame, in force until the next ones are sent.

    sent: (T,). selected, shares: (T, 2). begins: seconds (T,), when what a frame sends is shown; default: its
    time.
    """
    frames = np.flatnonzero(sent)
    if not len(frames):
        return None
    times = animation.index / float(animation.rate)
    starts = (times if begins is None else begins)[frames]
    ends = np.append(starts[1:], times[-1] + 1 / float(animation.rate))
    selected, shares = selected[frames].astype(np.int64), shares[frames].astype(np.float32)
    same = selected[:, 0] == selected[:, 1]  # one name twice
    shares[same, 0] = np.minimum(shares[same].sum(axis=1), 1.0)
    shares[same, 1] = 0.0
    rows, columns = np.nonzero((selected > 0) & (selected < len(labels)) & (shares > 0))
    if not len(rows):
        return None
    return Lane(name, tuple(labels), starts[rows], ends[rows], selected[rows, columns], shares[rows, columns])


def lane_picture(
    lane: Lane, colours: Sequence[tuple[float, ...]], low: float, high: float, size: tuple[int, int]
) -> UInt8:
    """Draw a lane from time low to high: uint8 (H, W, 4), transparent where nothing is said or felt.

    colours: red, green, blue, 0 to 1, by the numbers of the names. size: width and height in pixels. The
    height of a colour is the largest intensity in that pixel; a weaker name stands before a stronger one.
    """
    width, height = size
    first = int(np.searchsorted(lane.starts, low - lane.longest))
    last = int(np.searchsorted(lane.starts, high))
    ends = lane.ends[first:last]
    part = np.flatnonzero(ends > low) + first
    scale = width / max(high - low, 1e-9)
    left = np.clip(np.floor((lane.starts[part] - low) * scale).astype(int), 0, width - 1)
    right = np.clip(np.ceil((lane.ends[part] - low) * scale).astype(int), left + 1, width)
    spans = right - left
    rows = np.repeat(np.arange(len(part)), spans)
    columns = np.arange(len(rows)) - np.repeat(np.cumsum(spans) - spans, spans) + left[rows]
    names, row_of = np.unique(lane.which[part], return_inverse=True)
    levels = np.zeros((len(names), width), dtype=np.float32)
    np.maximum.at(levels, (row_of[rows], columns), lane.shares[part][rows])
    picture = np.zeros((height, width, 4), dtype=np.uint8)
    if not len(names):
        return picture
    share_of_row = (height - np.arange(height)) / height  # of the upper edge of a row of pixels
    covered = levels[:, None, :] + 0.5 / height >= share_of_row[None, :, None]  # (names, H, W)
    front = np.where(covered, levels[:, None, :], np.inf).argmin(axis=0)
    hues = np.array([colours[int(name)][:3] for name in names]) * 255
    picture[..., :3] = np.round(hues[front])
    picture[..., 3] = np.where(covered.any(axis=0), round(255 * OPACITY), 0)
    return picture
