"""`MarkedHead`: a head for virtual markers, a face model or a mesh without FAPs."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np

from fba.arrays import Array, Float64, Int32, Intp
from fba.capture.virtual_markers.influence import WalkedMesh
from fba.choices import UpAxis
from fba.errors import ModelError
from fba.face import Deformer, FaceModel, Part
from fba.face import feature_point_names as names
from fba.face.authoring.surface.attached_parts import attach
from fba.face.authoring.surface.binding import SURFACE_KINDS
from fba.face.authoring.surface.landmarks import Landmarks, find_landmarks, weld_skin
from fba.face.authoring.surface.surface import Surface
from fba.face.importers import import_model, sniff
from fba.face.importers.assembly.model import metres_per_unit
from fba.face.importers.head_surface import HeadSurface, read_head_surface
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import FAP_COUNT, feature_points, point_rows

BUILT_IN = "built-in head"
DEFAULT_HEIGHT = 0.26
"""Assumed height, in metres, of a head whose unit is unknown."""
OUTER_GROUPS = ("2", "4", "5", "8", "9", "11")
"""Groups of feature points on the outer skin of a face."""
DIGEST_DIGITS = 16
"""Hexadecimal digits of a digest that tell meshes apart."""
ON_SKIN = ("brow", "lash")
"""Kinds of parts that follow the skin around their roots."""
IN_MOUTH = ("teeth", "tongue")
"""Kinds of parts that follow the chin as far as the jaw's FAP moves them."""
OPEN_JAW = 3
"""Number of the FAP that opens the jaw."""
OPEN_JAW_VALUE = 300
"""Value of that FAP, in MNS, at which the movement of teeth and tongue is measured."""
CHIN_POINTS = ("2.1", "2.10")
MAX_PIECE_DISTANCE = 0.006
"""Largest distance from the skin, in metres, of all vertices of a piece that follows it."""
MAX_PIECE_SIZE = 0.08
"""Largest extent, in metres, of a piece that follows the skin."""
Followed = tuple[Intp, Intp, Float64]
"""Vertices of the head, vertices of the skin that they follow, and the shares of its movement."""


@dataclass(frozen=True, eq=False)
class MarkedHead:
    """A head whose vertices markers can move.

    name: of its file, or "built-in head". parts: its surfaces, +x the subject's left, +y up, +z front, in the
    unit of the file. rows: for each part intp (V,), the numbers of its vertices in the head. vertices:
    float64 (N, 3), in the numbering of the file; of a face model, all parts in order. points: float64
    (84, 3), feature points, NaN where unknown. bound: int32 (84,), their vertices, -1 for none. metres: per
    unit. model: the face model, or None.
    """

    name: str
    parts: tuple[Part, ...]
    rows: tuple[Intp, ...]
    vertices: Float64
    points: Float64
    bound: Int32
    metres: float
    model: FaceModel | None = None

    @cached_property
    def triangles(self) -> Int32:
        """int32 (F, 3), of all parts, indices into `vertices`."""
        return np.concatenate(
            [rows[part.triangles] for part, rows in zip(self.parts, self.rows, strict=True)]
        ).astype(np.int32)

    @cached_property
    def skin(self) -> Surface:
        """The surface of virtual markers, with vertices at seams joined; lips that touch stay apart."""
        skins = [n for n, part in enumerate(self.parts) if part.kind in SURFACE_KINDS]
        chosen = skins if self.model is not None and skins else range(len(self.parts))
        triangles = np.concatenate([self.rows[n][self.parts[n].triangles] for n in chosen])
        whole = Part("whole", "skin", self.vertices.astype(np.float32), triangles.astype(np.int32))
        return weld_skin([whole], self.bound)

    @cached_property
    def walked(self) -> WalkedMesh:
        """The skin, prepared for walks; its vertices are those of `skin`."""
        return WalkedMesh(self.skin.vertices, self.skin.triangles)

    @cached_property
    def followers(self) -> Any:
        """Sparse float64 (N, S): the share of each skin vertex's movement that each vertex makes."""
        return find_followers(self.parts, self.rows, self.skin, self.metres, self.model)

    @cached_property
    def landmarks(self) -> Landmarks | None:
        """Contours on the skin, in metres; None without the needed feature points."""
        try:
            return find_landmarks(self.skin, self.points * self.metres, self.bound)
        except ModelError:  # a face without units
            return None

    @cached_property
    def face(self) -> Intp:
        """Vertices (K,) of the piece of skin with most of the feature points, or else the largest."""
        component = self.skin.component
        number = self.skin.number
        used = np.unique(self.triangles)
        outside = [
            row for row, point in enumerate(feature_points()) if point.name.split(".")[0] in OUTER_GROUPS
        ]
        bound = self.bound[outside]
        counted = number[bound[bound >= 0]] if (bound >= 0).any() else number[used]
        main = int(np.bincount(component[counted]).argmax())
        return np.asarray(used[component[number[used]] == main], dtype=np.intp)

    @cached_property
    def connectivity(self) -> str:
        """A digest of the triangles: meshes that share it have the same vertex numbers."""
        return _digest(self.triangles, "<i4")

    @cached_property
    def shape(self) -> str:
        """A digest of the vertices, in single precision."""
        return _digest(self.vertices, "<f4")

    def nearest(self, place: Float64) -> tuple[int, float]:
        """Return the vertex of the face nearest to a place (3,), and its distance."""
        away = np.linalg.norm(self.vertices[self.face] - place, axis=1)
        best = int(away.argmin())
        return int(self.face[best]), float(away[best])


