"""How much light reaches the vertices of a face as it turns and opens its mouth."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fba.arrays import Array, Bool, Float16, Float32, Float64, Int32, Intp
from fba.cache import load_or_make, make_key
from fba.compiled import is_compiled
from fba.face import Deformer, FaceModel
from fba.parameters import point_rows
from fba_player._figure._closing_lines import closing_vertices
from fba_player._figure._face_parts import find_hairs, join_pieces, part_rows
from fba_player._figure.baked_shapes import load_baked, pack, unpack
from fba_player._figure.occlusion import CACHE_VERSION, HARMONICS, Visibility, bake, weights

KEY_DIRECTION = (0.70, 0.68, 0.80)
RIM_DIRECTION = (-0.55, 0.50, -0.85)
"""Directions of key and rim light; the same as in shaders/lighting.glsl."""
LIGHTS = np.array([KEY_DIRECTION, RIM_DIRECTION])
MOUTH_OPEN = {3: 700, 4: -250, 8: -200, 9: -200, 5: -900, 10: -700, 11: -700,
              51: -250, 55: -200, 56: -200, 52: -900, 57: -700, 58: -700}  # fmt: skip
"""FAPs of a mouth so wide open that light falls in."""
MOUTH_SHUT = 0.01
"""Share of that opening up to which lips count as shut, as positions are not exact."""
FREE_LIGHT = (0.9, 0.8, 0.0, 0.3)
"""Light on a tongue that is put out: key, sky, through, rim."""
TEETH_FILL_SHARE = 0.56
"""Share of the missing light that is added on teeth when the mouth is open."""
UPPER_LIDS, CLOSED = (19, 20), 1024
"""FAPs of the upper lids, and the value that closes them."""
LID_MOVED = 0.005
"""Motion of a closed lid's vertices, in ES0, from which they have the light of closed eyes."""
LIDS_REACH = 0.35
"""Distance from the pupils, in ES0, within which light depends on the lids."""
CLOSING_SKY = 0.45
"""Least share of the sky's light along lips and lids, where they touch."""
ENCLOSED = 0.04
"""Vertices near the mouth that see less of the sky than this while it is shut may be inside."""
INSIDE_KEY, INSIDE_SKY, TONGUE_SKY = 0.47, 0.5, 0.3
"""Shares of key light and sky that reach the inside of an open mouth by reflection; a tongue, lit by red
walls, mirrors little of the sky."""
THROAT, DARKEST = 0.9, 0.2
"""Distance behind the lips, in ES0, at which the least share of that light is left, and that share."""
CONSTANT_HARMONIC = 0.282095
"""The first spherical harmonic, equal in all directions."""
FORWARD, FORWARD_HARMONIC = 2, 0.45
"""Place of the harmonic that is greatest ahead, and its value there, for large lights: into the mouth light
comes from ahead, none from behind."""
TURN_DECIMALS = 2
"""Decimals to which the head's rotation is rounded; the light changes invisibly little."""
PRODUCT = 4096
"""Number of vertices whose light is one product of matrices."""
ROW = np.complex128
"""A number as wide as the four of light."""
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

    def pack(self) -> dict[str, Array]:
        """Return it as arrays that take little space; see `unpack_light`."""
        both = np.concatenate([_joined(self.shut), _joined(self.wide)[self.near]])
        return {**pack(both), "near": self.near, "gaps": np.array(self.gaps)}


def unpack_light(arrays: dict[str, Any]) -> Baked:
    """Return what `Baked.pack` packed."""
    both, near = unpack(arrays["values"], arrays["step"]), arrays["near"]
    shut = both[: len(near)]
    wide = shut.copy()
    wide[near] = both[len(near) :]
    first, last = (Visibility(t[:, :HARMONICS], t[:, HARMONICS:-1], t[:, -1]) for t in (shut, wide))
    return Baked(first, last, near, tuple(arrays["gaps"]))


def _joined(seen: Visibility) -> Float32:
    """Return float32 (V, 33): light, light through the skin, sky."""
    return np.concatenate([seen.light, seen.through, seen.open[:, None]], axis=1)


