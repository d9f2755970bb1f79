"""How much light reaches the vertices of a body: past its own folds, and past its limbs as they move.

The folds are looked at once, in the posture that the body is modelled in. Limbs, trunk and head are taken as
capsules between joints: what they hide of the sky and of the key light is worked out at a part of the
vertices, and spread over the others.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from fba.body.model import BodyModel
from fba.cache import kept, key_of
from fba.compiled import compiled, is_compiled
from fba_player.figure.face_light import KEY_DIRECTION, kept_visibility
from fba_player.mesh.simplify import Coarser

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]
Int32 = npt.NDArray[np.int32]
Rows = npt.NDArray[np.integer[Any]]
Prepared = tuple[Int32, Int32, Float32, Float32]

REACH = (1.0, 0.95, 0.0, 0.25)
"""What light reaches a body where nothing is in its way: it shades itself most from behind."""
CAPSULES = (
    ("sacroiliac", "vt4", 0.115),
    ("vc2", "skullbase", 0.085),
    ("l_shoulder", "l_elbow", 0.046), ("r_shoulder", "r_elbow", 0.046),
    ("l_elbow", "l_wrist", 0.036), ("r_elbow", "r_wrist", 0.036),
    ("l_wrist", "l_middle1", 0.038), ("r_wrist", "r_middle1", 0.038),
    ("l_hip", "l_knee", 0.072), ("r_hip", "r_knee", 0.072),
    ("l_knee", "l_ankle", 0.05), ("r_knee", "r_ankle", 0.05),
)  # fmt: skip
"""Joints at both ends, and the radius of a body 1.75 m tall (m)."""
KEY = tuple(np.array(KEY_DIRECTION) / np.linalg.norm(KEY_DIRECTION))
TALL = 1.75
COARSE = 0.0064
"""Light is worked out at what is left of the vertices where the surface may be off by this (m)."""
NEAREST = 3
LARGE = 4000
"""Which vertices are near to which is kept on disk for bodies of so many and more."""
MAKING = 1
"""Counts up with every change of that: what was kept before is then made anew."""
MOST_KEPT = 64
"""Choices of vertices remembered."""
FOLDS = 0.75
"""How much of what folds hide is shown: cloth lets some light through, and the posture changes."""


class LitBody:
    """The light on a body in one pose, worked out where it is asked for.

    capsules: float32 (K, 11), what is in its way, see `_capsules`; None where nothing is.
    """

    def __init__(
        self, some: Callable[[slice, Rows | None], Float32], capsules: Float32 | None = None
    ) -> None:
        self._some = some
        self.capsules = capsules

    def __call__(self, part: slice, rows: Rows | None) -> Float32:
        """float32 (N, 4) at some vertices (N,) of a part, or at all."""
        return self._some(part, rows)

    def of(self, part: slice) -> LitPart:
        """The same for one part."""
        return LitPart(self, part)


@dataclass(frozen=True, eq=False)
class LitPart:
    """The light on a part of a body in one pose."""

    body: LitBody
    part: slice

    def __call__(self, rows: Rows | None) -> Float32:
        """float32 (N, 4) at some vertices (N,), or at all."""
        return self.body(self.part, rows)


class BodyLight:
    """Light on a body. coarser: its parts' levels of detail, in the order of the model, None where a part
    has none. What hides what is worked out on first use, in about a second, and kept on disk."""

    def __init__(self, body: BodyModel, coarser: list[Coarser | None]) -> None:
        self._body = body
        self._coarser = coarser
        names = body.skeleton.names
        known = [row for row in CAPSULES if row[0] in names and row[1] in names]
        self._ends = np.array([[names.index(a), names.index(b)] for a, b, _ in known], dtype=np.intp)
        tall = float(np.ptp(body.vertices[:, 1])) if len(body.vertices) else TALL
        head = 0.92 if "head" in {part.kind for part in body.parts} else 0.85  # up to the crown, or the neck
        self._radii = np.array([row[2] for row in known]) * (tall / head / TALL if tall > 0 else 1.0)
        self._kept: dict[tuple[int, int, int], tuple[Rows | None, Prepared]] = {}

    def reaching(self, places: Float32, normals: Float32, joints: Float64) -> Float32:
        """float32 (V, 4), see `fba_player.view.view.FaceMesh.light`, for the body's vertices and normals (V,
        3) in the world and its joint matrices (J, 4, 4)."""
        return self.lit(places, normals, joints)(slice(0, len(places)), None)

    def lit(self, places: Float32, normals: Float32, joints: Float64) -> LitBody:
        """The same, worked out where it is asked for."""
        return self.lit_at(lambda rows: (places, normals), joints)

    def lit_at(self, reached: Callable[[Rows], tuple[Float32, Float32]], joints: Float64) -> LitBody:
        """The same. reached: gives places and normals (V, 3) that are right at rows (N,)."""
        if self.is_free:
            return LitBody(_free)
        capsules = _capsules(joints[self._ends.ravel(), :3, 3].reshape(-1, 2, 3), self._radii)

        def some(part: slice, rows: Rows | None) -> Float32:
            at, near, shares, folds = self._some(part, rows)
            past = np.empty((len(at), 2), dtype=np.float32)
            _past(*reached(at), at, capsules, past)
            light = np.empty((len(near), len(REACH)), dtype=np.float32)
            _spread(past, near, shares, folds, light)
            return light

        return LitBody(some, capsules)

    def _some(self, part: slice, rows: Rows | None) -> Prepared:
        """As `prepared` for some of a part's vertices; kept for as long as these are."""
        key = (part.start, part.stop, id(rows))
        if key not in self._kept:
            while len(self._kept) >= MOST_KEPT:
                del self._kept[next(iter(self._kept))]
            at, near, shares, folds = self.prepared
            chosen = np.arange(part.start, part.stop) if rows is None else rows + part.start
            used, places = np.unique(near[chosen], return_inverse=True)
            near = places.reshape(len(chosen), -1).astype(np.int32)
            self._kept[key] = (rows, (at[used], near, shares[chosen], folds[chosen]))
        return self._kept[key][1]

    @property
    def is_free(self) -> bool:
        """Whether nothing can be in its way."""
        return not is_compiled() or not len(self._ends)

    @cached_property
    def prepared(self) -> Prepared:
        """Vertices at which light is worked out; for each vertex (V, NEAREST) the places among these that it
        takes it from and their shares; and how much of the sky its folds leave it."""
        body = self._body
        rows: list[Rows] = []
        for part, coarser in zip(body.parts, self._coarser, strict=True):
            left = None if coarser is None else coarser.within(COARSE)
            rows.append(np.arange(len(part.vertices)) if left is None or not len(left) else np.unique(left))
        near, shares = _near([part.vertices for part in body.parts], rows)
        starts = [body.starts[part.name] for part in body.parts]
        every = np.ones(len(body.vertices), dtype=bool)
        open_ = kept_visibility(body.vertices, body.normals, body.triangles, every).open
        return (
            np.concatenate([some + start for some, start in zip(rows, starts, strict=True)]).astype(np.int32),
            near,
            shares,
            (1 - FOLDS * (1 - np.clip(open_, 0, 1))).astype(np.float32),
        )


