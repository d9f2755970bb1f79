"""How much light reaches the vertices of a body past its folds and past its moving limbs.

Occlusion by folds is computed once, in the bind pose. Limbs, trunk and head count as capsules between
joints: how much they hide of the sky and of the key light is computed at some vertices and interpolated at
the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fba.arrays import Array, Float32, Float64, Int32, Integer, Intp
from fba.body import BodyModel
from fba.cache import load_or_make, make_key
from fba.compiled import compiled, is_compiled
from fba.mesh.simplify import DetailLevels
from fba_player._figure.face_light import KEY_DIRECTION, cached_visibility

Prepared = tuple[Int32, Int32, Float32, Float32]

UNOBSTRUCTED_LIGHT = (1.0, 0.95, 0.0, 0.25)
"""Light that reaches an unobstructed body: key, sky, through, rim; it shades itself most from behind."""
CAPSULES = (
    ("sacroiliac", "vt4", 0.115),
    ("vc2", "skullbase", 0.085),
    ("l_shoulder", "l_elbow", 0.046), ("r_shoulder", "r_elbow", 0.046),
    ("l_elbow", "l_wrist", 0.036), ("r_elbow", "r_wrist", 0.036),
    ("l_wrist", "l_middle1", 0.038), ("r_wrist", "r_middle1", 0.038),
    ("l_hip", "l_knee", 0.072), ("r_hip", "r_knee", 0.072),
    ("l_knee", "l_ankle", 0.05), ("r_knee", "r_ankle", 0.05),
)  # fmt: skip
"""Joints at both ends, and the radius (m) for a body 1.75 m tall."""
KEY_UNIT = tuple(np.array(KEY_DIRECTION) / np.linalg.norm(KEY_DIRECTION))
"""Unit vector towards the key light."""
ADULT_HEIGHT = 1.75
"""Metres."""
SAMPLING_ERROR = 0.0064
"""Light is computed at the vertices that are left when the surface is simplified with this error (m)."""
NEIGHBOURS = 3
"""Number of sampled vertices from which the light at a vertex is interpolated."""
MIN_CACHED_VERTICES = 4000
"""Neighbours are cached on disk for bodies with at least this many vertices."""
CACHE_VERSION = 1
"""Cache version of neighbours; increment when `_nearest_samples` gives other results."""
FOLD_STRENGTH = 0.75
"""Strength of occlusion by folds: below 1, as cloth lets light through and the posture changes."""


@dataclass(frozen=True, eq=False)
class BodyLight:
    """Light on a body; see `build_body_light`.

    coarser: levels of detail by the name of each part that is drawn, None for a part without any. ends:
    (K, 2), the joints at both ends of its capsules, and radii: (K,), metres. Occlusion is computed on first
    use, in about a second, and stored in the disk cache.
    """

    body: BodyModel
    coarser: Mapping[str, DetailLevels | None]
    ends: Intp
    radii: Float64

    def shade(self, positions: Float32, normals: Float32, joints: Float64) -> Float32:
        """Return float32 (V, 4), as in `FaceMesh.light`; meaningless at parts that are not drawn.

        positions, normals: (V, 3) of the body in the world. joints: (J, 4, 4), its joint matrices. Without
        numba, nothing blocks the light.
        """
        if not len(positions) == len(normals) == len(self.body.vertices):
            raise ValueError(f"{len(positions)} positions for a body of {len(self.body.vertices)} vertices")
        light = np.empty((len(positions), len(UNOBSTRUCTED_LIGHT)), dtype=np.float32)
        if not is_compiled() or not len(self.ends):
            light[:] = UNOBSTRUCTED_LIGHT
            return light
        sampled, near, shares, folds = self._prepared
        capsules = _capsules(joints[self.ends.ravel(), :3, 3].reshape(-1, 2, 3), self.radii)
        past = np.empty((len(sampled), 2), dtype=np.float32)
        _shade_by_capsules(positions, normals, sampled, capsules, past)
        _interpolate(past, near, shares, folds, light)
        return light

    @property
    def open_sky(self) -> Float32:
        """(V,): the share of the sky that the body's folds leave to each vertex."""
        return self._prepared[3]

    @cached_property
    def _prepared(self) -> Prepared:
        """Data for the V vertices of all parts that do not change with the pose.

        (N,) vertices at which light is computed; (V, NEIGHBOURS) indices into these from which each vertex
        is interpolated, and (V, NEIGHBOURS) their weights; (V,) share of the sky that folds leave.
        """
        body = self.body
        rows: list[Integer] = []
        for part in body.parts:
            if part.name not in self.coarser:
                rows.append(np.arange(min(len(part.vertices), 1)))  # not drawn
                continue
            coarser = self.coarser[part.name]
            left = None if coarser is None else coarser.triangles_within(SAMPLING_ERROR)
            rows.append(np.arange(len(part.vertices)) if left is None or not len(left) else np.unique(left))
        near, shares = _nearest_samples([part.vertices for part in body.parts], rows)
        every = np.ones(len(body.vertices), dtype=bool)
        open_ = cached_visibility(body.vertices, body.normals, body.triangles, every).open
        counted = [samples + body.starts[part.name] for samples, part in zip(rows, body.parts, strict=True)]
        left_by_folds = (1 - FOLD_STRENGTH * (1 - np.clip(open_, 0, 1))).astype(np.float32)
        return np.concatenate(counted).astype(np.int32), near, shares, left_by_folds


