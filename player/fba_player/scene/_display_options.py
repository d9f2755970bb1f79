"""Applies switches to a view: hides parts, colours them, and adds lines, dots, bones and a legend."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache, cached_property
from weakref import WeakKeyDictionary

import numpy as np

from fba.arrays import Bool, Float32, Float64, Int32, Intp
from fba.face import feature_point_names as names
from fba_player._figure.face import FaceFigure
from fba_player._mesh.primitives import sphere_mesh
from fba_player.scene._bones import Bones, Pivots, find_pivots
from fba_player.scene._fap_heatmap import FapHeatmap
from fba_player.view._geometry import transform, world_normals, world_positions
from fba_player.view._view import (
    Colour,
    Dots,
    Extras,
    Eye,
    FaceMesh,
    FaceShape,
    Grid,
    Lines,
    Mesh,
    MeshShape,
    View,
)
from fba_player.view.switches import Switches

HIDDEN_KINDS = {"eyes": ("eye",), "teeth": ("teeth", "tongue"), "hair": ("hair", "brow", "lash")}
"""Kinds of parts that a switch hides."""
UNSHADED = (0.9, 0.85, 0.0, 0.25)
"""The light at every vertex when shadows are off."""
BACKGROUNDS = {"studio": None, "grey": (0.5, 0.5, 0.5), "transparent": (0.5, 0.5, 0.5)}
"""Background colours; the last one is made transparent by pictures that have alpha."""
HAIRS = ("lash", "brow")
"""Kinds of parts too fine for colours and normals."""
INSIDE = (*HAIRS, "teeth", "tongue", "mouth", "eye")
"""Kinds of parts that a transparent body leaves out."""
DOT: Colour = (0.98, 0.62, 0.20, 1.0)
DOT_RADIUS = 3.2
"""Radius of a dot, pixels in a picture 720 high."""
MAX_DOT_RADIUS = 0.0022
"""Largest radius of a dot, metres."""
DOT_LIFT = 0.004
NAME_LIFT = 0.006
"""Depth (m) of skin through which dots and names show."""
WIRE: Colour = (0.03, 0.05, 0.08, 0.8)
WIRE_LIFT = 0.0012
"""Depth (m) of skin through which lines show, on an adult's face."""
NORMAL_LENGTH = 0.007
"""Metres, on an adult's face."""
NORMAL_CELL = 0.0045
"""One normal is drawn in each cube of this size (m)."""
NORMAL_OPACITY = (0.95, 0.55)
"""At its foot and at its tip."""
EYEBALL_RINGS = (14, 20)
"""Of an eyeball, which has no mesh of its own."""
GRID_REACH = 7.0
"""Radius of the grid under a body, in steps."""


@dataclass(frozen=True, eq=False)
class Posture:
    """The pose of a view: FAPs (68,), the face's matrix (4, 4) into the world, joints (J, 4, 4) or None."""

    faps: Float32
    face: Float64
    joints: Float64 | None


class DisplayOptions:
    """Applies switches to views of one face, on a body with these bones or None."""

    def __init__(self, figure: FaceFigure, bones: Bones | None) -> None:
        self._figure = figure
        self._bones = bones
        self._wires = Wireframe()
        self._heatmap: FapHeatmap | None = None
        self._scale = figure.scale

    @cached_property
    def _pivots(self) -> Pivots:
        return find_pivots(self._figure.model, self._scale)

    @cached_property
    def _points_of_face(self) -> tuple[Bool, tuple[str, ...]]:
        """bool (84,), the feature points that the face has, and their names."""
        known = np.asarray(np.isfinite(self._figure.model.points).all(axis=1))
        return known, tuple(np.array(names())[known].tolist())

    def apply(self, view: View, switches: Switches, posture: Posture) -> View:
        """Return the view with the switches applied."""
        if not switches.changed:
            return view
        view = replace(self._hide_parts(view, switches), lod=str(switches["lod"]))
        extras = Extras()
        number = switches["influence"]
        if number is not None:
            heatmap = self._fap_heatmap(int(number))
            faces = heatmap.paint([mesh for mesh in view.faces if mesh.shape.kind not in HAIRS])
            view = replace(view, faces=faces, meshes=[*view.meshes, *heatmap.eyes(view.eyes)], eyes=[])
            extras = replace(extras, legend=heatmap.legend)
        lines = []
        if switches["wireframe"] or switches["normals"]:
            view = replace(view, lod="0")  # lines lie on all triangles
        if switches["wireframe"]:
            lines.append(self._wires.edges(view.faces, view.meshes, view.eyes, self._scale))
        if switches["normals"]:
            surfaces = [mesh for mesh in view.faces if mesh.shape.kind not in HAIRS]
            lines.append(self._wires.normals(surfaces, self._scale))
        if switches["skeleton"] != "off":
            if switches["skeleton"] == "through":
                shells = tuple(mesh for mesh in view.faces if mesh.shape.kind not in INSIDE)
                extras = replace(extras, shells=shells)
            view = replace(view, faces=[], eyes=[], meshes=[], capsules=self._skeleton(posture))
        if switches["grid"]:
            extras = replace(extras, grid=self._grid(posture.joints))
        dots = (self._dots(posture, over=len(view.marks) == 0),) if switches["points"] else ()
        background = BACKGROUNDS[str(switches["background"])]
        extras = replace(extras, lines=tuple(lines), dots=dots)
        return replace(view, extras=extras, background=background)

    def _hide_parts(self, view: View, switches: Switches) -> View:
        hidden = {kind for name, kinds in HIDDEN_KINDS.items() if not switches[name] for kind in kinds}
        if hidden:
            view = replace(view, faces=[mesh for mesh in view.faces if mesh.shape.kind not in hidden])
        if "eye" in hidden:
            view = replace(view, eyes=[])
        if not switches["wrinkles"]:
            view = replace(view, faces=[mesh._replace(wrinkles=None) for mesh in view.faces])
        if not switches["shadows"]:
            unshaded = np.array(UNSHADED, dtype=np.float32)
            faces = [
                mesh._replace(light=np.broadcast_to(unshaded, (len(mesh.positions), 4)), limbs=None)
                for mesh in view.faces
            ]
            view = replace(view, faces=faces, blobs=view.blobs[:0])
        return view

    def _grid(self, joints: Float64 | None) -> Grid:
        """Return metres on the floor around a body's root, or tenths of a head below a head alone."""
        if joints is not None:
            return Grid(0.0, 1.0, (float(joints[0, 0, 3]), float(joints[0, 2, 3])), GRID_REACH)
        x, _, z = self._figure.subject.centre
        lowest = float(self._figure.model.vertices[:, 1].min())
        step = 10.0 ** round(np.log10(max(self._scale, 1e-9)) - 1)
        return Grid(lowest, step, (x, z), step * 2 * GRID_REACH)

    def _fap_heatmap(self, number: int) -> FapHeatmap:
        if self._heatmap is None or self._heatmap.fap.number != number:
            self._heatmap = FapHeatmap(self._figure, number)
        return self._heatmap

    def _skeleton(self, posture: Posture) -> Float32:
        """Return the capsules of all joints of the body and of the head."""
        turned = posture.face @ self._figure.pose(posture.faps).turn
        head = self._pivots.capsules(turned)
        if self._bones is None or posture.joints is None:
            return head
        return np.concatenate([self._bones.capsules(posture.joints), head])

    def _dots(self, posture: Posture, *, over: bool) -> Dots:
        """Return the feature points with names. over: whether to draw the dots themselves."""
        figure, (known, point_names) = self._figure, self._points_of_face
        points = figure.points(posture.faps, posture.face)[known]
        pose = figure.pose(posture.faps)
        bound = figure.model.bound[known]
        turned = (posture.face @ pose.turn)[:3, :3]
        facing = np.where(bound[:, None] >= 0, pose.normals[bound] @ turned.T, turned[:, 2])
        radius, lift = (DOT_RADIUS, DOT_LIFT) if over else (0.0, NAME_LIFT)
        looks = radius, lift * self._scale, point_names, facing.astype(np.float32)
        return Dots(points.astype(np.float32), DOT, *looks, MAX_DOT_RADIUS * self._scale)


