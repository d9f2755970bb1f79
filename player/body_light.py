"""How much light reaches the vertices of a body: past its own folds, and past its limbs as they move.

The folds are looked at once, in the posture that the body is modelled in. Limbs, trunk and head are taken as
capsules between joints: what they hide of the sky and of the key light is worked out at a part of the
vertices, and spread over the others.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from fba.body.model import BodyModel
from fba.compiled import compiled, is_compiled
from player.coarse import Coarser
from player.face_light import KEY_DIRECTION, kept_visibility

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]
Int32 = npt.NDArray[np.int32]

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
TALL = 1.75
COARSE = 0.0064
"""Light is worked out at what is left of the vertices where the surface may be off by this (m)."""
NEAREST = 3
FOLDS = 0.75
"""How much of what folds hide is shown: cloth lets some light through, and the posture changes."""


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
        self._made: tuple[Int32, Int32, Float32, Float32] | None = None

    def reaching(self, places: Float32, normals: Float32, joints: Float64) -> Float32:
        """float32 (V, 4), see `player.shapes.FaceMesh.light`, for the body's vertices and normals (V, 3) in
        the world and its joint matrices (J, 4, 4)."""
        free = np.tile(np.array(REACH, dtype=np.float32), (len(places), 1))
        if not is_compiled() or not len(self._ends):
            return free
        if self._made is None:
            self._made = self._prepared()
        rows, near, shares, folds = self._made
        capsules = np.ascontiguousarray(joints[self._ends.ravel(), :3, 3].reshape(-1, 2, 3))
        key = np.array(KEY_DIRECTION) / np.linalg.norm(KEY_DIRECTION)
        past = np.empty((len(rows), 2), dtype=np.float32)
        _past(places, normals, rows, capsules, self._radii, key, past)
        _spread(past, near, shares, folds, free)
        return free

    def _prepared(self) -> tuple[Int32, Int32, Float32, Float32]:
        """Vertices at which light is worked out; for each vertex (V, NEAREST) the places among these that it
        takes it from and their shares; and how much of the sky its folds leave it."""
        from scipy.spatial import cKDTree

        body = self._body
        rows, near, shares = [], [], []
        count = 0
        for part, coarser in zip(body.parts, self._coarser, strict=True):
            start = body.starts[part.name]
            left = None if coarser is None else coarser.within(COARSE)
            some = np.arange(len(part.vertices)) if left is None or not len(left) else np.unique(left)
            if len(some):
                away, found = cKDTree(part.vertices[some]).query(part.vertices, k=min(NEAREST, len(some)))
                away, found = away.reshape(len(part.vertices), -1), found.reshape(len(part.vertices), -1)
                missing = NEAREST - found.shape[1]
                away = np.pad(away, ((0, 0), (0, missing)), constant_values=1e9)
                found = np.pad(found, ((0, 0), (0, missing)))
                weight = 1 / np.maximum(away, 1e-4)
                near.append(found + count)
                shares.append(weight / weight.sum(axis=1, keepdims=True))
            rows.append(some + start)
            count += len(some)
        every = np.ones(len(body.vertices), dtype=bool)
        open_ = kept_visibility(body.vertices, body.normals, body.triangles, every).open
        return (
            np.concatenate(rows).astype(np.int32),
            np.concatenate(near).astype(np.int32),
            np.concatenate(shares).astype(np.float32),
            (1 - FOLDS * (1 - np.clip(open_, 0, 1))).astype(np.float32),
        )


@compiled
def _past(
    places: Float32,
    normals: Float32,
    rows: Int32,
    capsules: Float64,
    radii: Float64,
    key: Float64,
    past: Float32,
) -> None:
    """past (N, 2): how much of the key light and of the sky comes past the capsules to some vertices."""
    kx, ky, kz = key[0], key[1], key[2]
    for i in range(len(rows)):
        x, y, z = places[rows[i], 0], places[rows[i], 1], places[rows[i], 2]
        nx, ny, nz = normals[rows[i], 0], normals[rows[i], 1], normals[rows[i], 2]
        facing = nx * kx + ny * ky + nz * kz
        lit, sky = 1.0, 1.0
        for k in range(len(radii)):
            radius = radii[k]
            ax, ay, az = capsules[k, 0, 0] - x, capsules[k, 0, 1] - y, capsules[k, 0, 2] - z
            bx = capsules[k, 1, 0] - capsules[k, 0, 0]
            by = capsules[k, 1, 1] - capsules[k, 0, 1]
            bz = capsules[k, 1, 2] - capsules[k, 0, 2]
            bb = max(bx * bx + by * by + bz * bz, 1e-9)
            ab = ax * bx + ay * by + az * bz
            # The sky: the nearest place of the axis, as a ball there.
            s = min(max(-ab / bb, 0.0), 1.0)
            dx, dy, dz = ax + s * bx, ay + s * by, az + s * bz
            squared = max(dx * dx + dy * dy + dz * dz, 1e-6)
            towards = nx * dx + ny * dy + nz * dz
            if towards > 0.0:
                share = min(radius * radius / squared, 1.0)
                sky *= 1.0 - min(1.4 * share * towards / np.sqrt(squared), 0.9)
            # The key light: where the way to it comes nearest to the axis.
            if facing < -0.2:
                continue
            ak, bk = ax * kx + ay * ky + az * kz, bx * kx + by * ky + bz * kz
            s = min(max((ak * bk - ab) / max(bb - bk * bk, 1e-9), 0.0), 1.0)
            ahead = ak + s * bk
            if ahead <= 0.4 * radius:
                continue
            dx, dy, dz = ax + s * bx - ahead * kx, ay + s * by - ahead * ky, az + s * bz - ahead * kz
            away = np.sqrt(dx * dx + dy * dy + dz * dz)
            soft = 0.12 * ahead + 0.012
            hidden = min(max((radius + soft - away) / (2.0 * soft), 0.0), 1.0)
            hidden = hidden * hidden * (3.0 - 2.0 * hidden)
            near = min((ahead / radius - 0.4) / 1.2, 1.0)  # a limb does not hide its own skin
            lit *= 1.0 - hidden * near
        past[i, 0] = lit
        past[i, 1] = sky


@compiled
def _spread(past: Float32, near: Int32, shares: Float32, folds: Float32, light: Float32) -> None:
    """Multiply light (V, 4) by what comes past capsules and folds."""
    for i in range(len(light)):
        key, sky = np.float32(0.0), np.float32(0.0)
        for k in range(near.shape[1]):
            key += shares[i, k] * past[near[i, k], 0]
            sky += shares[i, k] * past[near[i, k], 1]
        light[i, 0] *= key
        light[i, 1] *= sky * folds[i]
        light[i, 3] *= sky * folds[i]
