"""The built-in head of the player: FAPs in, meshes and eyes out.

A stand-in with the proportions of the neutral feature points, which it follows exactly; a face model
with a mesh of its own takes its place behind the same two calls, `meshes` and `eyes`.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt

from fba.face.feature_points import row_of
from fba.face.points import FeaturePointFace
from player.head import parts
from player.head.hairline import HAIR_AXIS, hairline
from player.head.surface import Surface, build
from player.shapes import Eye, Mesh, MeshShape, Normals

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]

IRIS_SHARE = 0.49
"""Radius of the iris by radius of the eyeball."""
CORNER = 0.006
"""Metres about the corners of the eyes where normals are averaged."""
HAIR_THICKNESS = 0.008


class Head:
    """A head that follows the feature points of a face.

    Building it takes about half a second; `Head.default()` does so once a process.
    """

    def __init__(self, face: FeaturePointFace | None = None) -> None:
        self.face = face or FeaturePointFace()
        self._surface = surface = build(self.face)
        self._weights = _sparse(surface.weights)
        coloured, neutral = _painted(surface, self.face)
        self._neutral = neutral.astype(np.float32)
        self._bald = surface.vertices.astype(np.float32)
        self._ghosts: dict[tuple[float, ...], list[MeshShape]] = {}
        self._skin = MeshShape(surface.triangles, coloured.astype(np.float32))
        self._skin_normals = Normals(surface.triangles, len(neutral))
        pieces = [parts.ear(self.face, side) for side in ("left", "right")]
        pieces += [parts.teeth(self.face, upper=upper) for upper in (True, False)]
        pieces += [parts.tongue(self.face), parts.hollow(self.face)]
        self._rest = _joined(pieces)
        self._rest_shape = MeshShape(
            self._rest.triangles, self._rest.colours.astype(np.float32), two_sided=True
        )
        self._rest_normals = Normals(self._rest.triangles, len(self._rest.vertices))
        self._rest_weights = _sparse(self._rest.weights)
        self._smooth, self._corners = _corner_smoothing(surface, self.face)
        self._hair = _joined_hair(parts.brows_and_lashes(surface))
        self._hair_shape = MeshShape(
            self._hair.triangles, self._hair.colours.astype(np.float32), two_sided=True
        )
        self._hair_normals = Normals(self._hair.triangles, len(self._hair.offsets))
        bust = parts.neck()
        bust_normals = Normals(bust.triangles, len(bust.vertices))(bust.vertices.astype(np.float32))
        self._bust = (
            MeshShape(bust.triangles, bust.colours.astype(np.float32), two_sided=True),
            bust.vertices.astype(np.float32),
            bust_normals,
        )
        self._mouth_height = float(self.face.points[row_of()["2.2"], 1])
        self._lips = [surface.parts[f"lip inner {which}"] for which in ("upper", "lower")]
        self._eye_region = [
            np.flatnonzero(
                np.linalg.norm(surface.vertices - centre, axis=1) < self.face.eyeball_radius + 0.007
            )
            for centre in self.face.eyeball_centres
        ]
        margins = np.concatenate([rows for name, rows in surface.parts.items() if "margin" in name])
        self._lid_gap = [np.where(np.isin(rows, margins), 0.0005, 0.0009) for rows in self._eye_region]
        aside, above = np.abs(surface.vertices[:, 0]), np.abs(surface.vertices[:, 1] - self._mouth_height)
        grip = (1 - _step(aside, 0.028, 0.042)) * (1 - _step(above, 0.010, 0.026))
        self._mouth = np.flatnonzero((grip > 0) & (surface.vertices[:, 2] > -0.03))
        self._mouth_grip = grip[self._mouth]

    @staticmethod
    def default() -> Head:
        """The head of the neutral face; always the same object."""
        return _default()

    def meshes(self, faps: Float32, matrix: Float64, *, bust: Float64 | None = None) -> list[Mesh]:
        """The head moved by FAPs (68,), without head rotation, put into the world by matrix (4, 4).

        bust: matrix for neck and shoulders, where they are to be shown.
        """
        moved = (self.face.local(faps) - self.face.points).astype(np.float32)
        skin = self._skin_at(faps, moved, self._neutral)
        rest = (self._rest.vertices + self._rest_weights @ moved).astype(np.float32)
        hair = (skin[self._hair.rows] + self._hair.offsets).astype(np.float32)
        found = [
            Mesh(self._skin, skin, self._normals_of(skin), matrix),
            Mesh(self._rest_shape, rest, self._rest_normals(rest), matrix),
            Mesh(self._hair_shape, hair, self._hair_normals(hair), matrix),
        ]
        if bust is not None:
            found.append(Mesh(*self._bust, bust))
        return found

    def eyes(self, faps: Float32, matrix: Float64) -> list[Eye]:
        """The two eyeballs, left first."""
        balls = self.face.eyeballs(faps)
        points = self.face.local(faps)
        radius = self.face.eyeball_radius
        found = []
        for side, lids in ((0, ("3.1", "3.3", "3.7", "3.11")), (1, ("3.2", "3.4", "3.12", "3.8"))):
            forward = balls.gaze[0, side]
            right = np.cross((0.0, 1.0, 0.0), forward)
            right /= max(float(np.linalg.norm(right)), 1e-9)
            frame = np.eye(4)
            frame[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1) * radius
            frame[:3, 3] = balls.centres[0, side]
            places = (points[[row_of()[name] for name in lids]] - balls.centres[0, side]) / radius
            pupil = float(balls.pupils[0, side]) / 2 / radius
            found.append(
                Eye(
                    matrix @ frame,
                    IRIS_SHARE,
                    float(np.clip(pupil, 0.02, IRIS_SHARE * 0.95)),
                    places.astype(np.float64),
                    matrix[:3, :3],
                )
            )
        return found

    def ghost(
        self,
        faps: Float32,
        matrix: Float64,
        colour: tuple[float, ...],
        inset: float,
        *,
        bust: Float64 | None = None,
    ) -> list[Mesh]:
        """The skin without hair in one colour (with gloss, 4), `inset` metres further in; bust as above."""
        if colour not in self._ghosts:
            seen = self._bust[0].triangles
            top = np.all(
                (np.abs(self._bust[1][:, :1]) < 0.035) & (self._bust[1][:, 1:] > np.array([-0.100, -0.075])),
                axis=1,
            )  # the top of the neck would show in an empty mouth
            seen = seen[~top[seen].all(axis=1)]
            self._ghosts[colour] = [
                MeshShape(triangles, np.tile(colour, (len(shape.colours), 1)).astype(np.float32), two)
                for shape, triangles, two in (
                    (self._skin, self._skin.triangles, False),
                    (self._bust[0], seen, True),
                )
            ]
        skin_shape, bust_shape = self._ghosts[colour]
        moved = (self.face.local(faps) - self.face.points).astype(np.float32)
        skin = self._skin_at(faps, moved, self._bald)
        normals = self._normals_of(skin)
        found = [Mesh(skin_shape, skin - normals * np.float32(inset), normals, matrix)]
        if bust is not None:
            found.append(Mesh(bust_shape, *self._bust[1:], bust))
        return found

    def _skin_at(self, faps: Float32, moved: Float32, neutral: Float32) -> Float32:
        """Vertices of the skin for FAPs (68,) that move feature points by `moved` (84, 3)."""
        skin: Float32 = neutral + self._weights @ moved
        self._close_lips(skin)
        self._clear_teeth(skin)
        self._clear_eyes(skin, faps)
        return skin

    def _normals_of(self, skin: Float32) -> Float32:
        """Normals of the skin, averaged at the corners of the eyes, whose folds are finer than the mesh."""
        normals = self._skin_normals(skin)
        blended = self._smooth @ normals
        normals[self._corners] = blended / np.linalg.norm(blended, axis=1, keepdims=True).clip(1e-6)
        return normals

    def _close_lips(self, skin: Float32) -> None:
        """Lips that would pass through each other meet half way instead."""
        upper, lower = self._lips[0][1:-1], self._lips[1]
        overlap = np.maximum(skin[lower, 1] - skin[upper, 1], 0) / 2
        skin[lower, 1] -= overlap
        skin[upper, 1] += overlap

    def _clear_teeth(self, skin: Float32) -> None:
        """Lips and the skin around them slide over the arch of the teeth."""
        x = skin[self._mouth, 0]
        front = self.face.points[row_of()["9.10"], 2] + parts.edge_depth(x / parts.ARCH, parts.ARCH) + 0.0032
        skin[self._mouth, 2] += np.maximum(front - skin[self._mouth, 2], 0) * self._mouth_grip

    def _clear_eyes(self, skin: Float32, faps: Float32) -> None:
        """Lids slide over the eyeball, never into it."""
        centres = self.face.eyeballs(faps).centres[0]
        for rows, gap, centre in zip(self._eye_region, self._lid_gap, centres, strict=True):
            offset = skin[rows] - centre
            distance = np.linalg.norm(offset, axis=1)
            least = self.face.eyeball_radius + gap
            push = np.maximum(least / np.maximum(distance, 1e-6), 1.0)
            skin[rows] = centre + offset * push[:, None]


@cache
def _default() -> Head:
    return Head()


def _joined(pieces: list[parts.Part]) -> parts.Part:
    starts = np.cumsum([0] + [len(p.vertices) for p in pieces[:-1]])
    return parts.Part(
        np.concatenate([p.vertices for p in pieces]),
        np.concatenate([p.triangles + s for p, s in zip(pieces, starts, strict=True)]).astype(np.int32),
        np.concatenate([p.weights for p in pieces]),
        np.concatenate([p.colours for p in pieces]),
    )


def _joined_hair(pieces: list[parts.Attached]) -> parts.Attached:
    starts = np.cumsum([0] + [len(p.rows) for p in pieces[:-1]])
    return parts.Attached(
        np.concatenate([p.rows for p in pieces]),
        np.concatenate([p.offsets for p in pieces]),
        np.concatenate([p.triangles + s for p, s in zip(pieces, starts, strict=True)]).astype(np.int32),
        np.concatenate([p.colours for p in pieces]),
    )


def _sparse(weights: Float64) -> Any:
    """A sparse product also keeps BLAS out: its waiting threads would starve software OpenGL."""
    from scipy.sparse import csr_matrix

    return csr_matrix(weights.astype(np.float32))


def _corner_smoothing(surface: Surface, face: FeaturePointFace) -> tuple[Any, npt.NDArray[np.intp]]:
    """Weights that average what is near the corners of the eyes over neighbours, and these rows."""
    from scipy.spatial import cKDTree

    corners = face.points[[row_of()[name] for name in ("3.7", "3.12", "3.8", "3.11")]]
    rows = np.flatnonzero(cKDTree(corners).query(surface.vertices)[0] < CORNER)
    away = np.linalg.norm(surface.vertices[rows][:, None] - surface.vertices[None], axis=2)
    weights = np.exp(-((away / (CORNER * 0.45)) ** 2)) * (away < CORNER)
    return _sparse(weights / weights.sum(axis=1, keepdims=True)), rows


def _step(value: Float64, low: float, high: float | Float64) -> Float64:
    t = np.clip((value - low) / (high - low), 0, 1)
    result: Float64 = t * t * (3 - 2 * t)
    return result


def _painted(surface: Surface, face: FeaturePointFace) -> tuple[Float64, Float64]:
    """Colours (V, 4) of the skin, and its neutral places with the hair's thickness added."""
    places = surface.vertices
    base = np.array(parts.SKIN)
    colour = np.tile(base, (len(places), 1))
    point = {
        name: face.points[row_of()[name]]
        for name in ("5.3", "5.4", "9.3", "9.1", "9.2", "9.5", "9.4", "2.10")
    }
    for name, wide, strength in (
        ("5.3", 0.024, 0.32),
        ("5.4", 0.024, 0.32),
        ("9.3", 0.014, 0.25),
        ("2.10", 0.02, 0.12),
    ):
        away = np.linalg.norm(places - point[name], axis=1)
        blush = (strength * np.exp(-((away / wide) ** 2)))[:, None]
        colour = colour * (1 - blush) + np.array([0.62, 0.235, 0.165]) * blush
    lip = surface.lip[:, None]
    colour = colour * (1 - lip) + np.array(parts.LIP) * lip
    gloss = 0.30 + 0.18 * surface.lip
    for side in (1.0, -1.0):
        nostril = np.array([side * 0.0068, -0.0442, 0.0215])
        hole = np.exp(-((np.linalg.norm((places - nostril) * (1.0, 1.25, 0.75), axis=1) / 0.0036) ** 4))
        colour *= (1 - 0.90 * hole)[:, None]
    offset = places - (0.0, 0.0, HAIR_AXIS)
    around = np.degrees(np.arctan2(np.abs(offset[:, 0]), offset[:, 2]))
    height, steepness = hairline(around)
    above = (places[:, 1] - height) / steepness
    hair = (_step(above, -0.002, 0.004) * (places[:, 1] > -0.07))[:, None]
    colour = colour * (1 - hair) + np.array(parts.HAIR) * hair
    gloss = gloss * (1 - hair[:, 0]) + 0.22 * hair[:, 0]
    thickness = (
        HAIR_THICKNESS * _step(above, -0.003, 0.018 + 0.03 * _step(around, 90, 150)) * (places[:, 1] > -0.07)
    )
    outward = offset / np.maximum(np.linalg.norm(offset, axis=1, keepdims=True), 1e-9)
    return np.concatenate([colour, gloss[:, None]], axis=1), places + outward * thickness[:, None]
