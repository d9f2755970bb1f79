"""How much light reaches the vertices of a face as it turns and opens its mouth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from fba.arrays import Bool, Float16, Float32, Float64, Int32, Intp
from fba.cache import load_or_make, make_key
from fba.compiled import compiled, is_compiled
from fba.face import Deformer, FaceModel
from fba.parameters import point_rows
from fba_player._figure._closing_lines import closing_vertices
from fba_player._figure._face_parts import part_rows
from fba_player._figure.occlusion import CACHE_VERSION, HARMONICS, Visibility, bake, weights

KEY_DIRECTION = (0.70, 0.68, 0.80)
RIM_DIRECTION = (-0.55, 0.50, -0.85)
"""Directions of key and rim light; the same as in shaders/lighting.glsl."""
LIGHTS = np.array([KEY_DIRECTION, RIM_DIRECTION])
MOUTH_OPEN = {3: 700, 4: -250, 8: -200, 9: -200, 5: -900, 10: -700, 11: -700,
              51: -250, 55: -200, 56: -200, 52: -900, 57: -700, 58: -700}  # fmt: skip
"""FAPs of a mouth so wide open that light falls in."""
FREE_LIGHT = (0.9, 0.8, 0.0, 0.3)
"""Light on a tongue that is put out: key, sky, through, rim."""
TEETH_FILL_SHARE = 0.45
"""Share of the missing light that is added on teeth when the mouth is open."""
UPPER_LIDS, CLOSED = (19, 20), 1024
"""FAPs of the upper lids, and the value that closes them."""
LIDS_REACH = 0.35
"""Distance from the pupils, in ES0, within which light depends on the lids."""
CLOSING_SKY = 0.45
"""Least share of the sky's light along lips and lids, where they touch."""
ENCLOSED = 0.04
"""Vertices near the mouth that see less of the sky than this while it is shut may be inside."""
INSIDE_KEY, INSIDE_SKY = 0.20, 0.36
"""Shares of key light and sky that reach the inside of an open mouth by reflection."""
CONSTANT_HARMONIC = 0.282095
"""The first spherical harmonic, equal in all directions."""
TURN_DECIMALS = 2
"""Decimals to which the head's rotation is rounded; the light changes invisibly little."""
MIN_SWAY = 0.05
"""Occlusion is not computed at vertices that turn with the head by less than this."""


@dataclass(frozen=True, eq=False)
class Baked:
    """Visibility with the mouth shut and wide open.

    near: bool (V,), where these differ. gaps: distances of the lips in both, metres.
    """

    shut: Visibility
    wide: Visibility
    near: Bool
    gaps: tuple[float, float]


