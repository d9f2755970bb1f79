"""Distances of a face's vertices between two sets of FAPs, and how far one step of each FAP moves them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Int64
from fba.face.deform._deformer import Deformer, frame_values
from fba.face.deform.flat_tables import KIND_ORDER, Shifts, Transforms
from fba.face.model import FaceModel
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP

FRAMES_PER_CALL = 256
"""Frames per call of the compiled loop: Ctrl-C takes effect between calls only."""
VERTEX_BLOCK = 16
"""Frames whose vertices are in memory at once."""
BINS = 4000
"""Bins of the histogram of distances, up to `MAX_DISTANCE`."""
MAX_DISTANCE = 0.02
"""Metres: larger percentiles are given as this."""
LINEAR_REACH = 100
"""Value of a FAP, both ways, between which its effect counts as linear."""


@dataclass(frozen=True, eq=False)
class Displacements:
    """Distances between the vertices that two sequences of FAPs give, in the frame of the head.

    largest: float64 (T,), metres, in each frame; worst: int64 (T,), its vertex. counts: int64 (B,), how
    often any vertex was so far off, in bins of MAX_DISTANCE / BINS, vertices that did not move in the first.
    """

    largest: Float64
    worst: Int64
    counts: Int64

    def percentile(self, percent: float) -> float:
        """Return the distance, metres, within which this percentage of movable vertices is, in all frames."""
        wanted = percent / 100 * self.counts.sum()
        number = int(np.searchsorted(np.cumsum(self.counts), wanted))
        return number * MAX_DISTANCE / BINS


class DisplacementMeter:
    """Measures how far vertices are apart, much faster than two calls of `Deformer.local`.

    Only what differs is computed: a vertex is where `Deformer.local` puts it, up to rounding in 32 bits.
    """

    def __init__(self, model: FaceModel) -> None:
        from fba.face.deform import _displacement_loops as loops  # imports numba

        self.model = model
        self._deformer = Deformer(model)
        self._loops = loops
        self._scratch = loops.allocate_scratch(len(model.vertices))
        self._movable: int | None = None

    @property
    def shifts(self) -> Shifts:
        """The model's tables of shifts."""
        return self._deformer._tables.mesh.shifts

    @property
    def transforms(self) -> Transforms:
        """The model's tables of transforms."""
        return self._deformer._tables.transforms

    def measure(self, one: npt.ArrayLike, other: npt.ArrayLike) -> Displacements:
        """Return how far apart two sequences of FAPs, both (T, 68), are. Errors as those of `Deformer`."""
        first, second = frame_values(one)[0], frame_values(other)[0]
        tables, count = self._deformer._tables, len(first)
        largest, worst = np.zeros(count), np.zeros(count, dtype=np.int64)
        counts = np.zeros(BINS + 2, dtype=np.int64)
        different = np.flatnonzero((first[:, 2:] != second[:, 2:]).any(axis=1))
        for start in range(0, len(different), FRAMES_PER_CALL):
            frames = different[start : start + FRAMES_PER_CALL]
            own_largest, own_worst = np.zeros(len(frames)), np.zeros(len(frames), dtype=np.int64)
            pair = np.stack([first[frames], second[frames]])
            poses = np.stack([self._deformer._poses(values) for values in pair])
            self._loops.measure_frames(
                pair, poses, tables.mesh, self._scratch, (own_largest, own_worst),
                MAX_DISTANCE / BINS, counts,
            )  # fmt: skip
            largest[frames], worst[frames] = own_largest, own_worst
        counts[0] += max(self._count_movable() * count - int(counts.sum()), 0)
        return Displacements(largest, worst, counts)

    def _count_movable(self) -> int:
        """Return how many vertices any FAP moves in the frame of the head."""
        if self._movable is None:
            model, tables = self._deformer.model, self._deformer._tables
            movable = np.zeros(len(model.vertices), dtype=np.bool_)
            movable[tables.mesh.shifts.rows] = True
            for part in range(len(model.parts)):
                if tables.transforms.start[part] < tables.transforms.start[part + 1]:
                    movable[tables.mesh.part_start[part] : tables.mesh.part_start[part + 1]] = True
            self._movable = int(movable.sum())
        return self._movable

    def angles(self, one: npt.ArrayLike, other: npt.ArrayLike) -> tuple[float, float]:
        """Return the most, in degrees, by which one of the head's angles differs, and one of an eye's."""
        first, second = frame_values(one)[0], frame_values(other)[0]
        off = np.abs(first - second).max(axis=0, initial=0.0)
        transforms, most = self.transforms, [0.0, 0.0]
        for number in np.flatnonzero(transforms.kind == KIND_ORDER.index("rotation")).tolist():
            part = int(number < transforms.start[-2])
            step = float(np.degrees(np.linalg.norm(transforms.amount[number])))
            most[part] = max(most[part], float(off[transforms.column[number]]) * step)
        return most[0], most[1]


def vertex_distances(deformer: Deformer, one: npt.ArrayLike, other: npt.ArrayLike) -> Float64:
    """Return the largest distance between a vertex in one pose and in the other: float64 (T,), metres.

    In the frame of the head, whose rotation counts nothing. one, other: (T, 68), as `Deformer` takes them.
    """
    first, second = np.asarray(one), np.asarray(other)
    result = np.zeros(len(first))
    differs = np.flatnonzero((first != second).any(axis=1))
    for start in range(0, len(differs), VERTEX_BLOCK):
        rows = differs[start : start + VERTEX_BLOCK]
        shifts: Float32 = deformer.local(first[rows]) - deformer.local(second[rows])
        result[rows] = np.sqrt(np.einsum("tvi,tvi->tv", shifts, shifts).max(axis=1))
    return result


def unit_motions(deformer: Deformer) -> Float64:
    """Return the motion by 1 of each FAP at the vertices that any FAP moves most: float64 (68, P, 3), mm.

    In the frame of the head: its rotation moves nothing. 0 for FAPs that the face does not show.
    """
    columns = range(FIRST_LOW_LEVEL_FAP - 1, FAP_COUNT)
    peaks = set()
    for column in columns:
        size = np.linalg.norm(_unit_motion(deformer, column), axis=1)
        if size.any():
            peaks.add(int(size.argmax()))
    vertices = sorted(peaks)
    result = np.zeros((FAP_COUNT, len(vertices), 3))
    for column in columns:
        result[column] = _unit_motion(deformer, column)[vertices]
    return result


def _unit_motion(deformer: Deformer, column: int) -> Float64:
    """Return the motion of all vertices by 1 of a FAP: float64 (V, 3), mm."""
    poses = np.zeros((2, FAP_COUNT))
    poses[:, column] = LINEAR_REACH, -LINEAR_REACH
    there, back = deformer.local(poses).astype(np.float64)
    return np.asarray((there - back) * (1000 / (2 * LINEAR_REACH)))