def _near(parts: list[Float32], rows: list[Rows]) -> tuple[Int32, Float32]:
    """For each vertex of all parts, (V, 3) each, the places of the nearest of its part's rows among the rows
    of all: (V, NEAREST), and their shares."""

    def make() -> list[npt.NDArray[Any]]:
        from scipy.spatial import cKDTree

        near, shares = [], []
        count = 0
        for vertices, some in zip(parts, rows, strict=True):
            if len(some):
                away, found = cKDTree(vertices[some]).query(vertices, k=min(NEAREST, len(some)))
                away, found = away.reshape(len(vertices), -1), found.reshape(len(vertices), -1)
                missing = NEAREST - found.shape[1]
                away = np.pad(away, ((0, 0), (0, missing)), constant_values=1e9)
                found = np.pad(found, ((0, 0), (0, missing)))
                weight = 1 / np.maximum(away, 1e-4)
                near.append(found + count)
                shares.append(weight / weight.sum(axis=1, keepdims=True))
            count += len(some)
        return [np.concatenate(near).astype(np.int32), np.concatenate(shares).astype(np.float32)]

    total = sum(map(len, parts))
    if total < LARGE:
        near, shares = make()
        return near, shares
    key = key_of("near", MAKING, *parts, *rows)
    near, shares = kept(key, ((total, NEAREST),) * 2, make, [np.int32, np.float32])
    if near.min() < 0 or near.max() >= sum(map(len, rows)):
        near, shares = make()
    return near, shares


def _free(part: slice, rows: Rows | None) -> Float32:
    """(N, 4) the light where nothing is in its way."""
    free = np.empty((part.stop - part.start if rows is None else len(rows), len(REACH)), dtype=np.float32)
    free[:] = REACH
    return free