class FaceLight:
    """Light on a face model.

    sway (V,): how far each vertex goes with the head. Occlusion is computed on first use, for the mouth shut
    and open, in about a second, and stored in the disk cache.
    """

    def __init__(self, model: FaceModel, deformer: Deformer, sway: Float32) -> None:
        self._model = model
        self._deformer = deformer
        self._sway = sway
        self._last: tuple[tuple[object, ...], Float32] | None = None
        lips = [int(model.bound[point_rows()[name]]) for name in ("2.2", "2.3")]
        self._lips = lips if min(lips) >= 0 else None
        self._tongues = [part_rows(model, part.name) for part in model.of_kind("tongue")]

    @property
    def lips(self) -> Sequence[int]:
        """The two vertices of the lips whose distance says how far the mouth is open; none in some models."""
        return self._lips or ()

    def shade(self, positions: Float32, turn: Float64, matrix: Float64) -> Float32:
        """Return float32 (V, 4), 0..1: the share of light that reaches each vertex, as in `FaceMesh.light`.

        positions: (V, 3), without the head's turn (3, 3). matrix: (3, 3), the face's rotation in the world.
        Returns the same array until something changes.
        """
        share = round(self._mouth_open(positions, self.baked.gaps), 2)
        out = [self._out_of_mouth(positions[rows, 2], positions) for rows in self._tongues]
        # In steps too small to be seen, so that a pose looks the same whatever was shown before it.
        turned, still = np.round((matrix @ turn).T, TURN_DECIMALS), np.round(matrix.T, TURN_DECIMALS)
        key = (turned.tobytes(), still.tobytes(), share, *(float(o.sum()) for o in out))
        if self._last is None or self._last[0] != key:
            lights = _basis(turned) if np.array_equal(turned, still) else _basis(turned, still)
            self._last = (key, self._shaded(share, lights, out))
        return self._last[1]

    def _shaded(self, share: float, lights: Float32, out: list[Float32]) -> Float32:
        """Return float32 (V, 4) for a mouth open by `share`. out: (N,) for each tongue, how far it is out."""
        light = np.empty((len(self._sway), 4), dtype=np.float32)
        for part, baked in zip(self._model.parts, self._part_lights, strict=True):
            # Teeth get more light than falls in, as a photographer would have it.
            added = TEETH_FILL_SHARE * share if part.kind == "teeth" else 0.0
            baked.shade(share, lights, added, light[baked.rows])
        for rows, outside in zip(self._tongues, out, strict=True):
            if outside.any():
                light[rows] += (np.array(FREE_LIGHT, dtype=np.float32) - light[rows]) * outside[:, None]
        return light

    @cached_property
    def _part_lights(self) -> list[_PartLight]:
        parts = self._model.parts
        return [_part_light(self.baked, part_rows(self._model, part.name), self._sway) for part in parts]

    def _mouth_open(self, positions: Float32, gaps: tuple[float, float]) -> float:
        if self._lips is None:
            return 0.0
        share = (self._gap(positions) - gaps[0]) / max(gaps[1] - gaps[0], 1e-6)
        return float(min(max(share, 0.0), 1.0) ** 0.4)  # the first millimetres let in most of the light

    def _gap(self, positions: Float32) -> float:
        assert self._lips is not None
        between = positions[self._lips[0]] - positions[self._lips[1]]
        return math.sqrt(float(between @ between))

    def _out_of_mouth(self, depths: Float32, positions: Float32) -> Float32:
        """Return float32 (N,), 0..1: how far vertices of a tongue at depths (z) are out between the lips."""
        lips = math.inf if self._lips is None else float(positions[self._lips, 2].min())
        if depths.max(initial=-math.inf) <= lips:  # the usual case
            return np.zeros(len(depths), dtype=np.float32)
        reach = 0.12 * self._model.fapu.ENS * 1024
        return np.asarray(np.clip((depths - lips) / reach, 0.0, 1.0), dtype=np.float32)

    @cached_property
    def baked(self) -> Baked:
        """Visibility of every vertex past the rest of the face."""
        solid = [part for part in self._model.parts if part.kind not in ("brow", "lash")]
        joined = [part.triangles + self._model.starts[part.name] for part in solid]
        triangles = np.ascontiguousarray(np.concatenate(joined), dtype=np.int32)
        faps = np.zeros(68, dtype=np.float32)
        still, normals = self._posed(faps)
        bare = cached_visibility(still, normals, triangles, self._sway > MIN_SWAY)
        shut = self._lit_lines(self._lit_lids(bare, triangles))
        if self._lips is None:
            return Baked(shut, shut, np.zeros(len(still), dtype=bool), (0.0, 0.0))
        for fap, value in MOUTH_OPEN.items():
            faps[fap - 1] = value
        moved, normals = self._posed(faps)
        near = self._near_mouth(still)
        inside = _largest_piece(self._model.triangles, bare.open < ENCLOSED, near)
        for rows in self._tongues:
            inside[rows] = True
        near |= inside
        wide = _lit_inside(cached_visibility(moved, normals, triangles, near), inside)
        arrays = [
            np.where(near[:, None] if before.ndim == 2 else near, after, before)
            for before, after in zip(shut, wide, strict=True)
        ]
        return Baked(shut, Visibility(*arrays), near, (self._gap(still), self._gap(moved)))

    def _lit_lids(self, shut: Visibility, triangles: Int32) -> Visibility:
        """Return visibility with that of closed eyes where more light falls on the lids then: folds open."""
        eyes = self._model.points[[point_rows()["3.5"], point_rows()["3.6"]]]
        if not np.isfinite(eyes).all():
            return shut
        faps = np.zeros(68, dtype=np.float32)
        still = self._posed(faps)[0]
        faps[[lid - 1 for lid in UPPER_LIDS]] = CLOSED
        away = np.linalg.norm(still[:, None] - eyes, axis=2).min(axis=1)
        near = away < LIDS_REACH * self._model.fapu.ES * 1024
        closed = cached_visibility(*self._posed(faps), triangles, near)
        more = near & (closed.open > shut.open)
        arrays = (
            np.where(more[:, None] if old.ndim == 2 else more, new, old)
            for old, new in zip(shut, closed, strict=True)
        )
        return Visibility(*arrays)

    def _lit_lines(self, shut: Visibility) -> Visibility:
        """Return visibility with some light where lips and lids touch: they are flesh, not holes."""
        found = [closing_vertices(self._model, part) for part in self._model.parts]
        parts = zip(self._model.parts, found, strict=True)
        closing = np.concatenate([np.zeros(len(p.vertices), bool) if c is None else c for p, c in parts])
        return shut._replace(open=np.where(closing, np.maximum(shut.open, CLOSING_SKY), shut.open))

    def _posed(self, faps: Float32) -> tuple[Float32, Float32]:
        positions = np.empty((len(self._sway), 3), dtype=np.float32)
        normals = np.empty_like(positions)
        return self._deformer.local(faps, out=positions, normals=normals), normals

    def _near_mouth(self, positions: Float32) -> Bool:
        """Return bool (V,): vertices about as near to the mouth as the eyes are to the nose."""
        away = np.linalg.norm(positions - positions[self._lips].mean(axis=0), axis=1)
        return np.asarray(away < 1.1 * self._model.fapu.ENS * 1024)


