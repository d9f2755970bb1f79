"""Gaps in the paths of markers, filled by splines if they are short, else by neighbours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64
from fba.errors import warn
from fba.name_maps import list_names

MAX_SPLINE_SECONDS = 0.2
"""Longest gap, in seconds, that the path of the marker fills."""
NEIGHBOURS = 4
"""Number of nearest markers on the face whose motion fills a longer gap."""
MIN_SEEN_SHARE = 0.1
"""Smallest share of the frames in which a marker must be seen."""


@dataclass(frozen=True)
class Filled:
    """Filled gaps. short, long: numbers of them. longest: the longest in seconds, of `marker`."""

    short: int
    long: int
    longest: float
    marker: str


def often_seen(names: tuple[str, ...], seen: Bool) -> tuple[str, ...]:
    """Return the markers that are seen in enough frames. Warns of others. seen: (T, M)."""
    often = seen.mean(axis=0) >= MIN_SEEN_SHARE
    rare = [name for name, kept in zip(names, often, strict=True) if not kept]
    if rare:
        warn(
            f"seen in less than {MIN_SEEN_SHARE:.0%} of the frames, and left out: {list_names(rare)}",
            stacklevel=4,
        )
    return tuple(name for name in names if name not in rare)


def find_gaps(seen: Bool) -> list[tuple[int, int]]:
    """Return (first frame, frame after the last) of each gap. seen: bool (T,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[True], seen, [True]]).astype(np.int8)))
    return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]


def fill_gaps(names: tuple[str, ...], positions: Float64, times: Float64) -> tuple[Float64, Filled]:
    """Return positions without gaps, and what was filled.

    positions: float64 (T, M, 3), relative to the head; every marker is seen at least once. In a gap of up to
    `MAX_SPLINE_SECONDS`, the path is a cubic through its ends, with their speeds. In a longer gap, and at
    both ends of the take, the marker moves as its nearest neighbours do, and arrives where it is seen again.
    """
    filled = positions.copy()
    seen = ~np.isnan(positions[..., 0])
    rest = np.array([np.median(positions[seen[:, m], m], axis=0) for m in range(len(names))])
    gappy: list[int] = np.flatnonzero(~seen.all(axis=0)).tolist()
    gaps = [(m, start, end) for m in gappy for start, end in find_gaps(seen[:, m])]
    short = long = 0
    longest, whose = 0.0, ""
    late = []
    for marker, start, end in gaps:
        inner = start > 0 and end < len(times)
        length = float(times[min(end, len(times) - 1)] - times[max(start - 1, 0)])
        if length > longest:
            longest, whose = length, names[marker]
        if inner and length <= MAX_SPLINE_SECONDS:
            short += 1
            filled[start:end, marker] = _cubic(positions[:, marker], times, start, end)
        else:
            long += 1
            late.append((marker, start, end))
    there = ~np.isnan(filled[..., 0])
    moved = filled - rest
    for marker, start, end in late:
        near = np.argsort(np.linalg.norm(rest - rest[marker], axis=1), kind="stable")[1:].tolist()
        filled[start:end, marker] = rest[marker] + _as_neighbours(
            moved, there, near, times, marker, start, end
        )
    return filled, Filled(short, long, longest, whose)


def _cubic(path: Float64, times: Float64, start: int, end: int) -> Float64:
    """Return the path in a gap: a cubic from the frame before to the frame after, with their speeds."""
    a, b = start - 1, end
    span = times[b] - times[a]

    def speed(at: int, other: int) -> Float64:
        if 0 <= other < len(path) and not np.isnan(path[other, 0]):
            return np.asarray((path[at] - path[other]) / (times[at] - times[other]))
        return np.asarray((path[b] - path[a]) / span)

    u = ((times[start:end] - times[a]) / span)[:, None]
    into, out = speed(a, a - 1) * span, speed(b, b + 1) * span
    return np.asarray(
        (2 * u**3 - 3 * u**2 + 1) * path[a] + (u**3 - 2 * u**2 + u) * into
        + (3 * u**2 - 2 * u**3) * path[b] + (u**3 - u**2) * out
    )  # fmt: skip


def _as_neighbours(
    moved: Float64, there: Bool, near: list[int], times: Float64, marker: int, start: int, end: int
) -> Float64:
    """Return displacements of a marker in a gap: it moves as its neighbours and meets both ends."""
    first, last = max(start - 1, 0), min(end, len(times) - 1)
    window = slice(first, last + 1)
    chosen = [m for m in near if there[window, m].all()][:NEIGHBOURS]
    steps = moved[window, chosen].mean(axis=1) if chosen else np.zeros((last + 1 - first, 3))
    off = [moved[at, marker] - steps[at - first] for at in (start - 1, end) if 0 <= at < len(times)]
    if len(off) == 2:
        share = ((times[window] - times[first]) / (times[last] - times[first]))[:, None]
        steps = steps + off[0] * (1 - share) + off[1] * share
    elif off:
        steps = steps + off[0]
    return steps[start - first : end - first]


def warn_of_gaps(filled: Filled) -> None:
    """Warn of long gaps."""
    if filled.long:
        warn(
            f"{filled.long} long gaps are filled by neighbouring markers, the longest {filled.longest:.2f} s "
            f"of {filled.marker}" + (f"; {filled.short} short ones by splines" if filled.short else ""),
            stacklevel=4,
        )
