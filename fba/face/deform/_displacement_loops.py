"""Loops over the vertices that two sets of FAPs put in different places, compiled (see `fba.compiled`).

Bounds: as in `fba.face.deform._loops`; the number of a distance is limited before it becomes an integer.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Float32, Float64, Int64
from fba.compiled import compiled
from fba.face.deform._loops import transform_points
from fba.face.deform.flat_tables import MovingMesh, Shifts


class Scratch(NamedTuple):
    """Working arrays for one frame: (V, 3) twice, and a pose (3, 4) of 32 bits."""

    one: Float32
    other: Float32
    pose: Float32


def allocate_scratch(vertices: int) -> Scratch:
    """Return working arrays for a face of this number of vertices."""
    one, other = np.zeros((2, vertices, 3), dtype=np.float32)
    return Scratch(one, other, np.zeros((3, 4), dtype=np.float32))


@compiled
def find_interval(shifts: Shifts, track: int, value: float) -> int:
    """Return the interval of a track that a value is in."""
    interval, last = int(shifts.first[track]), int(shifts.first[track + 1]) - 1
    while interval < last and value > shifts.upper[interval]:
        interval += 1
    return interval


@compiled
def _add(shifts: Shifts, interval: int, steps: float, sign: float, moved: Float32) -> None:
    """Add `steps` steps along an interval's slopes and, unless sign is 0, sign times its bases."""
    start, stop = int(shifts.start[interval]), int(shifts.start[interval + 1])
    rows, slopes = shifts.rows[start:stop], shifts.slopes[start:stop]
    amount = np.float32(steps)
    for k in range(len(rows)):
        i = rows[k]
        moved[i, 0] += amount * slopes[k, 0]
        moved[i, 1] += amount * slopes[k, 1]
        moved[i, 2] += amount * slopes[k, 2]
    base = int(shifts.base[interval])
    if base < 0 or sign == 0.0:
        return
    bases = shifts.bases[base : base + stop - start]
    factor = np.float32(sign)
    for k in range(len(rows)):
        i = rows[k]
        moved[i, 0] += factor * bases[k, 0]
        moved[i, 1] += factor * bases[k, 1]
        moved[i, 2] += factor * bases[k, 2]


@compiled
def _add_value(shifts: Shifts, track: int, value: float, sign: float, moved: Float32) -> None:
    """Add to vertices sign times the shifts of a track at a value."""
    if value == 0.0:
        return
    interval = find_interval(shifts, track, value)
    _add(shifts, interval, sign * (value - shifts.anchor[interval]), sign, moved)


@compiled
def _add_part(shifts: Shifts, part: int, one: Float64, other: Float64, apart: bool, scratch: Scratch) -> bool:
    """Add a part's shifts by FAPs `one` less `other`; return whether any differs. apart: to two arrays."""
    differs = False
    for track in range(len(shifts.column)):
        if shifts.part[track] != part:
            continue
        first, second = one[shifts.column[track]], other[shifts.column[track]]
        if apart:
            _add_value(shifts, track, first, 1.0, scratch.one)
            _add_value(shifts, track, second, 1.0, scratch.other)
        elif first != second:
            differs = True
            interval = find_interval(shifts, track, first)
            if interval == find_interval(shifts, track, second):
                _add(shifts, interval, first - second, 0.0, scratch.one)
            else:
                _add_value(shifts, track, first, 1.0, scratch.one)
                _add_value(shifts, track, second, -1.0, scratch.one)
    return differs


@compiled
def measure_frames(
    pair: Float64,
    poses: Float64,
    mesh: MovingMesh,
    scratch: Scratch,
    farthest: tuple[Float64, Int64],
    unit: float,
    counts: Int64,
) -> None:
    """Measure how far vertices are apart, in the head's frame, by FAPs `pair` (2, T, 68).

    poses: (2, T, P + 1, 3, 4) as of `poses_of_frames`. farthest: (T,) each, set to the largest distance in a
    frame, metres, and its vertex. counts: int64 (B,), raised for every vertex that moved: the number n for up
    to n units, the last one for all beyond.
    """
    largest, worst = farthest
    part_start, shifts = mesh.part_start, mesh.shifts
    for frame in range(pair.shape[1]):
        one, other = pair[0, frame], pair[1, frame]
        most, place = 0.0, 0
        for part in range(len(part_start) - 1):
            start, stop = int(part_start[part]), int(part_start[part + 1])
            first, second = scratch.one[start:stop], scratch.other[start:stop]
            turned = False
            own, others = poses[0, frame, part], poses[1, frame, part]
            for row in range(3):
                for column in range(4):
                    turned = (
                        turned or poses[0, frame, part, row, column] != poses[1, frame, part, row, column]
                    )
            if turned:
                first[:], second[:] = mesh.rest[start:stop], mesh.rest[start:stop]
                _add_part(shifts, part, one, other, True, scratch)
                scratch.pose[:] = others
                transform_points(scratch.pose, second, second)
            else:
                first[:] = 0
                if not _add_part(shifts, part, one, other, False, scratch):
                    continue
            scratch.pose[:] = own
            if not turned:  # a difference has no place
                scratch.pose[:, 3] = 0
            transform_points(scratch.pose, first, first)
            if turned:
                for v in range(len(first)):
                    first[v, 0] -= second[v, 0]
                    first[v, 1] -= second[v, 1]
                    first[v, 2] -= second[v, 2]
            for v in range(len(first)):
                x, y, z = first[v, 0], first[v, 1], first[v, 2]
                squared = x * x + y * y + z * z
                if squared > 0:
                    distance = np.sqrt(np.float64(squared))
                    units = distance / unit  # infinite where vertices are too far apart for their squares
                    counts[int(units) + 1 if units < len(counts) - 2 else len(counts) - 1] += 1
                    if distance > most:
                        most, place = distance, start + v
        largest[frame], worst[frame] = most, place
