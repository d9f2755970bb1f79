"""A head that captured markers move, with their cloud, as a window and a film show it."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from fba.arrays import Float32, Float64, Intp
from fba.mesh import vertex_normals
from fba.rotations import unit
from fba_player._figure.face import FaceFigure, build_figure
from fba_player._mesh.textures import linear_light
from fba_player.playback._timeline import CaptureTimes
from fba_player.scene._fap_heatmap import GLOSS, heat_colours, heat_legend, plain_colours
from fba_player.scene._placement_scene import fit_box, make_dots, plain_mesh, plain_shape
from fba_player.scene.marker_editing import MarkerEditing
from fba_player.view._camera import Camera, Subject
from fba_player.view._geometry import first_hit, project, ray_through, rotation_vector, transform, translation
from fba_player.view._view import Colour, Dots, Extras, Eye, FaceMesh, FaceShape, Legend, Lines, Seen, View
from fba_player.view.protocols import Timed
from fba_player.view.switches import Switches

MOVING: Colour = (0.95, 0.62, 0.25, 1.0)
FIXED: Colour = (0.62, 0.70, 0.80, 1.0)
FREE: Colour = (0.93, 0.94, 0.96, 0.55)
CURRENT: Colour = (0.25, 0.75, 1.0, 1.0)
LINE_COLOUR: Colour = (0.25, 0.75, 1.0, 0.55)
"""Moving, fixed and unmapped markers, the current one, and the line from it to its vertex."""
MARKER_RADIUS = 4.2
CENTRE_RADIUS = 2.6
CURRENT_RADIUS = 6.0
"""Radii of dots, pixels in a picture 720 high."""
LIFT = 0.006
"""Metres of skin through which dots are seen."""
MAX_CLICK_DISTANCE = 10.0
"""A click this close to a dot, in pixels of a picture 720 high, means the dot."""
CLOUD_GAP = 0.35
"""Room between cloud and head, as a share of the head's width."""
ROOM_FACTOR = 1.2
"""Room beside head and cloud for a head that turns and moves, as a factor on their distance."""
MIN_FOLLOWED_TRAVEL = 0.3
"""Metres that a head moves before the camera follows it."""


