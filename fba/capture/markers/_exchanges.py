"""Markers that exchange their names in the middle of a take, as trackers confuse close ones."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64

MIN_JUMP = 0.05
"""Smallest jump, relative to the others, of a marker that takes another's name, in sizes of the face."""
MAX_EXCHANGED_RATIO = 0.4
"""Largest ratio of the distances of two exchanged markers from each other's last places to the distances from
their own."""
MAX_JUMPS = 20
"""Largest number of markers that jump in a frame; more are a cut, or another take."""
SAMPLE_FRAMES = 100
"""Approximate number of frames from which the face's size is measured."""
MAX_EXCHANGES = 200
"""Largest number of exchanges in a take; more are noise, and none is undone."""


@dataclass(frozen=True)
class Exchange:
    """Two markers that exchange their names in a frame."""

    frame: int
    one: str
    other: str


def undo_exchanges(names: tuple[str, ...], positions: Float64) -> tuple[Float64, list[Exchange]]:
    """Return positions (T, M, 3) with exchanges undone, and the exchanges in order.

    positions: NaN for gaps, in any unit of length.
    """
    limit = MIN_JUMP * _size(positions[:: max(1, len(positions) // SAMPLE_FRAMES)])
    steps = np.diff(positions, axis=0)
    far = (steps**2).sum(axis=2) > limit**2  # not where a step is NaN
    fixed, found = positions, []
    for frame in np.flatnonzero(far.sum(axis=1) >= 2).tolist():
        usual = np.nanmedian(steps[frame], axis=0)  # the head's own motion
        rows = np.flatnonzero(np.linalg.norm(steps[frame] - usual, axis=1) > limit)
        if not 2 <= len(rows) <= MAX_JUMPS:
            continue
        before, after = fixed[frame, rows] + usual, fixed[frame + 1, rows]
        apart = np.linalg.norm(after[:, None] - before[None], axis=2)
        own = np.diag(apart)
        together = apart + apart.T
        together[np.diag_indices(len(rows))] = np.inf
        for a in range(len(rows)):
            b = int(together[a].argmin())
            if (
                b > a
                and together[a, b] < MAX_EXCHANGED_RATIO * (own[a] + own[b])
                and int(together[b].argmin()) == a
            ):
                if fixed is positions:
                    fixed = positions.copy()
                one, other = int(rows[a]), int(rows[b])
                fixed[frame + 1 :, [one, other]] = fixed[frame + 1 :, [other, one]]
                found.append(Exchange(frame + 1, names[one], names[other]))
                if len(found) > MAX_EXCHANGES:
                    return positions, []
    return fixed, found


def _size(positions: Float64) -> float:
    """Return the median distance of the markers from their middle; 0 where none is seen."""
    seen = ~np.isnan(positions[..., 0])
    middle = np.where(seen[..., None], positions, 0.0).sum(axis=1) / np.maximum(seen.sum(axis=1), 1)[:, None]
    away = np.linalg.norm(positions - middle[:, None], axis=2)
    return float(np.median(away[seen])) if seen.any() else 0.0