class FaceLight:
    """Light on a face model.

    sway (V,): how far each vertex goes with the head. Occlusion, for the mouth shut and open, comes with the
    library's own figures; of others it is computed on first use, in about a second, and stored in the disk
    cache.
    """

    def __init__(self, model: FaceModel, deformer: Deformer, sway: Float32) -> None:
        self._model = model
        self._deformer = deformer
        self._sway = sway
        self._last: tuple[tuple[object, ...], Float32] | None = None
        self._rows: Intp | None = None
        lips = [int(model.bound[point_rows()[name]]) for name in ("2.2", "2.3")]
        self._lips = lips if min(lips) >= 0 else None
        self._tongues, self._teeth = (
            [part_rows(model, part.name) for part in model.of_kind(kind)] for kind in ("tongue", "teeth")
        )

    @property
    def lips(self) -> Sequence[int]:
        """The two vertices of the lips whose distance says how far the mouth is open; none in some models."""
        return self._lips or ()

    def restrict(self, rows: Intp) -> FaceLight:
        """Return what lights only these vertices (N,), ascending: other rows of its results are 0."""
        light = FaceLight(self._model, self._deformer, self._sway)
        light.baked, light._rows = self.baked, rows
        light._tongues, light._teeth = (
            [slice(*np.searchsorted(rows, [part.start, part.stop]).tolist()) for part in parts]
            for parts in (self._tongues, self._teeth)
        )
        return light

    def shade(self, positions: Float32, turn: Float64, matrix: Float64) -> Float32:
        """Return float32 (V, 4), 0..1: the share of light that reaches each vertex, as in `FaceMesh.light`.

        positions: (V, 3), without the head's turn (3, 3). matrix: (3, 3), the face's rotation in the world.
        Returns the same array until something changes.
        """
        share = round(self._mouth_open(positions, self.baked.gaps), 2)
        depths = positions[:, 2] if self._rows is None else positions[self._rows, 2]
        out = [self._out_of_mouth(depths[rows], positions) for rows in self._tongues]
        # In steps too small to be seen, so that a pose looks the same whatever was shown before it.
        turned, still = np.round((matrix @ turn).T, TURN_DECIMALS), np.round(matrix.T, TURN_DECIMALS)
        key = (turned.tobytes(), still.tobytes(), share, *(float(o.sum()) for o in out))
        if self._last is None or self._last[0] != key:
            lights = _lights(turned) if np.array_equal(turned, still) else _lights(turned, still)
            self._last = (key, self._shaded(share, lights, out))
        return self._last[1]

    def _shaded(self, share: float, lights: Float32, out: list[Float32]) -> Float32:
        """Return float32 (V, 4) for a mouth open by `share`.

        lights: as `_lights` returns them for the turned head and, where it differs, for one at rest. out:
        (N,) for each tongue, how far it is out.
        """
        (shut, bent, wide), near, partly, sway = self._tables
        light = _reaching(shut, lights[0])
        if len(lights) > 1:
            still = _reaching(bent, lights[1])
            light[partly] = still + sway * (light.take(partly, axis=0) - still)
        if share > 0.0 and len(near):
            before = light.take(near, axis=0)
            light[near] = before + np.float32(share) * (_reaching(wide, lights[0]) - before)
        # Teeth get more light than falls in, as a photographer would have it.
        for rows in self._teeth if share > 0.0 else ():
            light[rows, :2] += np.float32(TEETH_FILL_SHARE * share) * (1 - light[rows, :2])
        for rows, outside in zip(self._tongues, out, strict=True):
            if outside.any():
                light[rows] += (np.array(FREE_LIGHT, dtype=np.float32) - light[rows]) * outside[:, None]
        if self._rows is None:
            return light
        spread = np.zeros((len(self._sway), 4), dtype=np.float32)
        spread.view(ROW)[self._rows] = light.view(ROW)  # whole rows are copied three times faster
        return spread

    @cached_property
    def _tables(self) -> tuple[tuple[Float32, Float32, Float32], Intp, Intp, Float32]:
        """Visibility of the lit vertices with the mouth shut (33, L), the same (33, N) where they turn only
        partly with the head, and with it wide open (33, M) near it; numbers among the lit ones of those (M,)
        near the mouth, and of those (N,); the sway (N, 1) of the latter."""
        lit = slice(None) if self._rows is None else self._rows
        sway = self._sway[lit]
        near, partly = np.flatnonzero(self.baked.near[lit]), np.flatnonzero(sway < 1)
        shut, wide = (_joined(seen)[lit] for seen in (self.baked.shut, self.baked.wide))
        tables = shut.T.copy(), shut[partly].T.copy(), wide[near].T.copy()
        return tables, near, partly, sway[partly, None]

    def _mouth_open(self, positions: Float32, gaps: tuple[float, float]) -> float:
        if self._lips is None:
            return 0.0
        share = (self._gap(positions) - gaps[0]) / max(gaps[1] - gaps[0], 1e-6)
        share = (share - MOUTH_SHUT) / (1 - MOUTH_SHUT)
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
        stored = load_baked(self._model.parts)
        return unpack_light(stored) if stored else self.bake()

    def bake(self) -> Baked:
        """Compute `baked`."""
        solid = [
            part
            for part in self._model.parts
            if part.kind not in ("brow", "lash") and (part.kind != "hair" or find_hairs(part) is None)
        ]
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
        sky = np.where(inside, INSIDE_SKY, 0.0)
        for rows in self._tongues:
            sky[rows] = TONGUE_SKY
        behind = still[self._lips, 2].max() - still[:, 2]
        depth = behind / (THROAT * self._model.fapu.ES * 1024)
        share = np.clip(1 - (1 - DARKEST) * depth, DARKEST, 1.0)
        wide = self._lit_lines(_lit_inside(cached_visibility(moved, normals, triangles, near), sky, share))
        arrays = [
            np.where(near[:, None] if before.ndim == 2 else near, after, before)
            for before, after in zip(shut, wide, strict=True)
        ]
        return Baked(shut, Visibility(*arrays), near, (self._gap(still), self._gap(moved)))

    def _lit_lids(self, shut: Visibility, triangles: Int32) -> Visibility:
        """Return visibility with that of closed eyes where lids move: skin from a fold is lit then."""
        eyes = self._model.points[[point_rows()["3.5"], point_rows()["3.6"]]]
        if not np.isfinite(eyes).all():
            return shut
        faps = np.zeros(68, dtype=np.float32)
        still = self._posed(faps)[0]
        faps[[lid - 1 for lid in UPPER_LIDS]] = CLOSED
        away = np.linalg.norm(still[:, None] - eyes, axis=2).min(axis=1)
        near = away < LIDS_REACH * self._model.fapu.ES * 1024
        posed = self._posed(faps)
        closed = cached_visibility(*posed, triangles, near)
        more = near & (np.linalg.norm(posed[0] - still, axis=1) > LID_MOVED * self._model.fapu.ES * 1024)
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
    edges = triangles[:, [0, 1, 1, 2]].reshape(-1, 2)
    edges = edges[chosen[edges].all(axis=1)].astype(np.intp)
    piece = join_pieces(np.concatenate([edges, edges[:, ::-1]]), len(chosen))
    most = np.bincount(piece[chosen & near], minlength=1)
    return chosen & (piece == most.argmax()) if most.any() else np.zeros_like(chosen)


