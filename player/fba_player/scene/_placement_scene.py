"""A head whose feature points are placed by hand, as a window shows it."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cached_property
from pathlib import Path

import numpy as np

from fba.animation import Animation
from fba.arrays import Float32, Float64
from fba.errors import ModelError
from fba.face import Material, Part
from fba.face.importers.assembly.model import metres_per_unit
from fba.rotations import unit
from fba.tracks import FaceTrack
from fba_player._figure._face_parts import part_colours, part_picture
from fba_player.playback._timeline import Timeline
from fba_player.scene._point_placement import MATES, PointPlacement
from fba_player.view._camera import Camera, Subject
from fba_player.view._geometry import first_hit, ray_through, transform
from fba_player.view._view import Colour, Dots, Extras, FaceMesh, FaceShape, Seen, View
from fba_player.view.protocols import Timed
from fba_player.view.switches import Switches

HEIGHT = 0.26
"""Height in metres at which a head of unknown unit is shown."""
PLACED: Colour = (0.95, 0.62, 0.25, 1.0)
CURRENT: Colour = (0.25, 0.75, 1.0, 1.0)
GUESSED: Colour = (0.25, 0.75, 1.0, 0.75)
MATE: Colour = (0.55, 0.9, 0.55, 1.0)
RADII = {"placed": 3.0, "current": 5.5, "mate": 4.5, "guessed": 8.0}
"""Of the dots, pixels in a picture 720 high."""
LIFT = 0.004
"""Metres of skin through which dots are seen."""
LIGHT = (0.75, 0.55, 0.0, 0.5)
"""Light on all vertices, as in `FaceMesh.light`: shadows would hide what is to be clicked."""
CLAY = (0.42, 0.36, 0.32)
"""Colour of surfaces without one of their own, linear light."""
MIN_SHOWN_FACTOR = 1.25
"""The part shown is at least this many times as large as the box of the placed points."""


class PlacementScene(Timed[Timeline]):
    """Shows the head of a `PointPlacement` with its points, and finds what a mouse points at.

    The current point and its guess are blue, the mate on the other side is green, all others are orange.
    """

    def __init__(self, placement: PointPlacement) -> None:
        self.placement = placement
        self.timeline = Timeline(
            Animation(Fraction(25), np.zeros(1, np.int64), FaceTrack.empty(1))
        )  # one neutral frame
        self.switches = Switches()
        self.title = Path(placement.surface.path).name
        self.has_body = False

    def view_at(self, time: float, seen: Seen | None = None) -> View:
        """Return the head and its points; at any time the same."""
        if not math.isfinite(time):
            raise ValueError(f"a time must be finite, not {time}")
        hidden = self.placement.hidden
        faces = [mesh for number, mesh in enumerate(self._meshes) if number not in hidden]
        return View(faces=faces, extras=Extras(dots=self._dots()))

    def camera(self, preset: str | None = None, aspect: float = 16 / 9) -> Camera:
        """Return the camera of a preset, fitted to the head."""
        return Camera.preset("front" if preset in (None, "body") else str(preset), self._subject, aspect)

    def vertex_under(self, camera: Camera, x: float, y: float, size: tuple[int, int]) -> int | None:
        """Return the vertex, by its number in the file, of what a pixel of a picture shows, or None."""
        placement = self.placement
        shown = np.flatnonzero(~np.isin(placement.surface.part_of, list(placement.hidden)))
        hit = first_hit(*ray_through(camera, x, y, size), self._corners[shown])
        return None if hit is None else placement.nearest_corner(int(shown[hit[0]]), hit[1])

    def to_world(self, points: Float64) -> Float64:
        """Return the points (N, 3) in the file's axes, in the world."""
        return transform(points, self._matrix)

    @cached_property
    def _matrix(self) -> Float64:
        """(4, 4) from the file's axes and unit to the world, the head's middle at the origin."""
        surface = self.placement.surface
        upright = surface.vertices[np.unique(surface.triangles)] @ surface.upright.T
        low, high = upright.min(axis=0), upright.max(axis=0)
        try:
            size = metres_per_unit(self.placement.positions() @ surface.upright.T)[0]
        except ModelError:  # no pupils yet
            size = HEIGHT / max(float(high[1] - low[1]), 1e-30)
        matrix = np.eye(4)
        matrix[:3, :3] = surface.upright * size
        matrix[:3, 3] = -(low + high) / 2 * size
        return matrix

    @cached_property
    def _corners(self) -> Float64:
        """float64 (F, 3, 3): the corners of all triangles in the world."""
        surface = self.placement.surface
        return self.to_world(surface.vertices)[surface.triangles]

    @cached_property
    def _meshes(self) -> list[FaceMesh]:
        turn = self._matrix[:3, :3] / np.cbrt(np.linalg.det(self._matrix[:3, :3]))
        meshes = []
        for part in self.placement.surface.parts:
            assert part.normals is not None
            positions = self.to_world(part.vertices.astype(np.float64)).astype(np.float32)
            normals = unit(part.normals @ turn.T).astype(np.float32)
            meshes.append(plain_mesh(plain_shape(part), positions, normals))
        return meshes

    @cached_property
    def _subject(self) -> Subject:
        """What the camera is fitted to: the points placed at first and their surroundings, else all."""
        corners = self._corners.reshape(-1, 3)
        low, high = corners.min(axis=0), corners.max(axis=0)
        points = self.to_world(self.placement.positions())
        points = points[np.isfinite(points).all(axis=1)]
        if len(points) > 1:
            middle = (points.min(axis=0) + points.max(axis=0)) / 2
            half = max(float(np.ptp(points, axis=0).max()) * MIN_SHOWN_FACTOR / 2, HEIGHT / 2)
            low, high = np.maximum(low, middle - half), np.minimum(high, middle + half)
        return fit_box(low, high)

    def _dots(self) -> tuple[Dots, ...]:
        placement = self.placement
        current, mate = placement.current, MATES.get(placement.current)
        others = [name for name in placement.places if name not in (current, mate)]
        groups = [
            self._dots_of(others, PLACED, "placed"),
            self._dots_of([mate] if mate is not None and mate in placement.places else [], MATE, "mate"),
            self._dots_of([current] if current in placement.places else [], CURRENT, "current"),
        ]
        guess = placement.guess() if current not in placement.places else None
        if guess is not None:
            groups.append(
                make_dots(self.to_world(guess[None]), (f"{current}?",), GUESSED, RADII["guessed"], LIFT)
            )
        return tuple(group for group in groups if len(group.positions))

    def _dots_of(self, names: list[str], colour: Colour, kind: str) -> Dots:
        points = np.array([self.placement.position(name) for name in names]).reshape(-1, 3)
        return make_dots(self.to_world(points), tuple(names), colour, RADII[kind], LIFT)