def build_body_light(body: BodyModel, coarser: Mapping[str, DetailLevels | None]) -> BodyLight:
    """Return the light on a body; coarser as in `BodyLight`."""
    names = body.skeleton.names
    limbs = [row for row in CAPSULES if row[0] in names and row[1] in names]
    ends = np.array([[names.index(a), names.index(b)] for a, b, _ in limbs], dtype=np.intp)
    tall = float(np.ptp(body.vertices[:, 1])) if len(body.vertices) else ADULT_HEIGHT
    share = 0.92 if "head" in {part.kind for part in body.parts} else 0.85  # up to the crown, or to the neck
    radii = np.array([row[2] for row in limbs]) * (tall / share / ADULT_HEIGHT if tall > 0 else 1.0)
    return BodyLight(body, coarser, ends, radii)


def _nearest_samples(parts: list[Float32], rows: list[Integer]) -> tuple[Int32, Float32]:
    """Return the nearest sampled vertices of its part for each of the V vertices of all parts.

    They are indices (V, NEIGHBOURS), counted over the rows of all parts, and their weights (V, NEIGHBOURS).
    """

    def make() -> list[Array]:
        from scipy.spatial import cKDTree

        near, shares = [], []
        count = 0
        for vertices, samples in zip(parts, rows, strict=True):
            if len(samples):
                away, index = cKDTree(vertices[samples]).query(vertices, k=min(NEIGHBOURS, len(samples)))
                away, index = away.reshape(len(vertices), -1), index.reshape(len(vertices), -1)
                missing = NEIGHBOURS - index.shape[1]
                away = np.pad(away, ((0, 0), (0, missing)), constant_values=1e9)
                index = np.pad(index, ((0, 0), (0, missing)))
                weight = 1 / np.maximum(away, 1e-4)
                near.append(index + count)
                shares.append(weight / weight.sum(axis=1, keepdims=True))
            count += len(samples)
        return [np.concatenate(near).astype(np.int32), np.concatenate(shares).astype(np.float32)]

    total = sum(map(len, parts))
    if total < MIN_CACHED_VERTICES:
        near, shares = make()
        return near, shares
    key = make_key("near", CACHE_VERSION, *parts, *rows)
    near, shares = load_or_make(key, ((total, NEIGHBOURS),) * 2, make, [np.int32, np.float32])
    if near.min() < 0 or near.max() >= sum(map(len, rows)):
        near, shares = make()
    return near, shares


def _capsules(ends: Float64, radii: Float64) -> Float32:
    """Return float32 (K, 11) for ends (K, 2, 3) and radii (K,): one end (3), the axis to the other end (3),
    its inverse squared length, its component towards the key light, the inverse squared length of the rest,
    the radius and its square."""
    capsules = np.empty((len(ends), 11), dtype=np.float32)
    axis = ends[:, 1] - ends[:, 0]
    squared = np.maximum(np.einsum("ij,ij->i", axis, axis), 1e-9)
    along = axis @ KEY_UNIT
    capsules[:, :3], capsules[:, 3:6], capsules[:, 7] = ends[:, 0], axis, along
    capsules[:, 6], capsules[:, 8] = 1 / squared, 1 / np.maximum(squared - along * along, 1e-9)
    capsules[:, 9], capsules[:, 10] = radii, radii * radii
    return capsules


