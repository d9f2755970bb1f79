"""Places the feature points of a head by hand: the points, the current one, mirroring, undoing, saving.

It knows no picture and no mouse; a window shows it as a `PlacementScene`.
"""

from __future__ import annotations

from collections.abc import Collection
from functools import cached_property
from pathlib import Path

import numpy as np

from fba.arrays import Float32, Float64, Intp
from fba.face import feature_point_names as names
from fba.face import neutral_points
from fba.face.fapu import FAPU_POINTS
from fba.face.feature_points import MIRRORED
from fba.face.importers.head_surface import HeadSurface
from fba.face.importers.points.points_file import GivenPoints, write_points
from fba.mesh import vertex_normals
from fba.parameters import feature_points, point_rows
from fba_player.scene._hand_editing import HandEditing

INSIDE = ("7.1", "11.5")
"""Points on no surface, which the importer works out: they are not asked for."""
MATES = {**MIRRORED, **{right: left for left, right in MIRRORED.items()}}
"""The point on the other side, of those that have one."""
TOUCHING_DISTANCE = 0.002
"""Vertices this much further than the nearest, as a share of the head's height, may be meant as well: lips
touch, and the side that the skin faces tells them apart."""
MIN_POINTS_FOR_GUESS = 4
"""Least number of placed points from which the place of another is guessed."""

Place = int | tuple[float, float, float]
"""Where a point is: a vertex by its number in the file, or a position in the file's axes."""


