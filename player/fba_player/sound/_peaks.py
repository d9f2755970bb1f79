"""The outline of a sound over time: its lowest and highest samples, computed once, in the background."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fba.arrays import Array, UInt8
from fba.atomic import PathLike
from fba.errors import FbaError
from fba_player.view.protocols import Closing

if TYPE_CHECKING:
    from fba.audio import SoundFile

BUCKETS_PER_SECOND = 100
"""Pairs of lowest and highest samples in a second, at first."""
MOST_BUCKETS = 1 << 20
"""Pairs in memory, 2 MiB: 2.9 hours. In longer sounds neighbours are joined, as often as needed."""
BUCKETS_AT_ONCE = 2048
"""Pairs read at once, about 20 seconds."""
QUIETEST = 0.04
"""Peak, of 1, of a sound that fills its lane; softer ones stay lower."""


@dataclass(frozen=True, eq=False)
class Outline:
    """Lowest and highest samples, int8 (N,), -127 to 127. seconds: of a pair. whole: whether all is read."""

    seconds: float
    low: Array
    high: Array
    whole: bool = False


class Peaks(Closing):
    """Reads the outline of a sound file in its own thread; `outline` has what is read so far.

    path: anything that FFmpeg reads. A file that cannot be read has an empty outline.
    """

    def __init__(self, path: PathLike) -> None:
        self._path = path
        self._stopped = threading.Event()
        empty = np.zeros(0, dtype=np.int8)
        self.outline = Outline(1 / BUCKETS_PER_SECOND, empty, empty)
        self._thread = threading.Thread(target=self._run, name="fba peaks", daemon=True)

    def start(self, *, wait: bool = False) -> None:
        """Begin to read; with `wait`, return when all is read."""
        self._thread.start()
        if wait:
            self._thread.join()

    @property
    def reading(self) -> bool:
        """Whether more will come."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Stop reading; safe to call twice."""
        self._stopped.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        try:
            from fba.audio import SoundFile

            with SoundFile(self._path) as file:
                self._read(file)
        except (FbaError, OSError):
            return  # whoever plays it says why

    def _read(self, file: SoundFile) -> None:
        size = max(round(file.rate / BUCKETS_PER_SECOND), 1)
        count, start, joined = size * BUCKETS_AT_ONCE, 0, 1
        while not self._stopped.is_set():
            samples = file.read(start, count)
            start += len(samples)
            lows, highs = _pairs(samples, size)
            now = self.outline
            lows = np.concatenate([now.low, _join(lows, joined, np.minimum)])
            highs = np.concatenate([now.high, _join(highs, joined, np.maximum)])
            if len(lows) > MOST_BUCKETS:
                joined *= 2
                lows, highs = _join(lows, 2, np.minimum), _join(highs, 2, np.maximum)
            whole = len(samples) < count
            self.outline = Outline(joined * size / file.rate, lows, highs, whole)
            if whole:
                return


def peaks_picture(
    outline: Outline, colour: tuple[float, ...], low: float, high: float, size: tuple[int, int]
) -> UInt8:
    """Draw an outline from second low to high of the sound: uint8 (H, W, 4), transparent around it.

    colour: red, green, blue, 0 to 1. size: width and height in pixels. The loudest sample fills the height.
    """
    width, height = size
    picture = np.zeros((height, width, 4), dtype=np.uint8)
    picture[..., :3] = np.round(np.array(colour[:3]) * 255)
    count = len(outline.low)
    edges = np.floor(np.linspace(low, high, width + 1) / outline.seconds).astype(int)
    seen = (edges[1:] > 0) & (edges[:-1] < count)
    if not count or not seen.any():
        return picture
    starts = np.clip(edges[:-1][seen], 0, count - 1)
    stop = min(int(edges[1:][seen].max()) + 1, count)
    lows = np.minimum.reduceat(outline.low[:stop].astype(int), starts)
    highs = np.maximum.reduceat(outline.high[:stop].astype(int), starts)
    loudest = max(-int(outline.low.min()), int(outline.high.max()), round(127 * QUIETEST), 1)
    rows = np.arange(height)[:, None]
    top = (1 - np.maximum(highs, 0) / loudest) * (height - 1) / 2
    bottom = (1 - np.minimum(lows, 0) / loudest) * (height - 1) / 2
    picture[:, seen, 3] = np.where((rows >= np.floor(top)) & (rows <= np.ceil(bottom)), 200, 0)
    return picture


def _pairs(samples: Array, size: int) -> tuple[Array, Array]:
    """Return the lowest and highest of every `size` samples (N, channels), int8."""
    if not len(samples):
        return np.zeros(0, dtype=np.int8), np.zeros(0, dtype=np.int8)
    starts = np.arange(0, len(samples), size)
    lowest = np.minimum.reduceat(samples.min(axis=1), starts)
    highest = np.maximum.reduceat(samples.max(axis=1), starts)
    low, high = (np.clip(np.rint(one / 258), -127, 127).astype(np.int8) for one in (lowest, highest))
    return low, high


def _join(values: Array, count: int, extreme: np.ufunc) -> Array:
    """Return the extreme of every `count` values."""
    if count == 1 or not len(values):
        return values
    return np.asarray(extreme.reduceat(values, np.arange(0, len(values), count)))