@compiled
def _shade_by_capsules(
    positions: Float32, normals: Float32, rows: Int32, capsules: Float32, past: Float32
) -> None:
    """Write `past` (N, 2): the shares of key light and sky that capsules let through to vertices `rows` (N,).

    One capsule after another and without branches, so that the loops over vertices are vectorised.

    Bounds: rows are vertices of the body, whose arrays `shade` checks; past has a row for each.
    """
    one, zero = np.float32(1.0), np.float32(0.0)
    kx, ky, kz = np.float32(KEY_UNIT[0]), np.float32(KEY_UNIT[1]), np.float32(KEY_UNIT[2])
    count = len(rows)
    x, y, z = np.empty(count, np.float32), np.empty(count, np.float32), np.empty(count, np.float32)
    nx, ny, nz = np.empty_like(x), np.empty_like(x), np.empty_like(x)
    lit, sky = np.ones(count, np.float32), np.ones(count, np.float32)
    for i in range(count):
        row = rows[i]
        x[i], y[i], z[i] = positions[row, 0], positions[row, 1], positions[row, 2]
        nx[i], ny[i], nz[i] = normals[row, 0], normals[row, 1], normals[row, 2]
    for k in range(len(capsules)):
        cx, cy, cz = capsules[k, 0], capsules[k, 1], capsules[k, 2]
        bx, by, bz = capsules[k, 3], capsules[k, 4], capsules[k, 5]
        per_axis, bk, per_rest = capsules[k, 6], capsules[k, 7], capsules[k, 8]
        radius, square = capsules[k, 9], capsules[k, 10]
        # The sky: a ball at the nearest point of the axis.
        for i in range(count):
            ax, ay, az = cx - x[i], cy - y[i], cz - z[i]
            s = min(max(-(ax * bx + ay * by + az * bz) * per_axis, zero), one)
            dx, dy, dz = ax + s * bx, ay + s * by, az + s * bz
            towards = nx[i] * dx + ny[i] * dy + nz[i] * dz
            per = one / max(dx * dx + dy * dy + dz * dz, np.float32(1e-6))
            share = min(square * per, one) * np.float32(1.4)
            dark = min(share * towards * np.sqrt(per), np.float32(0.9))
            sky[i] *= one - (dark if towards > zero else zero)
        # The key light: where the ray to it passes nearest to the axis.
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
            # a limb does not hide its own skin from the light
            near = min((ahead / radius - np.float32(0.4)) / np.float32(1.2), one)
            before = nx[i] * kx + ny[i] * ky + nz[i] * kz >= np.float32(-0.2)
            lit[i] *= one - (hidden * near if before and ahead > np.float32(0.4) * radius else zero)
    for i in range(count):
        past[i, 0], past[i, 1] = lit[i], sky[i]


@compiled
def _interpolate(past: Float32, near: Int32, shares: Float32, folds: Float32, light: Float32) -> None:
    """Write light (V, 4): what comes past capsules and folds.

    Bounds: `near` are rows of past (`_nearest_samples` checks those of the cache), for each vertex of the
    body, whose number `shade` checks.
    """
    lit, open_ = np.float32(UNOBSTRUCTED_LIGHT[0]), np.float32(UNOBSTRUCTED_LIGHT[1])
    through, rim = np.float32(UNOBSTRUCTED_LIGHT[2]), np.float32(UNOBSTRUCTED_LIGHT[3])
    for i in range(len(light)):
        key, sky = np.float32(0.0), np.float32(0.0)
        for k in range(near.shape[1]):
            key += shares[i, k] * past[near[i, k], 0]
            sky += shares[i, k] * past[near[i, k], 1]
        light[i, 0] = lit * key
        light[i, 1] = open_ * (sky * folds[i])
        light[i, 2] = through
        light[i, 3] = rim * (sky * folds[i])