def make_dots(points: Float64, names: tuple[str, ...], colour: Colour, radius: float, lift: float) -> Dots:
    """Return dots of one colour that face the camera everywhere.

    points: float64 (N, 3), metres in the world. radius: pixels in a picture 720 high. lift: metres of skin
    through which they are seen.
    """
    facing: Float32 = np.zeros((len(points), 3), dtype=np.float32)
    return Dots(points.astype(np.float32), colour, radius, lift, names, facing)


def fit_box(low: Float64, high: Float64) -> Subject:
    """Return the subject that shows all of a box from any side. low, high: its corners (3,), metres."""
    x, y, z = ((low + high) / 2).tolist()
    wide, tall, deep = ((high - low) / 2).tolist()
    return Subject((x, y, z), tall * 1.05, max(wide, deep), deep)


def plain_mesh(shape: FaceShape, positions: Float32, normals: Float32) -> FaceMesh:
    """Return a part of a head in the world, lit alike at all vertices. positions, normals: float32 (V, 3)."""
    light = np.tile(np.array(LIGHT, dtype=np.float32), (len(positions), 1))
    return FaceMesh(shape, positions, normals, light, np.eye(4), np.zeros(3), np.zeros(3))


def plain_shape(part: Part) -> FaceShape:
    """Return the shape of a part in its colours, or as clay if it has none."""
    is_plain = part.material.colour == Material().colour and part.material.texture is None
    colours = part_colours(part, CLAY if is_plain else part.material.colour)
    still = np.zeros(len(part.vertices), dtype=np.float32)
    return FaceShape(
        part.triangles, colours, still, part.texcoords, part_picture(part), two_sided=True, name=part.name,
        smooth=False,
    )  # fmt: skip