class PointPlacement(HandEditing[dict[str, Place]]):
    """The feature points of a head while they are placed by hand.

    surface: the head, with the points placed so far. hidden: numbers of the parts that are not shown; clicks
    go through them.
    """

    item, subject = "feature point", "the points"
    path: Path

    def __init__(self, surface: HeadSurface, path: str | Path) -> None:
        places = _places_of(surface.given)
        self._names = _asking_order(set(places))
        super().__init__(places, self._names[0], Path(path))
        self.surface = surface
        self.hidden: set[int] = set()

    @property
    def names(self) -> tuple[str, ...]:
        """The points in the order in which they are asked for.

        First come those without a place at the start (those of the FAPU, those with FAPs, the rest), then
        those to be checked.
        """
        return self._names

    @property
    def places(self) -> dict[str, Place]:
        """Places of the points that have one, by name."""
        return self.state

    @places.setter
    def places(self, places: dict[str, Place]) -> None:
        self.state = places

    @property
    def placed(self) -> Collection[str]:
        return self.places

    @property
    def missing_units(self) -> tuple[str, ...]:
        """Points without a place that every face needs."""
        return tuple(name for name in self.missing if name in FAPU_POINTS)

    def position(self, name: str) -> Float64 | None:
        """Return (3,) position of a point in the file's axes; None if it has no place."""
        place = self.places.get(name)
        if place is None:
            return None
        return self.surface.vertices[place] if isinstance(place, int) else np.array(place)

    def positions(self) -> Float64:
        """Return float64 (84, 3): positions in the file's axes, NaN for points without a place."""
        points = np.full((len(names()), 3), np.nan)
        for name in self.places:
            points[point_rows()[name]] = self.position(name)
        return points

    def place(self, vertex: int) -> None:
        """Place the current point on a vertex, by its number in the file."""
        self._change({**self.places, self.current: vertex})

    def remove(self) -> None:
        self._change({name: place for name, place in self.places.items() if name != self.current})

    def mirror(self) -> str | None:
        """Place the current point's mate at its mirror image; if only the mate has a place, the current one.

        Returns the name of the point that was placed, None where there is nothing to mirror.
        """
        mate = MATES.get(self.current)
        if mate is None:
            return None
        source, target = (self.current, mate) if self.current in self.places else (mate, self.current)
        if source not in self.places:
            return None
        self._change({**self.places, target: self._mirrored(source)})
        return target

    def mirror_all(self) -> int:
        """Place all points without a place whose mates have one, at their mirror images; return how many."""
        targets = {name: MATES[name] for name in self.missing if MATES.get(name) in self.places}
        mirrored = {name: self._mirrored(mate) for name, mate in targets.items()}
        self._change({**self.places, **mirrored})
        return len(targets)

    def _write(self, path: Path) -> None:
        """Write the file, atomically. Raises ModelError if no point is placed, FormatError if it cannot."""
        vertices = {name: place for name, place in self.places.items() if isinstance(place, int)}
        points = np.full((len(names()), 3), np.nan)
        for name, place in self.places.items():
            if not isinstance(place, int):
                points[point_rows()[name]] = place
        comment = f"feature points of {Path(self.surface.path).name}, vertices counted from 0"
        write_points(path, GivenPoints(points, vertices), comment)

    def guess(self) -> Float64 | None:
        """Return (3,) the vertex about where the current point is; None if too few points have a place."""
        rows = [point_rows()[name] for name in self.names if name in self.places]
        if len(rows) < MIN_POINTS_FOR_GUESS:
            return None
        adult, here = neutral_points()[rows], self.positions()[rows]
        turned = here @ self.surface.upright.T
        middles = adult.mean(axis=0), turned.mean(axis=0)
        a, b = adult - middles[0], turned - middles[1]
        size = float((a * b).sum() / max((a * a).sum(), 1e-30))  # heads are upright: no rotation
        place = (neutral_points()[point_rows()[self.current]] - middles[0]) * size + middles[1]
        away = np.linalg.norm(self.surface.vertices[self._used] - place @ self.surface.upright, axis=1)
        return np.asarray(self.surface.vertices[self._used[int(away.argmin())]])

    def nearest_corner(self, triangle: int, shares: Float64) -> int:
        """Return the vertex, by its number in the file, that is nearest to a place in a triangle.

        shares: (3,), of the triangle's corners in that place.
        """
        corners = self.surface.triangles[triangle]
        positions = self.surface.vertices[corners]
        away = np.linalg.norm(positions - shares @ positions, axis=1)
        return int(corners[int(away.argmin())])

    @property
    def middle(self) -> float:
        """x of the plane between left and right, in the file's axes."""
        at = self.positions()[:, 0]
        sides = [(at[point_rows()[left]] + at[point_rows()[right]]) / 2 for left, right in MIRRORED.items()]
        central = [at[point_rows()[name]] for name in self.names if name not in MATES]
        finite = [float(x) for x in (*sides, *central) if np.isfinite(x)]
        if finite:
            return float(np.median(finite))
        on_surface = self.surface.vertices[self._used, 0]
        return float(on_surface.min() + on_surface.max()) / 2

    @cached_property
    def _used(self) -> Intp:
        """Numbers of the vertices that belong to a triangle."""
        return np.unique(self.surface.triangles).astype(np.intp)

    @cached_property
    def _normals(self) -> Float32:
        return vertex_normals(self.surface.vertices, self.surface.triangles)

    def _mirrored(self, name: str) -> int:
        """Return the vertex nearest to the mirror image of a point."""
        position, place = self.position(name), self.places[name]
        assert position is not None
        flip = np.array([-1.0, 1.0, 1.0])
        wanted = position * flip + (2 * self.middle, 0.0, 0.0)
        vertices = self.surface.vertices[self._used]
        away = np.linalg.norm(vertices - wanted, axis=1)
        if not isinstance(place, int):
            return int(self._used[int(away.argmin())])
        near = np.flatnonzero(away <= away.min() + TOUCHING_DISTANCE * float(np.ptp(vertices[:, 1])))
        facing = self._normals[self._used[near]] @ (self._normals[place] * flip)
        same = near[facing >= facing.max() - 0.2]
        return int(self._used[same[int(away[same].argmin())]])


def describe_point(name: str) -> str:
    """Return what a feature point is, and what needs it: "chin, lowest point: FAPs 3, 14, 15"."""
    point = feature_points()[point_rows()[name]]
    uses = []
    if name in FAPU_POINTS:
        uses.append("every face needs it")
    if point.faps:
        uses.append(f"FAP{'s' if len(point.faps) > 1 else ''} {', '.join(map(str, point.faps))}")
    return point.description + (": " + "; ".join(uses) if uses else ": makes the motions around it better")


def _places_of(given: GivenPoints) -> dict[str, Place]:
    places: dict[str, Place] = {}
    for name, position in zip(names(), given.points.tolist(), strict=True):
        if name in given.vertices:
            places[name] = given.vertices[name]
        elif np.isfinite(position).all():
            places[name] = (position[0], position[1], position[2])
    return places


def _asking_order(placed: set[str]) -> tuple[str, ...]:
    asked = [point for point in feature_points() if point.name not in INSIDE]
    units = list(FAPU_POINTS)

    def rank(number: int) -> tuple[bool, int, int]:
        point = asked[number]
        urgency = units.index(point.name) if point.name in units else 100 if point.faps else 101
        return point.name in placed, urgency, number

    return tuple(asked[number].name for number in sorted(range(len(asked)), key=rank))