def _digest(array: Array, kind: str) -> str:
    return sha256(np.ascontiguousarray(array, dtype=kind).tobytes()).hexdigest()[:DIGEST_DIGITS]


def head_of_model(model: FaceModel, name: str = BUILT_IN) -> MarkedHead:
    """Return a face model as a head for virtual markers; its unit is the metre."""
    starts = [model.starts[part.name] for part in model.parts]
    rows = tuple(
        np.arange(start, start + len(part.vertices)) for start, part in zip(starts, model.parts, strict=True)
    )
    return MarkedHead(
        name, model.parts, rows, model.vertices.astype(np.float64), model.points, model.bound, 1.0, model
    )


def head_of_surface(surface: HeadSurface) -> MarkedHead:
    """Return the surface of a head file as a head for virtual markers, in the file's unit, upright."""
    turn = surface.upright
    vertices = surface.vertices @ turn.T
    parts, rows = [], []
    for number, part in enumerate(surface.parts):
        row = np.zeros(len(part.vertices), dtype=np.intp)
        row[part.triangles] = surface.triangles[surface.part_of == number]
        assert part.normals is not None
        normals = (part.normals @ turn.T).astype(np.float32)
        parts.append(replace(part, vertices=(part.vertices @ turn.T).astype(np.float32), normals=normals))
        rows.append(row)
    points = surface.given.points @ turn.T
    bound = np.full(len(names()), -1, dtype=np.int32)
    for name, vertex in surface.given.vertices.items():
        bound[point_rows()[name]] = vertex
        points[point_rows()[name]] = vertices[vertex]
    used = vertices[np.unique(surface.triangles)]
    try:
        metres = metres_per_unit(points)[0]
    except ModelError:  # no eyes are known
        metres = DEFAULT_HEIGHT / max(float(np.ptp(used[:, 1])), 1e-30)
    return MarkedHead(Path(surface.path).name, tuple(parts), tuple(rows), vertices, points, bound, metres)


def read_head(
    path: str | os.PathLike[str] | None = None,
    *,
    kind: str | None = None,
    points: object = None,
    up: UpAxis = "y",
    kinds: Mapping[str, str] | None = None,
    limits: Limits = DEFAULT_LIMITS,
) -> MarkedHead:
    """Return the head in a file; None for the built-in head. Arguments and errors as of `import_model`.

    A face model of this project, MakeHuman's head and FDP files become models; any other mesh (OBJ, PLY,
    Candide, glTF) keeps the numbers of its vertices, and needs no feature points.
    """
    if path is None:
        return head_of_model(FaceModel.default())
    form = sniff(path) if kind is None else kind
    name = Path(path).name
    if form in ("makehuman", "fdp", "shapes"):
        return head_of_model(import_model(path, kind=form, kinds=kinds, limits=limits), name)
    surface = read_head_surface(path, kind=form, points=points, up=up, kinds=kinds, limits=limits)
    if surface.origin == "of the model":
        return head_of_model(FaceModel.load(path, limits=limits), name)
    return head_of_surface(surface)