def _capsules(ends: Float64, radii: Float64) -> Float32:
    """(K, 11) for ends (K, 2, 3) and radii (K,): one end, the way to the other, its inverse squared length,
    how far it goes towards the key light, the inverse squared length of what is left of it, the radius and
    its square."""
    found = np.empty((len(ends), 11), dtype=np.float32)
    way = ends[:, 1] - ends[:, 0]
    squared = np.maximum(np.einsum("ij,ij->i", way, way), 1e-9)
    along = way @ KEY
    found[:, :3], found[:, 3:6], found[:, 7] = ends[:, 0], way, along
    found[:, 6], found[:, 8] = 1 / squared, 1 / np.maximum(squared - along * along, 1e-9)
    found[:, 9], found[:, 10] = radii, radii * radii
    return found


@compiled
def _past(places: Float32, normals: Float32, rows: Int32, capsules: Float32, past: Float32) -> None:
    """past (N, 2): how much of the key light and of the sky comes past the capsules to some vertices.

    A capsule after another, without branches: the processor then takes several vertices at a time."""
    one, zero = np.float32(1.0), np.float32(0.0)
    kx, ky, kz = np.float32(KEY[0]), np.float32(KEY[1]), np.float32(KEY[2])
    count = len(rows)
    x, y, z = np.empty(count, np.float32), np.empty(count, np.float32), np.empty(count, np.float32)
    nx, ny, nz = np.empty_like(x), np.empty_like(x), np.empty_like(x)
    lit, sky = np.ones(count, np.float32), np.ones(count, np.float32)
    for i in range(count):
        row = rows[i]
        x[i], y[i], z[i] = places[row, 0], places[row, 1], places[row, 2]
        nx[i], ny[i], nz[i] = normals[row, 0], normals[row, 1], normals[row, 2]
    for k in range(len(capsules)):
        cx, cy, cz = capsules[k, 0], capsules[k, 1], capsules[k, 2]
        bx, by, bz = capsules[k, 3], capsules[k, 4], capsules[k, 5]
        per_way, bk, per_rest = capsules[k, 6], capsules[k, 7], capsules[k, 8]
        radius, square = capsules[k, 9], capsules[k, 10]
        # The sky: the nearest place of the axis, as a ball there.
        for i in range(count):
            ax, ay, az = cx - x[i], cy - y[i], cz - z[i]
            s = min(max(-(ax * bx + ay * by + az * bz) * per_way, zero), one)
            dx, dy, dz = ax + s * bx, ay + s * by, az + s * bz
            towards = nx[i] * dx + ny[i] * dy + nz[i] * dz
            per = one / max(dx * dx + dy * dy + dz * dz, np.float32(1e-6))
            share = min(square * per, one) * np.float32(1.4)
            dark = min(share * towards * np.sqrt(per), np.float32(0.9))
            sky[i] *= one - (dark if towards > zero else zero)
        # The key light: where the way to it comes nearest to the axis.
        for i in range(count):
            ax, ay, az = cx - x[i], cy - y[i], cz - z[i]
            ab, ak = ax * bx + ay * by + az * bz, ax * kx + ay * ky + az * kz
            s = min(max((ak * bk - ab) * per_rest, zero), one)
            ahead = ak + s * bk
            dx, dy, dz = ax + s * bx - ahead * kx, ay + s * by - ahead * ky, az + s * bz - ahead * kz
            soft = np.float32(0.12) * ahead + np.float32(0.012)
            away = np.sqrt(dx * dx + dy * dy + dz * dz)
            hidden = max(min((radius + soft - away) / (np.float32(2.0) * soft), one), zero)
            hidden = hidden * hidden * (np.float32(3.0) - np.float32(2.0) * hidden)
            # a limb does not hide its own skin
            near = min((ahead / radius - np.float32(0.4)) / np.float32(1.2), one)
            before = nx[i] * kx + ny[i] * ky + nz[i] * kz >= np.float32(-0.2)
            lit[i] *= one - (hidden * near if before and ahead > np.float32(0.4) * radius else zero)
    for i in range(count):
        past[i, 0], past[i, 1] = lit[i], sky[i]


@compiled
def _spread(past: Float32, near: Int32, shares: Float32, folds: Float32, light: Float32) -> None:
    """light (V, 4): what comes past capsules and folds."""
    lit, open_ = np.float32(REACH[0]), np.float32(REACH[1])
    through, rim = np.float32(REACH[2]), np.float32(REACH[3])
    for i in range(len(light)):
        key, sky = np.float32(0.0), np.float32(0.0)
        for k in range(near.shape[1]):
            key += shares[i, k] * past[near[i, k], 0]
            sky += shares[i, k] * past[near[i, k], 1]
        light[i, 0] = lit * key
        light[i, 1] = open_ * (sky * folds[i])
        light[i, 2] = through
        light[i, 3] = rim * (sky * folds[i])
