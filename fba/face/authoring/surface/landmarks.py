"""Feature points and contours of a face on its surface."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise

import numpy as np

from fba.arrays import Bool, Float64, Int32, Intp
from fba.face.authoring.surface.binding import SURFACE_KINDS, lip_sides
from fba.face.authoring.surface.surface import Surface, weld_parts
from fba.face.fapu import Fapu
from fba.face.feature_points import names, neutral_points
from fba.face.model import Part
from fba.face.points import DIRECTIONS
from fba.parameters import faps, point_rows

CONTOURS = {
    "upper inner lip": ("2.4", "2.6", "2.2", "2.7", "2.5"),
    "lower inner lip": ("2.4", "2.8", "2.3", "2.9", "2.5"),
    "upper outer lip": ("8.3", "8.5", "8.10", "8.1", "8.9", "8.6", "8.4"),
    "lower outer lip": ("8.3", "8.7", "8.2", "8.8", "8.4"),
    "left upper lid": ("3.11", "3.1", "3.7"),
    "left lower lid": ("3.11", "3.3", "3.7"),
    "right upper lid": ("3.8", "3.2", "3.12"),
    "right lower lid": ("3.8", "3.4", "3.12"),
    "jaw line": ("2.13", "2.11", "2.1", "2.12", "2.14"),
}
"""The feature points that each contour runs through."""
LIP_CONTOURS = tuple(name for name in CONTOURS if name.endswith("lip"))
LIP_ROOM = 0.03
"""Distance from the inner contour of the lips, in ES0, that the outer contour keeps where it can."""
CLOSE_COST = 4.0
"""Factor on the lengths of edges within `LIP_ROOM` of the inner contour."""
OPENINGS = {name for name in CONTOURS if name.endswith(" lid") or "inner" in name}
"""Contours around an opening of the face, which in many meshes is a hole."""


@dataclass(eq=False)
class Landmarks:
    """The feature points and contours of one face.

    surface: skin and inner mouth. points: (84, 3), NaN where unknown. vertex: surface vertex by name of
    the feature point, for those that stand on the surface. fapu: the units.
    """

    surface: Surface
    points: Float64
    vertex: dict[str, int]
    fapu: Fapu
    _contours: dict[str, Intp] = field(default_factory=dict)

    def point(self, name: str) -> Float64:
        """Return (3,) position of a feature point, metres; NaN where unknown."""
        return np.asarray(self.points[point_rows()[name]])

    def has(self, *wanted: str) -> bool:
        """Return whether all these feature points stand on the surface."""
        return all(name in self.vertex for name in wanted)

    def vertices_of(self, wanted: Iterable[str]) -> Intp:
        """Return (M,) vertices of those of the feature points that stand on the surface."""
        return np.array([self.vertex[name] for name in wanted if name in self.vertex], dtype=np.intp)

    def step(self, fap: int) -> Float64:
        """Return (3,) displacement, metres, of the point of a FAP by one unit of its value."""
        entry = faps()[fap - 1]
        return np.array(DIRECTIONS[entry.positive]) * self.fapu[entry.unit]

    def missing_point(self, fap: int) -> str:
        """Return why the surface cannot follow a FAP: its feature point is not on it. Otherwise ""."""
        point = faps()[fap - 1].feature_points[0]
        return "" if self.has(point) else f"feature point {point} is not on the skin"

    def contour(self, name: str) -> Intp:
        """Return the vertices along a contour; empty unless its ends and a point between them exist."""
        if name not in self._contours:
            around = None
            if "outer lip" in name:
                around = np.concatenate([self.contour(f"{half} inner lip") for half in ("upper", "lower")])
            self._contours[name] = self._walk(CONTOURS[name], rim=name in OPENINGS, around=around)
        return self._contours[name]

    def _walk(self, through: tuple[str, ...], *, rim: bool, around: Intp | None = None) -> Intp:
        """Return the vertices of a walk through feature points. around: vertices that it avoids if it can."""
        known = [self.vertex[name] for name in through if name in self.vertex]
        if len(known) < 3 or not self.has(through[0], through[-1]):
            return np.zeros(0, dtype=np.intp)
        costs = None
        if around is not None and len(around):
            far = self.surface.distances(around, LIP_ROOM * self.fapu.ES * 1024)
            costs = np.where(np.isfinite(far), CLOSE_COST, 1.0)
        walk: list[int] = [known[0]]
        for start, end in pairwise(known):
            on_rim = bool(self.surface.open_edge[[start, end]].all())
            step = self.surface.path(start, end, rim=rim and on_rim, costs=costs)
            if not len(step):
                return np.zeros(0, dtype=np.intp)
            walk += step[1:].tolist()
        return np.array(walk, dtype=np.intp)

    @cached_property
    def inside_mouth(self) -> Bool:
        """(N,) mask of the vertices that the inner lips separate from the outer face."""
        return self._cut_off(("upper inner lip", "lower inner lip"))

    @cached_property
    def lips(self) -> Bool:
        """(N,) mask of the lips' vertices between outer and inner contour, both excluded."""
        return (
            self._cut_off(("upper outer lip", "lower outer lip")) & ~self.inside_mouth & ~self.on_inner_lips
        )

    @cached_property
    def on_inner_lips(self) -> Bool:
        """(N,) mask of the vertices on the inner contour."""
        return self.on_contours("upper inner lip", "lower inner lip")

    def on_contours(self, *contours: str) -> Bool:
        """Return (N,) mask of the vertices of the given contours."""
        return self.surface.mask(np.concatenate([self.contour(name) for name in contours]))

    def _cut_off(self, contours: tuple[str, ...]) -> Bool:
        """Return (N,) mask of vertices that contours separate from the outer face; none if one is missing."""
        loop = np.unique(np.concatenate([self.contour(name) for name in contours]))
        outside = self.vertices_of(("9.3", "9.15", "2.1", "2.10", "11.1", "4.1"))
        if not len(outside) or any(not len(self.contour(name)) for name in contours):
            return self.surface.mask([])
        pieces = self.surface.pieces_without(loop)
        main = self.surface.component == self.surface.component[loop[0]]
        return np.asarray(main & (pieces >= 0) & ~np.isin(pieces, pieces[outside]))

    @cached_property
    def points_or_average(self) -> Float64:
        """(84, 3) feature points, metres; unknown ones from an average head, stretched and moved to fit."""
        average = np.array(neutral_points())
        known = np.isfinite(self.points).all(axis=1)
        result = self.points.copy()
        for axis in range(3):
            here, there = self.points[known, axis], average[known, axis]
            spread = float(np.ptp(there))
            scale = float(np.cov(here, there)[0, 1] / np.var(there, ddof=1)) if spread > 1e-3 else 1.0
            guess = (average[:, axis] - there.mean()) * scale + here.mean()
            result[~known, axis] = guess[~known]
        return result

    def point_or_average(self, name: str) -> Float64:
        """Return (3,) position of a feature point; if unknown, as on an average adult head."""
        return np.asarray(self.points_or_average[point_rows()[name]])


def find_landmarks(surface: Surface, points: Float64, bound: Int32) -> Landmarks:
    """Return the feature points and contours of a face on its surface.

    points: (84, 3), metres. bound: (84,), vertices counted through all parts, -1 where free.
    """
    on_surface = zip(names(), surface.find(bound).tolist(), strict=True)
    vertex = {name: number for name, number in on_surface if number >= 0}
    return Landmarks(surface, points, vertex, Fapu.measure(points))


def weld_skin(parts: Sequence[Part], bound: Int32) -> Surface:
    """Return skin and inner mouth as one surface; edges of a mouth that lie on each other stay apart."""
    surface = weld_parts(parts, SURFACE_KINDS)
    sides = lip_sides(surface, parts, bound)
    return surface if sides is None else weld_parts(parts, SURFACE_KINDS, sides=sides)