def _lit_inside(wide: Visibility, sky: Float64, share: Float64) -> Visibility:
    """Return visibility with the light that walls of the mouth cast on each other.

    sky: (V,), share of it that they reflect; 0 outside the mouth. share: (V,), how much of their light there
    is at that depth.
    """
    light = wide.light.copy()
    key = np.where(sky > 0, share * INSIDE_KEY, 0.0)
    light[:, 0] += key * 0.55 / CONSTANT_HARMONIC
    light[:, FORWARD] += key * 0.77 / FORWARD_HARMONIC
    return wide._replace(light=light, open=(wide.open + share * sky * (1 - wide.open)).astype(np.float32))


def cached_visibility(positions: Float32, normals: Float32, triangles: Int32, within: Bool) -> Visibility:
    """Return what `bake` returns, stored in the disk cache: it takes half a second of every start."""

    def make() -> list[Float16]:
        return [array.astype(np.float16) for array in bake(positions, normals, triangles, within)]

    count = len(within)
    shapes = ((count, HARMONICS), (count, HARMONICS), (count,))
    key = make_key("light", CACHE_VERSION, positions, normals, triangles, within)
    arrays = load_or_make(key, shapes, make) if is_compiled() else make()
    return Visibility(*(array.astype(np.float32) for array in arrays))


def _lights(*turns: Float64) -> Float32:
    """Return float32 (N, 2, 16): weights of the harmonics for key and rim light under N rotations (3, 3)."""
    towards = np.concatenate([LIGHTS @ turned.T for turned in turns])
    towards /= np.linalg.norm(towards, axis=1)[:, None]
    return weights(towards).reshape(len(turns), len(LIGHTS), -1).astype(np.float32)


def _reaching(visibility: Float32, lights: Float32) -> Float32:
    """Return float32 (N, 4), as `FaceMesh.light`, by visibility (33, N): light, light through the skin, sky.

    lights: (2, 16), as of `_lights`. In parts so small that linear algebra starts no threads, which would
    keep the processors from those that draw.
    """
    light = np.empty((4, visibility.shape[1]), dtype=np.float32)
    free, through = visibility[:HARMONICS], visibility[HARMONICS:-1]
    for start in range(0, light.shape[1], PRODUCT):
        part = slice(start, start + PRODUCT)
        light[::3, part] = lights @ free[:, part]
        light[2, part] = lights[1:] @ through[:, part]
    light[1] = visibility[-1]
    return np.ascontiguousarray(np.clip(light, 0.0, 1.0, out=light).T)