def _largest_piece(triangles: Int32, chosen: Bool, near: Bool) -> Bool:
    """Return bool (V,): the connected piece of chosen vertices that has most of those that are near."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    edges = triangles[:, [0, 1, 1, 2]].reshape(-1, 2)
    edges = edges[chosen[edges].all(axis=1)]
    ones = np.ones(len(edges), dtype=bool)
    _, piece = connected_components(csr_array((ones, edges.T), shape=(len(chosen),) * 2), directed=False)
    most = np.bincount(piece[chosen & near], minlength=1)
    return chosen & (piece == most.argmax()) if most.any() else np.zeros_like(chosen)


def _lit_inside(wide: Visibility, enclosed: Bool) -> Visibility:
    """Return visibility with the light that walls of the mouth cast on each other. enclosed: bool (V,)."""
    light, open_ = wide.light.copy(), wide.open.copy()
    light[enclosed, 0] += INSIDE_KEY / CONSTANT_HARMONIC
    open_[enclosed] += INSIDE_SKY * (1 - open_[enclosed])
    return wide._replace(light=light, open=open_)


def cached_visibility(positions: Float32, normals: Float32, triangles: Int32, within: Bool) -> Visibility:
    """Return what `bake` returns, stored in the disk cache: it takes half a second of every start."""

    def make() -> list[Float16]:
        return [array.astype(np.float16) for array in bake(positions, normals, triangles, within)]

    count = len(within)
    shapes = ((count, HARMONICS), (count, HARMONICS), (count,))
    key = make_key("light", CACHE_VERSION, positions, normals, triangles, within)
    arrays = load_or_make(key, shapes, make) if is_compiled() else make()
    return Visibility(*(array.astype(np.float32) for array in arrays))


class Table(NamedTuple):
    """Visibility of N vertices with the mouth shut, and, of the M
    vertices near it, with the mouth wide open. A row for each harmonic: loops over vertices then run fastest.
    """

    light: Float32
    """(16, N)"""
    through: Float32
    """(16, N)"""
    open: Float32
    """(N,)"""
    wide_light: Float32
    """(16, M)"""
    wide_through: Float32
    """(16, M)"""
    wide_open: Float32
    """(M,)"""
    near: Intp


@dataclass(frozen=True, eq=False)
class _PartLight:
    """Data for the light at the vertices of one part.

    rows: the part in the model. table: visibility of its N vertices. swaying: the vertices (M,) that follow
    the head only partly; sway: (M,), how far; still: their visibility.
    """

    rows: slice
    table: Table
    swaying: Intp
    still: Table
    sway: Float32

    def shade(self, share: float, lights: Float32, added: float, light: Float32) -> None:
        """Write light (N, 4): key light, sky, through, rim light.

        share: how far the mouth is wide open. lights: (2, 16), weights of the harmonics for key and rim light
        at vertices that move with the head; where the head has turned, two more rows for vertices at rest.
        added: the share of the missing light that is added.
        """
        _light_vertices(self.table, lights[:2], share, added, light)
        if len(lights) > 2 and len(self.swaying):
            still = np.empty((len(self.swaying), 4), dtype=np.float32)
            _light_vertices(self.still, lights[2:], share, added, still)
            _blend_swaying(light, still, self.swaying, self.sway)


def _part_light(baked: Baked, rows: slice, sway: Float32) -> _PartLight:
    """Return the tables of a part's rows of a model. sway: (V,), of all vertices of the model."""
    vertices = np.arange(rows.start, rows.stop)
    swaying = np.flatnonzero(sway[vertices] < 1)
    still = _table(baked, vertices[swaying])
    return _PartLight(rows, _table(baked, vertices), swaying, still, sway[vertices[swaying]])


