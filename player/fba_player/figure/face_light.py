"""How much light reaches the vertices of a face, as it turns and opens its mouth."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fba.cache import kept
from fba.compiled import is_compiled
from fba.face.deform.deformer import Deformer
from fba.face.model import FaceModel, Part, point_row
from fba_player.figure._face_light_loops import Table, lit, sway
from fba_player.figure.occlusion import BAKING, HARMONICS, Visibility, bake, weights

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]
Int32 = npt.NDArray[np.int32]
Bool = npt.NDArray[np.bool_]
Rows = npt.NDArray[np.intp]

KEY_DIRECTION, RIM_DIRECTION = ((0.70, 0.68, 0.80), (-0.55, 0.50, -0.85))
"""As in shaders/lighting.glsl."""
LIGHTS = np.array([KEY_DIRECTION, RIM_DIRECTION])
MOUTH_OPEN = {3: 700, 4: -250, 8: -200, 9: -200, 5: -900, 10: -700, 11: -700,
              51: -250, 55: -200, 56: -200, 52: -900, 57: -700, 58: -700}  # fmt: skip
"""FAPs of a mouth open so far that light falls in."""
FREE = (0.9, 0.8, 0.0, 0.3)
"""The light that reaches a tongue put out."""
ON_TEETH = 0.3
"""How much more light falls on teeth than finds its way between the lips."""
STEP = 2
"""Digits to which the head's rotation is taken: its light changes by less than is seen."""
MOST_KEPT = 96
"""Choices of vertices remembered."""
MOVES = 0.05
"""What sways less than this is lit without care."""


@dataclass(frozen=True, eq=False)
class Baked:
    """Visibility with the mouth shut and open, (V,) where these differ, and how far its lips are apart in
    both, metres."""

    shut: Visibility
    wide: Visibility
    near: Bool
    gaps: tuple[float, float]


class LitFace:
    """The light on a face in one pose, worked out where it is asked for."""

    def __init__(
        self, light: FaceLight, share: float, lights: Float32, tongues: list[tuple[slice, Float32]]
    ) -> None:
        self._light = light
        self._args = (share, lights)
        self._tongues = tongues
        self._parts: dict[tuple[int, int], LitFacePart] = {}

    def of(self, part: slice) -> LitFacePart:
        """The same for one part; the same object each time."""
        key = (part.start, part.stop)
        if key not in self._parts:
            outside = next((out for tongue, out in self._tongues if tongue == part and out.any()), None)
            self._parts[key] = LitFacePart(self._light, part, *self._args, outside)
        return self._parts[key]


@dataclass(frozen=True, eq=False)
class LitFacePart:
    """The light on a part of a face in one pose.

    share: how far the mouth is wide open. lights: (2, 16) what weighs the harmonics for key and rim light,
    for what goes with the head, then for what stands where that differs. outside (N,): how far each vertex of
    a tongue is out between the lips, None where none is.
    """

    light: FaceLight
    part: slice
    share: float
    lights: Float32
    outside: Float32 | None

    @property
    def more(self) -> float:
        """What share of the light that is missing falls in, as a photographer would have it."""
        return ON_TEETH * self.share if self.light.is_of_teeth(self.part) else 0.0

    def __call__(self, rows: Rows | None) -> Float32:
        """float32 (N, 4), 0..1, for the part's vertices, or those of its rows (N,) that are asked for: what
        reaches them of the key light, of the open sky, through the skin from behind, and of the rim light."""
        found = self.light.some(self.part, rows).reaching(self.share, self.lights, self.more)
        if self.outside is not None:
            free = self.outside if rows is None else self.outside[rows]
            found += (np.array(FREE, dtype=np.float32) - found) * free[:, None]
        return found