class MarkersScene(Timed[CaptureTimes]):
    """Shows the head of a `MarkerEditing`, the cloud beside it or over it, and finds what a mouse points at.

    Moving markers are orange, fixed ones grey, those without a virtual marker pale, the current one is blue,
    unless `shows_current` is False. shows_cloud: whether the cloud is there at all.
    """

    def __init__(self, editing: MarkerEditing, title: str = "") -> None:
        self.editing = editing
        self.timeline = CaptureTimes(editing.motion.times, editing.motion.rate)
        self.switches = Switches()
        self.title = title or editing.motion.name or "markers"
        self.has_body = False
        self.shows_cloud = True
        self.shows_current = True
        self._painted: dict[object, list[FaceShape]] = {}

    def place_cloud(self, where: str) -> None:
        """Show the cloud, and dots on the head: where is "beside" the head, "over" it, or "none"."""
        self.shows_cloud = where != "none"
        self.editing.beside = where == "beside"

    def view_at(self, time: float, seen: Seen | None = None) -> View:
        """Return the head and the cloud at a time in seconds."""
        frame, after, share = self.timeline.position(time)
        vertices, pose = self._moved(frame, after, share)
        faces, eyes = self._figure_meshes(vertices, pose) if self._figure else self._plain(vertices, pose)
        background = (0.5, 0.5, 0.5) if self.switches["background"] == "grey" else None
        dots, lines = self._annotations(self._cloud(frame, after, share), vertices, pose)
        extras = Extras(dots=dots, lines=lines, legend=self._legend)
        return View(faces=faces, eyes=eyes, background=background, extras=extras)

    def camera(self, preset: str | None = None, aspect: float = 16 / 9) -> Camera:
        """Return the camera of a preset, fitted to the head, and to the cloud if it is beside it."""
        return Camera.preset("front" if preset in (None, "body") else str(preset), self._subject, aspect)

    def travel(self, time: float) -> tuple[float, float, float]:
        """Return how far the head has gone, metres; zeros if it stays about where it is."""
        made = self.editing.performance
        if made is None or np.ptp(made.shift, axis=0).max() * made.head.metres < MIN_FOLLOWED_TRAVEL:
            return 0.0, 0.0, 0.0
        frame, after, share = self.timeline.position(time)
        middle = made.head.vertices[made.head.face].mean(axis=0)
        pose = made.pose_between(frame, after, share)
        x, y, z = ((pose[:3, :3] @ middle + pose[:3, 3] - middle) * made.head.metres).tolist()
        return x, y, z

    def vertex_under(
        self, camera: Camera, x: float, y: float, size: tuple[int, int], time: float
    ) -> int | None:
        """Return the vertex of the head that is nearest to what a pixel of a picture shows, or None."""
        vertices, pose = self._moved(*self.timeline.position(time))
        triangles = self.editing.head.triangles
        corners = self.to_world(transform(vertices, pose))[triangles]
        hit = first_hit(*ray_through(camera, x, y, size), corners)
        return None if hit is None else int(triangles[hit[0], int(hit[1].argmax())])

    def marker_under(
        self, camera: Camera, x: float, y: float, size: tuple[int, int], time: float
    ) -> str | None:
        """Return the marker whose dot, in the cloud or on the head, is at a pixel, or near to it; or None."""
        frame, after, share = self.timeline.position(time)
        vertices, pose = self._moved(frame, after, share)
        names = list(self.editing.motion.names)
        places = [self._cloud(frame, after, share)] if self.shows_cloud else []
        choices = names if self.shows_cloud else []
        if self.editing.beside:
            centres = {name: one.vertex or 0 for name, one in self.editing.mapping.centres.items()}
            choices = [*choices, *centres]
            places.append(self.to_world(transform(vertices[list(centres.values())], pose)))
        pixels = (
            project(np.concatenate(places), camera.clip_matrix(size), size)[0] if places else np.zeros((0, 2))
        )
        away = np.linalg.norm(pixels - (x, y), axis=1)
        away[np.isnan(away)] = np.inf
        near = away.min(initial=np.inf) <= MAX_CLICK_DISTANCE * size[1] / 720
        return choices[int(away.argmin())] if near else None

    def to_world(self, points: Float64) -> Float64:
        """Return the points (..., 3) of the head in the world."""
        return np.asarray((points - self._middle) * self.editing.head.metres)

    @cached_property
    def _middle(self) -> Float64:
        """The point (3,) at the world's origin, in the head's unit: a model's origin, else the middle."""
        if self.editing.head.model is not None:
            return np.zeros(3)
        used = self.editing.head.vertices[np.unique(self.editing.head.triangles)]
        return np.asarray((used.min(axis=0) + used.max(axis=0)) / 2)

    @cached_property
    def _figure(self) -> FaceFigure | None:
        model = self.editing.head.model
        return None if model is None else build_figure(model)

    @cached_property
    def _box(self) -> tuple[Float64, Float64]:
        """Lowest and highest corner, (3,), of the part of the head that markers are on, metres."""
        editing = self.editing
        places = self.to_world(editing.head.vertices[np.unique(editing.head.triangles)])
        points = editing.head.points[np.isfinite(editing.head.points).all(axis=1)]
        if len(points) > 1:
            low, high = self.to_world(points)[:, 1].min(), self.to_world(points)[:, 1].max()
            near = (places[:, 1] > low) & (places[:, 1] < high)
            places = places[near] if near.any() else places
        return places.min(axis=0), places.max(axis=0)

    @cached_property
    def _beside(self) -> Float64:
        """Vector (3,) from the head to the cloud beside it, metres."""
        low, high = self._box
        return np.array([-(1 + CLOUD_GAP) * float(high[0] - low[0]), 0.0, 0.0])

    @cached_property
    def _rest_normals(self) -> Float32:
        skin = self.editing.head.skin
        return vertex_normals(skin.vertices, skin.triangles)

    @cached_property
    def _representatives(self) -> Intp:
        """A vertex of the head for each vertex of its skin, (S,)."""
        skin = self.editing.head.skin
        rows = np.zeros(len(skin), dtype=np.intp)
        rows[skin.number] = np.arange(len(skin.number))
        return rows

    def _moved(self, frame: int, after: int, share: float) -> tuple[Float64, Float64]:
        """Return the head's vertices, float64 (N, 3), and its motion (4, 4), both in its unit."""
        made = self.editing.performance
        if made is None:
            return self.editing.head.vertices, np.eye(4)
        return made.vertices_between(frame, after, share), made.pose_between(frame, after, share)

    def _normal_changes(self, vertices: Float64) -> Float64:
        """Return float64 (N, 3): what is added to the normals of the head at rest."""
        skin = self.editing.head.skin
        now = vertex_normals(vertices[self._representatives], skin.triangles)
        return np.asarray((now - self._rest_normals).astype(np.float64)[skin.number])

    def _figure_meshes(self, vertices: Float64, pose: Float64) -> tuple[list[FaceMesh], list[Eye]]:
        figure = self._figure
        assert figure is not None
        turn, centre = pose[:3, :3], figure.centre
        place = translation(pose[:3, 3] + turn @ centre - centre)
        positions = vertices.astype(np.float32)
        light = figure.light.shade(positions, turn, np.eye(3))
        axis, changes = rotation_vector(turn), self._normal_changes(vertices)
        meshes = []
        for name, shape in zip(figure.shapes, self._shapes(list(figure.shapes.values())), strict=True):
            rows = figure.rows(name)
            normals = figure.model.part(name).normals
            assert normals is not None
            bent = unit(normals + changes[rows]).astype(np.float32)
            meshes.append(FaceMesh(shape, positions[rows], bent, light[rows], place, axis, centre))
        still = np.zeros(68, dtype=np.float32)
        eyes = [
            ball.pose(positions[figure.rows(part.name)], positions, still, pose)
            for part, ball in figure.eyeballs
        ]
        return meshes, eyes

    @cached_property
    def _plain_shapes(self) -> list[FaceShape]:
        return [plain_shape(part) for part in self.editing.head.parts]

    def _plain(self, vertices: Float64, pose: Float64) -> tuple[list[FaceMesh], list[Eye]]:
        head = self.editing.head
        world = self.to_world(transform(vertices, pose)).astype(np.float32)
        changes = self._normal_changes(vertices)
        meshes = []
        for part, rows, shape in zip(head.parts, head.rows, self._shapes(self._plain_shapes), strict=True):
            assert part.normals is not None
            normals = unit((part.normals + changes[rows]) @ pose[:3, :3].T).astype(np.float32)
            meshes.append(plain_mesh(shape, world[rows], normals))
        return meshes, []

    def _shapes(self, plain: list[FaceShape]) -> list[FaceShape]:
        """Return the shapes of all parts, in the colours of the current marker's reach if these are shown."""
        editing = self.editing
        if not editing.shows_weights or editing.influence is None:
            return plain
        key = editing.influence
        if key not in self._painted:
            self._painted = {key: self._paint(plain)}
        return self._painted[key]

    def _paint(self, plain: list[FaceShape]) -> list[FaceShape]:
        editing, head = self.editing, self.editing.head
        assert editing.influence is not None
        on_skin = np.zeros(len(head.skin))
        on_skin[editing.influence.vertices] = editing.influence.shares
        shares = head.followers @ on_skin
        rows = dict(zip((part.name for part in head.parts), head.rows, strict=True))
        painted = []
        for shape in plain:
            colours = np.full((len(rows[shape.name]), 4), GLOSS, dtype=np.float32)
            colours[:, :3] = linear_light(heat_colours(np.clip(shares[rows[shape.name]], 0.0, 1.0)))
            painted.append(plain_colours(shape, colours))
        return painted

    @property
    def _legend(self) -> Legend | None:
        editing = self.editing
        if not editing.shows_weights or editing.influence is None:
            return None
        count = int((editing.influence.shares > 0).sum())
        return heat_legend(editing.current, f"share of its way, {count} vertices", 1.0)

    def _cloud(self, frame: int, after: int, share: float) -> Float64:
        """Return float64 (M, 3): the markers in the world, beside or over the head; NaN for unseen ones."""
        made = self.editing.performance
        positions = self.editing.laid_out if made is None else made.cloud
        here = positions[frame] if share == 0 else positions[frame] * (1 - share) + positions[after] * share
        world = self.to_world(here)
        return world + self._beside if self.editing.beside else world

    def _annotations(
        self, cloud: Float64, vertices: Float64, pose: Float64
    ) -> tuple[tuple[Dots, ...], tuple[Lines, ...]]:
        editing = self.editing
        names, markers = editing.motion.names, editing.mapping.markers
        current, source = (editing.current, editing.source) if self.shows_current else ("", "")
        groups: list[tuple[Float64, Colour, float, str]] = []
        at = {name: place for name, place in zip(names, cloud, strict=True) if np.isfinite(place).all()}
        if self.shows_cloud:
            for colour, chosen in (
                (FREE, [name for name in at if name not in markers]),
                (FIXED, [name for name in at if name in markers and markers[name].fixed]),
                (MOVING, [name for name in at if name in markers and not markers[name].fixed]),
            ):
                places = np.array([at[name] for name in chosen if name != source]).reshape(-1, 3)
                groups.append((places, colour, MARKER_RADIUS, ""))
        world = self.to_world(transform(vertices, pose))
        lines: tuple[Lines, ...] = ()
        if self.editing.beside:
            for colour, fixed in ((FIXED, True), (MOVING, False)):
                vertices_of = [
                    marker.vertex for name, marker in editing.mapping.centres.items()
                    if marker.fixed == fixed and name != current
                ]  # fmt: skip
                groups.append((world[np.array(vertices_of, dtype=np.intp)], colour, CENTRE_RADIUS, ""))
        centre = editing.mapping.centres.get(current)
        if self.shows_cloud and source in at:
            groups.append((at[source][None], CURRENT, CURRENT_RADIUS, source))
        if centre is not None and centre.vertex is not None and (editing.beside or editing.shows_weights):
            groups.append((world[centre.vertex][None], CURRENT, CURRENT_RADIUS - 1, ""))
            if self.shows_cloud and source in at:
                ends = np.stack([at[source], world[centre.vertex]])[None]
                lines = (Lines(ends.astype(np.float32), LINE_COLOUR, 1.2, LIFT),)
        dots = tuple(
            make_dots(points, (name,) * len(points), colour, radius, LIFT)
            for points, colour, radius, name in groups
            if len(points)
        )
        return dots, lines

    @property
    def _subject(self) -> Subject:
        """What the camera is fitted to: the head, and the cloud if it is beside it."""
        figure = self._figure
        subject = figure.subject if figure is not None else fit_box(*self._box)
        if not (self.editing.beside and self.shows_cloud):
            return subject
        x, y, z = subject.centre
        aside = float(self._beside[0]) / 2
        return replace(subject, centre=(x + aside, y, z), half_width=subject.half_width - ROOM_FACTOR * aside)