def find_followers(
    parts: Sequence[Part], rows: Sequence[Intp], skin: Surface, metres: float, model: FaceModel | None
) -> Any:
    """Return the share of each skin vertex's movement that each vertex of a head makes: sparse (N, S).

    parts, rows, metres, model: as of `MarkedHead`. skin: of the head; its `number` has N vertices. Vertices
    of the skin follow themselves. Of a face model, brows and lashes follow the skin around their roots, teeth
    and tongue the chin as far as FAP 3 moves them. Of another head, small pieces follow the skin if they are
    close to it.
    """
    from scipy.sparse import csr_array

    if model is None:
        followed = _small_pieces(skin, metres)
    else:
        followed = []
        opened = _jaw_opening(model)
        for part, numbers in zip(parts, rows, strict=True):
            if part.kind in ON_SKIN and len(part.triangles):
                anchors = attach(skin, part)
                corners = skin.triangles[anchors.triangles]
                followed.append((np.repeat(numbers, 3), corners.ravel(), anchors.shares.ravel()))
            elif part.kind in IN_MOUTH:
                followed += _follow_jaw(model, skin, numbers, opened)
    alone = np.ones(len(skin.number), dtype=bool)
    for vertices, _, _ in followed:
        alone[vertices] = False
    themselves = np.flatnonzero(alone)
    followed.append((themselves, skin.number[themselves], np.ones(len(themselves))))
    vertices, leaders, shares = (np.concatenate(columns) for columns in zip(*followed, strict=True))
    return csr_array((shares, (vertices, leaders)), shape=(len(skin.number), len(skin)))


def _follow_jaw(model: FaceModel, skin: Surface, rows: Intp, opened: Float64) -> list[Followed]:
    """Return how vertices follow the chin, as far as the jaw moves them; empty if it does not.

    opened: float64 (N, 3), displacement of each vertex when the jaw opens.
    """
    chin = next((int(model.bound[point_rows()[name]]) for name in CHIN_POINTS), -1)
    whole = float(np.linalg.norm(opened[chin])) if chin >= 0 else 0.0
    if not whole > 0:
        return []
    share = np.minimum(np.linalg.norm(opened[rows], axis=1) / whole, 1.0)
    moved = np.flatnonzero(share)
    return [(rows[moved], np.full(len(moved), skin.number[chin]), share[moved])]


def _jaw_opening(model: FaceModel) -> Float64:
    """Return the displacement of each vertex when the jaw opens: float64 (N, 3), metres."""
    faps = np.zeros(FAP_COUNT, dtype=np.float32)
    deformer = Deformer(model)
    rest = deformer.local(faps).astype(np.float64)
    faps[OPEN_JAW - 1] = OPEN_JAW_VALUE
    return deformer.local(faps) - rest


def _small_pieces(skin: Surface, metres: float) -> list[Followed]:
    """Return how small connected pieces follow the largest piece, if they lie on it."""
    from scipy.spatial import cKDTree

    used = np.unique(skin.triangles)
    sizes = np.bincount(skin.component[used])
    if (sizes > 0).sum() < 2:
        return []
    largest = int(sizes.argmax())
    main = used[skin.component[used] == largest]
    others = used[skin.component[used] != largest]
    away, nearest = cKDTree(skin.vertices[main]).query(skin.vertices[others])
    piece = skin.component[others]
    farthest = np.zeros(len(sizes))
    np.maximum.at(farthest, piece, away)
    low, high = np.full((len(sizes), 3), np.inf), np.full((len(sizes), 3), -np.inf)
    np.minimum.at(low, piece, skin.vertices[others])
    np.maximum.at(high, piece, skin.vertices[others])
    lies = (farthest * metres < MAX_PIECE_DISTANCE) & ((high - low).max(axis=1) * metres < MAX_PIECE_SIZE)
    leader = np.full(len(skin), -1)
    leader[others[lies[piece]]] = main[nearest[lies[piece]]]
    vertices = np.flatnonzero(leader[skin.number] >= 0)
    return [(vertices, leader[skin.number[vertices]], np.ones(len(vertices)))]