class FaceLight:
    """Light on a face model.

    sway (V,): how far each vertex goes with the head. What hides what is worked out on first use, for the
    mouth shut and open, in about a second, and kept on disk.
    """

    def __init__(self, model: FaceModel, deformer: Deformer, sway: Float32) -> None:
        self._model = model
        self._deformer = deformer
        self.sway = sway
        self._lit: tuple[tuple[object, ...], LitFace] | None = None
        self._kept: dict[tuple[int, int, int], tuple[Rows | None, _Some]] = {}
        lips = [int(model.bound[point_row(name)]) for name in ("2.2", "2.3")]
        self._lips = lips if min(lips) >= 0 else None
        self._teeth = [self._rows(part) for part in model.of_kind("teeth")]
        self._tongues = [self._rows(part) for part in model.of_kind("tongue")]
        looked = [np.arange(rows.start, rows.stop) for rows in self._tongues]
        self._looked = np.concatenate([np.array(self._lips or (), dtype=np.intp), *looked])
        """Vertices by which it is known how far the mouth is open, and the tongue out."""

    def _rows(self, part: Part) -> slice:
        start = self._model.starts[part.name]
        return slice(start, start + len(part.vertices))

    def reaching(self, at: Callable[[Rows], Float32], turn: Float64, matrix: Float64) -> LitFace:
        """The light for a face whose positions without the head's turn (3, 3), (V, 3), `at` gives, right at
        rows (N,) at least; matrix: (3, 3) of the whole in the world. The same object while nothing changes.
        """
        positions = at(self._looked)
        share = round(self._mouth_open(positions, self.baked.gaps), 2)
        out = [self._out_of_mouth(positions[rows, 2], positions) for rows in self._tongues]
        # In steps that nobody sees, the same whatever was shown before.
        turned, still = np.round((matrix @ turn).T, STEP), np.round(matrix.T, STEP)
        key = (turned.tobytes(), still.tobytes(), share, *(float(o.sum()) for o in out))
        if self._lit is None or self._lit[0] != key:
            tongues = list(zip(self._tongues, out, strict=True))
            lights = _basis(turned) if np.array_equal(turned, still) else _basis(turned, still)
            self._lit = (key, LitFace(self, share, lights, tongues))
        return self._lit[1]

    def is_of_teeth(self, part: slice) -> bool:
        """Whether a part is of teeth."""
        return part in self._teeth

    def some(self, part: slice, rows: Rows | None) -> _Some:
        """What light at some of a part's vertices is worked out from; kept for as long as they are."""
        key = (part.start, part.stop, id(rows))
        if key not in self._kept:
            while len(self._kept) >= MOST_KEPT:
                del self._kept[next(iter(self._kept))]
            chosen = np.arange(part.start, part.stop) if rows is None else rows + part.start
            self._kept[key] = (rows, _Some(self.baked, chosen, self.sway))
        return self._kept[key][1]

    def _mouth_open(self, positions: Float32, gaps: tuple[float, float]) -> float:
        if self._lips is None:
            return 0.0
        share = (self._gap(positions) - gaps[0]) / max(gaps[1] - gaps[0], 1e-6)
        return float(min(max(share, 0.0), 1.0) ** 0.4)  # the first millimetres let most of the light in

    def _gap(self, positions: Float32) -> float:
        assert self._lips is not None
        way = positions[self._lips[0]] - positions[self._lips[1]]
        return math.sqrt(float(way @ way))

    def _out_of_mouth(self, depths: Float32, positions: Float32) -> Float32:
        """(N,) how far vertices of a tongue at these depths are out between the lips, 0..1."""
        if self._lips is None:
            return np.zeros(len(depths), dtype=np.float32)
        reach = 0.12 * self._model.fapu.ENS * 1024
        lips = min(positions[self._lips[0], 2], positions[self._lips[1], 2])
        if depths.max(initial=lips) <= lips:  # as most of the time
            return np.zeros(len(depths), dtype=np.float32)
        share: Float32 = np.clip((depths - lips) / reach, 0.0, 1.0)
        return share.astype(np.float32)

    @cached_property
    def baked(self) -> Baked:
        """What hides what."""
        solid = [part for part in self._model.parts if part.kind not in ("brow", "lash")]
        joined = [part.triangles + self._model.starts[part.name] for part in solid]
        triangles = np.ascontiguousarray(np.concatenate(joined), dtype=np.int32)
        faps = np.zeros(68, dtype=np.float32)
        still, normals = self._posed(faps)
        shut = kept_visibility(still, normals, triangles, self.sway > MOVES)
        if self._lips is None:
            return Baked(shut, shut, np.zeros(len(still), dtype=bool), (0.0, 0.0))
        for fap, value in MOUTH_OPEN.items():
            faps[fap - 1] = value
        moved, normals = self._posed(faps)
        near = self._near_mouth(still)
        wide = kept_visibility(moved, normals, triangles, near)
        arrays = [
            np.where(near[:, None] if before.ndim == 2 else near, after, before)
            for before, after in zip(shut.arrays, wide.arrays, strict=True)
        ]
        return Baked(shut, Visibility(*arrays), near, (self._gap(still), self._gap(moved)))

    def _posed(self, faps: Float32) -> tuple[Float32, Float32]:
        positions = np.empty((len(self.sway), 3), dtype=np.float32)
        normals = np.empty_like(positions)
        return self._deformer.local(faps, out=positions, normals=normals), normals

    def _near_mouth(self, positions: Float32) -> Bool:
        """(V,) vertices about as near to the mouth as the eyes are to the nose."""
        away = np.linalg.norm(positions - positions[self._lips].mean(axis=0), axis=1)
        return np.asarray(away < 1.1 * self._model.fapu.ENS * 1024)