def _table(baked: Baked, vertices: Intp) -> Table:
    """Return the visibility of some vertices of a model."""
    near = np.flatnonzero(baked.near[vertices])
    shut, wide = (
        [np.ascontiguousarray(table[rows].T) for table in visibility]
        for visibility, rows in ((baked.shut, vertices), (baked.wide, vertices[near]))
    )
    return Table(shut[0], shut[1], shut[2], wide[0], wide[1], wide[2], near)


def _basis(*turns: Float64) -> Float32:
    """Return float32 (2 N, 16): weights of the harmonics for key and rim light under N rotations (3, 3)."""
    towards = np.empty((2 * len(turns), 3))
    for k, into in enumerate(turns):
        np.dot(LIGHTS, into.T, out=towards[2 * k : 2 * k + 2])
    towards /= np.sqrt(np.einsum("ij,ij->i", towards, towards))[:, None]
    return weights(towards).astype(np.float32)


@compiled
def _light_vertices(table: Table, basis: Float32, wide: float, added: float, light: Float32) -> None:
    """Write light (N, 4): key light, sky, through, rim light.

    basis: (2, 16), weights of the harmonics for key and rim light. wide: how far the mouth is wide open.
    added: the share of the missing light that is added.
    """
    count = len(table.open)
    if len(light) < count:
        raise IndexError("light for fewer vertices than the table's")
    share, more = np.float32(wide), np.float32(added)
    key, rim, back = _products(table.light, table.through, basis, count)
    for i in range(count):
        light[i, 0], light[i, 1], light[i, 2], light[i, 3] = key[i], table.open[i], back[i], rim[i]
    if share > 0.0 and len(table.near):
        key, rim, back = _products(table.wide_light, table.wide_through, basis, len(table.near))
        for k in range(len(table.near)):
            i = table.near[k]
            light[i, 0] += share * (key[k] - light[i, 0])
            light[i, 1] += share * (table.wide_open[k] - light[i, 1])
            light[i, 2] += share * (back[k] - light[i, 2])
            light[i, 3] += share * (rim[k] - light[i, 3])
    if more > 0.0:
        for i in range(count):
            light[i, 0] += more * (np.float32(1.0) - light[i, 0])
            light[i, 1] += more * (np.float32(1.0) - light[i, 1])


@compiled
def _blend_swaying(light: Float32, still: Float32, rows: Intp, share: Float32) -> None:
    """Blend rows of light (N, 4) with `still` (M, 4), that at rest, by shares (M,) of the head's motion.

    Bounds: rows are numbers of vertices of the part, which light has a row for each of; still and share are
    made for them.
    """
    for k in range(len(rows)):
        for column in range(4):
            light[rows[k], column] = still[k, column] + share[k] * (light[rows[k], column] - still[k, column])


@compiled
def _products(
    light: Float32, through: Float32, basis: Float32, count: int
) -> tuple[Float32, Float32, Float32]:
    """Return key light, rim light, and rim light through the skin, each (count,).

    Bounds: light and through (16, count) are those of a table, whose columns are its vertices; basis is
    (2, 16).
    """
    key = np.zeros(count, dtype=np.float32)
    rim, back = np.zeros_like(key), np.zeros_like(key)
    for k in range(0, basis.shape[1], 4):  # four at a time: the sums are read and written less often
        a, b, c, d = basis[0, k], basis[0, k + 1], basis[0, k + 2], basis[0, k + 3]
        e, f, g, h = basis[1, k], basis[1, k + 1], basis[1, k + 2], basis[1, k + 3]
        one, two, three, four = light[k], light[k + 1], light[k + 2], light[k + 3]
        for i in range(count):
            key[i] += a * one[i] + b * two[i] + c * three[i] + d * four[i]
            rim[i] += e * one[i] + f * two[i] + g * three[i] + h * four[i]
        one, two, three, four = through[k], through[k + 1], through[k + 2], through[k + 3]
        for i in range(count):
            back[i] += e * one[i] + f * two[i] + g * three[i] + h * four[i]
    low, high = np.float32(0.0), np.float32(1.0)
    for i in range(count):
        key[i] = min(max(key[i], low), high)
        rim[i] = min(max(rim[i], low), high)
        back[i] = min(max(back[i], low), high)
    return key, rim, back
