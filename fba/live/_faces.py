"""`FaceConversion`: ordered samples of a sender to frames of a face."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction

import numpy as np

from fba.animation import Animation
from fba.arrays import Float64
from fba.capture.live import LiveBlendshapes
from fba.live._order import Timed
from fba.live._protocols.sample import DatagramError, Sample
from fba.live._summary import Summary
from fba.sampling import GAP
from fba.tracks import FaceTrack

SWAPPED = {
    "mouthLeft": "mouthRight", "mouthRight": "mouthLeft", "jawLeft": "jawRight", "jawRight": "jawLeft",
}  # fmt: skip

Row = tuple[Float64, Float64, Float64]
"""Weights (N,), angles of the head (3,) and of the eyes (4,); angles that a sender lacks are 0."""


class FaceConversion:
    """Converts samples with weights to frames.

    rate: frames per second. sent_rate: the sender's. swap: exchanges mouthLeft and mouthRight, jawLeft and
    jawRight. neutral: seconds from the first face; their median is the neutral face, which is subtracted, and
    no frame comes out before they are over. By default nothing is subtracted. summary: counts events.
    """

    def __init__(
        self, rate: Fraction, sent_rate: Fraction, *, swap: bool, neutral: float | None, summary: Summary
    ) -> None:
        self._rate = rate
        self._sent_rate = sent_rate
        self._swap = swap
        self._neutral_seconds = neutral
        self._summary = summary
        self._frames: LiveBlendshapes | None = None
        self._neutral: Row | None = None
        self._waiting: list[tuple[float, Row]] = []
        self._last: float | None = None

    def push(self, timed: Timed) -> Iterator[Animation]:
        """Add a sample; yield the frames that are complete."""
        time, sample = timed
        if sample.weights is None:
            self._summary.unseen += 1
            return
        self._summary.used += 1
        if self._last is not None and (time - self._last) * float(self._sent_rate) >= GAP:
            self._summary.gaps += 1
            self._summary.longest_gap = max(self._summary.longest_gap, time - self._last)
        self._last = time
        frames, row = self._begun(sample), self._row(sample)
        if self._neutral_seconds is None or self._neutral is not None:
            yield from frames.push(time, *self._without_neutral(row))
            return
        self._waiting.append((time, row))
        if time - self._waiting[0][0] >= self._neutral_seconds:
            yield from self._find_neutral(frames)

    def settle(self) -> Iterator[Animation]:
        """Yield nothing: `push` has already yielded all complete frames."""
        yield from ()

    def finish(self) -> Iterator[Animation]:
        """Yield the remaining frames."""
        if self._frames is not None:
            if self._waiting:
                yield from self._find_neutral(self._frames)
            yield from self._frames.finish()

    def show(self, sample: Sample) -> tuple[FaceTrack | None, None]:
        """Return the FAPs of a sample, a track of one frame; None without a face."""
        if sample.weights is None or self._frames is None or self._waiting:
            return None, None
        return self._frames.show(*self._without_neutral(self._row(sample))), None

    def _begun(self, sample: Sample) -> LiveBlendshapes:
        """Return the converter, made for the names in the first sample."""
        if self._frames is None:
            names = [SWAPPED.get(name, name) for name in sample.names] if self._swap else list(sample.names)
            if self._swap:
                self._summary.notes.append("mouthLeft/mouthRight and jawLeft/jawRight changed places")
            self._frames = LiveBlendshapes(names, self._rate)
        return self._frames

    def _row(self, sample: Sample) -> Row:
        weights = sample.weights
        if weights is None or len(weights) != len(self._begun(sample).names):
            raise DatagramError("with other shapes than the first")
        return (
            weights,
            np.zeros(3) if sample.head is None else sample.head,
            np.zeros(4) if sample.eyes is None else sample.eyes,
        )

    def _find_neutral(self, frames: LiveBlendshapes) -> Iterator[Animation]:
        """Set the neutral face to the median of the waiting samples, and yield their frames."""
        waiting, self._waiting = self._waiting, []
        weights, head, eyes = (
            np.median(parts, axis=0) for parts in zip(*(row for _, row in waiting), strict=True)
        )
        self._neutral = (weights, head, eyes)
        self._summary.notes.append(
            f"the median of the first {waiting[-1][0] - waiting[0][0]:.2f} s is the neutral face, subtracted"
        )
        for time, row in waiting:
            yield from frames.push(time, *self._without_neutral(row))

    def _without_neutral(self, row: Row) -> Row:
        if self._neutral is None:
            return row
        weights, head, eyes = (part - still for part, still in zip(row, self._neutral, strict=True))
        return np.maximum(weights, 0.0), head, eyes