def kept_visibility(positions: Float32, normals: Float32, triangles: Int32, within: Bool) -> Visibility:
    """`bake`, but done once and kept on disk: it is half a second of every start."""

    def make() -> list[npt.NDArray[np.float16]]:
        return [array.astype(np.float16) for array in bake(positions, normals, triangles, within).arrays]

    digest = hashlib.sha256(BAKING.encode())
    for array in (positions, normals, triangles, within):
        digest.update(np.ascontiguousarray(array).data)
    count = len(within)
    shapes = ((count, HARMONICS), (count, HARMONICS), (count,))
    arrays = kept(f"light-{digest.hexdigest()[:32]}", shapes, make) if is_compiled() else make()
    return Visibility(*(array.astype(np.float32) for array in arrays))


class _Some:
    """What the light at some vertices of the model is worked out from."""

    def __init__(self, baked: Baked, chosen: Rows, sway: Float32) -> None:
        self._all = _table(baked, chosen)
        swaying = np.flatnonzero(sway[chosen] < 1)
        self._still = _table(baked, chosen[swaying])
        self._swaying = swaying
        self._sway = sway[chosen[swaying]]

    def reaching(self, share: float, lights: Float32, on_teeth: float) -> Float32:
        """(N, 4) key light, sky, through, rim light. share: how far the mouth is wide open. on_teeth: how
        much more of it falls in."""
        found = np.empty((len(self._all.open), 4), dtype=np.float32)
        lit(self._all, lights[:2], share, on_teeth, found)
        if len(lights) > 2 and len(self._swaying):
            still = np.empty((len(self._swaying), 4), dtype=np.float32)
            lit(self._still, lights[2:], share, on_teeth, still)
            sway(found, still, self._swaying, self._sway)
        return found


def _table(baked: Baked, chosen: Rows) -> Table:
    near = np.flatnonzero(baked.near[chosen])
    shut, wide = (
        [np.ascontiguousarray(table[rows].T) for table in visibility.arrays]
        for visibility, rows in ((baked.shut, chosen), (baked.wide, chosen[near]))
    )
    return Table(shut[0], shut[1], shut[2], wide[0], wide[1], wide[2], near)


def _basis(*turns: Float64) -> Float32:
    """(2 N, 16) what weighs the harmonics for key and rim light, turned by each of turns, N of (3, 3)."""
    towards = np.empty((2 * len(turns), 3))
    for k, into in enumerate(turns):
        np.dot(LIGHTS, into.T, out=towards[2 * k : 2 * k + 2])
    towards /= np.sqrt(np.einsum("ij,ij->i", towards, towards))[:, None]
    return weights(towards).astype(np.float32)