class Wireframe:
    """Lines along edges and normals; the edges of each shape are cached."""

    def __init__(self) -> None:
        self._edges: WeakKeyDictionary[FaceShape | MeshShape, Int32] = WeakKeyDictionary()
        self._thinned: WeakKeyDictionary[FaceShape, Intp] = WeakKeyDictionary()

    def edges(self, faces: list[FaceMesh], meshes: list[Mesh], eyes: list[Eye], scale: float) -> Lines:
        """Return all edges, each once. scale: size of the face, 1 for an adult's."""
        ends: list[Float32 | Float64] = [np.zeros((0, 2, 3), dtype=np.float32)]
        ends += [world_positions(mesh)[self._unique_edges(mesh.shape)] for mesh in faces]
        ends += [transform(mesh.positions, mesh.matrix)[self._unique_edges(mesh.shape)] for mesh in meshes]
        ends += [transform(_eyeball_edges(), eye.matrix) for eye in eyes]
        return Lines(np.concatenate(ends).astype(np.float32), WIRE, 1.0, WIRE_LIFT * scale)

    def normals(self, faces: list[FaceMesh], scale: float) -> Lines:
        """Return a line at each vertex, or at some of many; red, green and blue stand for x, y and z."""
        ends, colours = [np.zeros((0, 2, 3), np.float32)], [np.zeros((0, 2, 4), np.float32)]
        for mesh in faces:
            if mesh.shape not in self._thinned:
                self._thinned[mesh.shape] = _thinned(mesh, NORMAL_CELL * scale)
            rows = self._thinned[mesh.shape]
            foot, normal = world_positions(mesh)[rows], world_normals(mesh)[rows]
            ends.append(np.stack([foot, foot + normal * np.float32(NORMAL_LENGTH * scale)], axis=1))
            shade = np.ones((len(rows), 2, 4), dtype=np.float32)
            shade[..., :3] = (normal * 0.5 + 0.5)[:, None]
            shade[..., 3] = NORMAL_OPACITY
            colours.append(shade)
        return Lines(np.concatenate(ends), np.concatenate(colours), 1.2, WIRE_LIFT * scale)

    def _unique_edges(self, shape: FaceShape | MeshShape) -> Int32:
        if shape not in self._edges:
            self._edges[shape] = unique_edges(shape.triangles)
        return self._edges[shape]


def unique_edges(triangles: Int32) -> Int32:
    """Return int32 (E, 2): the edges of triangles (F, 3), each once, the smaller index first."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return np.unique(edges, axis=0).astype(np.int32)


@cache
def _eyeball_edges() -> Float32:
    """Return float32 (E, 2, 3): the ends of the edges of a unit sphere."""
    vertices, triangles = sphere_mesh(*EYEBALL_RINGS)
    return vertices[unique_edges(triangles)]


def _thinned(mesh: FaceMesh, cell: float) -> Intp:
    """Return the indices (N,) of the first vertex used by triangles in each cell of this size (m)."""
    used = np.unique(mesh.shape.triangles)
    cells = np.floor(mesh.positions[used] / max(cell, 1e-9)).astype(np.int64)
    first: Intp = np.unique(cells, axis=0, return_index=True)[1]
    return used[np.sort(first)].astype(np.intp)
