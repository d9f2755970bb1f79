"""The face as its feature points: a sphere at every point, thin lines through those that belong together.

Behind them stands the head itself in one dull colour, so that what lies on its far side stays hidden.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.face.feature_points import row_of
from fba.face.points import FeaturePointFace
from player.head.head import IRIS_SHARE, Head
from player.head.loops import Curve, brow, lid, lip, spline_basis
from player.head.parts import hollow
from player.head.surface import Skin, to_chart
from player.primitives import tube_mesh
from player.shapes import Mesh, MeshShape, Normals, spheres, srgb

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]

POINT = (*srgb("#f0a04b"), 0.3)
POINT_RADIUS = 0.00125
PUPIL_RADIUS = 0.0008
GHOST = (*srgb("#868d97"), 0.0)
EYEBALL = (*srgb("#c9cdd2"), 0.35)
INSET = 0.0003
"""The head is drawn this far (m) inside its skin."""
EYE_INSET = 0.0012
RAISED = 0.003
AROUND = 8
COLOURS = {
    "lip": srgb("#e0685f"),
    "brow": srgb("#2f2a28"),
    "lid": srgb("#1f3d5c"),
    "fold": srgb("#54708c"),
    "plain": srgb("#d3d8de"),
    "iris": srgb("#2f6f8f"),
    "pupil": srgb("#101418"),
}
RADII = {"lip": 0.0007, "brow": 0.0011, "lid": 0.0006, "fold": 0.0004, "plain": 0.0005, "iris": 0.0005,
         "pupil": 0.0003}  # fmt: skip
FOLDS = (
    ("3.11", "3.13", "3.7"),
    ("3.11", "3.9", "3.7"),
    ("3.8", "3.14", "3.12"),
    ("3.8", "3.10", "3.12"),
)
"""Outer contours of the lids."""
ON_SKIN = (
    ("9.12", "9.3", "9.15"),
    ("9.6", "9.14", "9.2", "9.4", "9.15", "9.5", "9.1", "9.13", "9.7"),
    ("10.8", "2.14", "2.12", "2.1", "2.11", "2.13", "10.7"),
)
"""Nose from above and from the side, jaw."""
EARS = (
    ("10.9", "10.1", "10.3", "10.5", "10.7"),
    ("10.10", "10.2", "10.4", "10.6", "10.8"),
)
FINER = 8
"""Steps between two points of a chain."""
RING = 24


@dataclass(frozen=True, eq=False)
class Line:
    """A curve that feature points move. eyeball: 0 left, 1 right for those that slide over one."""

    curve: Curve
    kind: str
    eyeball: int | None = None


class Drawing:
    """What a head's feature points look like: `marks` and `meshes` take the FAPs and the head's matrix."""

    def __init__(self, head: Head) -> None:
        self._head = head
        self._face = face = head.face
        lines = _lines(face)
        self._lids = [
            (start, start + len(line.curve.places), line.eyeball)
            for line, start in zip(lines, _starts(lines), strict=True)
            if line.eyeball is not None
        ]
        self._places = np.concatenate([line.curve.places for line in lines])
        self._weights = np.concatenate([line.curve.weights for line in lines])
        self._tubes = _Tubes([(line.kind, len(line.curve.places)) for line in lines], face, RAISED)
        self._rims = _Tubes([(kind, RING + 1) for _ in range(2) for kind in ("iris", "pupil")], face)
        self._mouth = hollow(face)
        self._mouth_shape = MeshShape(self._mouth.triangles, self._mouth.colours.astype(np.float32), True)
        self._mouth_normals = Normals(self._mouth.triangles, len(self._mouth.vertices))
        pupils = [row_of()["3.5"], row_of()["3.6"]]
        self._sizes = np.full(len(face.points), POINT_RADIUS)
        self._sizes[pupils] = PUPIL_RADIUS

    def marks(self, faps: Float32, matrix: Float64) -> Float32:
        """(84, 16) capsules: a sphere at every feature point that FAPs (68,) move."""
        return spheres(_moved(matrix, self._face.local(faps)), self._sizes, POINT)

    def eyeballs(self, faps: Float32, matrix: Float64) -> Float32:
        """(2, 16) capsules: plain eyeballs."""
        centres = _moved(matrix, self._face.eyeballs(faps).centres[0])
        return spheres(centres, np.full(2, self._face.eyeball_radius - EYE_INSET), EYEBALL)

    def meshes(self, faps: Float32, matrix: Float64, *, bust: Float64 | None = None) -> list[Mesh]:
        """The lines, and the head (with neck and shoulders where bust, their matrix, is given) behind."""
        moved = self._face.local(faps) - self._face.points
        places = self._places + self._weights @ moved
        self._clear_eyes(places, faps)
        mouth = (self._mouth.vertices + self._mouth.weights @ moved).astype(np.float32)
        return [
            *self._head.ghost(faps, matrix, GHOST, INSET, bust=bust),
            Mesh(self._mouth_shape, mouth, self._mouth_normals(mouth), matrix),
            self._tubes.mesh(places, matrix),
            self._rims.mesh(np.concatenate(self._rings(faps)), matrix),
        ]

    def _clear_eyes(self, places: Float64, faps: Float32) -> None:
        """Lids slide over the eyeball, as those of the head do."""
        centres = self._face.eyeballs(faps).centres[0]
        for start, end, ball in self._lids:
            offset = places[start:end] - centres[ball]
            distance = np.linalg.norm(offset, axis=1, keepdims=True)
            least = self._face.eyeball_radius
            places[start:end] = centres[ball] + offset * np.maximum(least / np.maximum(distance, 1e-6), 1.0)

    def _rings(self, faps: Float32) -> list[Float64]:
        """Rims of iris and pupil of both eyes, (RING + 1, 3) each."""
        balls, radius = self._face.eyeballs(faps), self._face.eyeball_radius
        turn = np.linspace(0, 2 * np.pi, RING + 1)
        circle = np.stack([np.cos(turn), np.sin(turn)], axis=1)
        found = []
        for side in range(2):
            forward = balls.gaze[0, side]
            right = np.cross((0.0, 1.0, 0.0), forward)
            right /= max(float(np.linalg.norm(right)), 1e-9)
            across = circle @ np.stack([right, np.cross(forward, right)])
            pupil = min(float(balls.pupils[0, side]) / 2 / radius, IRIS_SHARE)
            for share in (IRIS_SHARE, max(pupil, 0.02)):
                ring = across * share + forward * np.sqrt(1 - share**2)
                found.append(balls.centres[0, side] + ring * (radius - EYE_INSET + 0.0003))
        return found


class _Tubes:
    """Tubes along lines of a kind and a number of places each; only the places change."""

    def __init__(self, lines: list[tuple[str, int]], face: FeaturePointFace, raised: float = 0.0) -> None:
        self._hinge = face.jaw_hinge
        self._lengths = [count for _, count in lines]
        self._radii = np.concatenate([np.full(count, RADII[kind]) for kind, count in lines])
        colours = [np.tile([*COLOURS[kind], 0.0], (count * AROUND, 1)) for kind, count in lines]
        starts = np.cumsum([0, *self._lengths[:-1]]) * AROUND
        triangles = [tube_mesh(n, AROUND) + start for n, start in zip(self._lengths, starts, strict=True)]
        self._shape = MeshShape(
            np.concatenate(triangles).astype(np.int32),
            np.concatenate(colours).astype(np.float32),
            two_sided=True,
            raised=raised,
        )

    def mesh(self, places: Float64, matrix: Float64) -> Mesh:
        """Tubes along places (N, 3), all lines one after the other: a ring about every place."""
        along = np.concatenate([
            np.gradient(line, axis=0) for line in np.split(places, np.cumsum(self._lengths)[:-1])
        ])  # fmt: skip
        # Lines lie on a head: what points out of it is never along one.
        aside = _unit(np.cross(along, places - self._hinge))
        out = _unit(np.cross(aside, along))
        turn = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)
        normals = aside[:, None] * np.cos(turn)[:, None] + out[:, None] * np.sin(turn)[:, None]
        positions = places[:, None] + normals * self._radii[:, None, None]
        flat = [part.reshape(-1, 3).astype(np.float32) for part in (positions, normals)]
        return Mesh(self._shape, flat[0], flat[1], matrix)


def _lines(face: FeaturePointFace) -> list[Line]:
    skin = Skin(face)
    found = []
    for upper in (True, False):
        found += [Line(lip(face, upper=upper, inner=inner), "lip") for inner in (True, False)]
        margin = lid(face, upper=upper, fold=False)
        found += [Line(margin, "lid", 0), Line(margin.mirrored(), "lid", 1)]
    found += [Line(brow(face), "brow"), Line(brow(face).mirrored(), "brow")]
    found += [Line(_chain(face, chain, skin), "fold") for chain in FOLDS]
    found += [Line(_chain(face, chain, skin), "plain") for chain in ON_SKIN]
    return found + [Line(_chain(face, chain), "plain") for chain in EARS]


def _starts(lines: list[Line]) -> list[int]:
    return [int(n) for n in np.cumsum([0] + [len(line.curve.places) for line in lines[:-1]])]


def _chain(face: FeaturePointFace, chain: tuple[str, ...], skin: Skin | None = None) -> Curve:
    """A spline through feature points, bent to follow the skin between them."""
    rows = [row_of()[name] for name in chain]
    knots = face.points[rows]
    gaps = np.sqrt(np.linalg.norm(np.diff(knots, axis=0), axis=1))  # keeps sharp turns from swinging out
    along = np.concatenate([[0.0], np.cumsum(gaps)])
    at = np.interp(np.linspace(0, len(chain) - 1, (len(chain) - 1) * FINER + 1), np.arange(len(chain)), along)
    basis = spline_basis(along, at)
    weights = np.zeros((len(at), len(face.points)))
    weights[:, rows] = basis
    places = basis @ knots
    if skin is not None:
        missed = knots - skin.places(to_chart(knots))  # the skin passes its points within a fraction of a mm
        places = skin.places(to_chart(places)) + basis @ missed
    return Curve(places, weights)


def _unit(vectors: Float64) -> Float64:
    unit: Float64 = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
    return unit


def _moved(matrix: Float64, places: npt.NDArray[np.floating]) -> Float64:
    moved: Float64 = places @ matrix[:3, :3].T + matrix[:3, 3]
    return moved
