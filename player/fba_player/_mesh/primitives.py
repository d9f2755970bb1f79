"""Capsule, sphere and tube: small meshes that are drawn many times."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float32, Int32


def _sheet(rows: int, columns: int) -> Int32:
    """Return int32 (F, 3): triangles of rows x columns vertices whose last column joins the first."""
    r, c = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    a, b = r * columns + c, r * columns + (c + 1) % columns
    both = np.stack([a, b, b + columns, a, b + columns, a + columns], axis=-1)
    return both.reshape(-1, 3).astype(np.int32)


def capsule_mesh(around: int = 20, cap: int = 6) -> tuple[Float32, Int32]:
    """Return the vertices (V, 4) and triangles (F, 3) of a capsule.

    A vertex is a point on the unit sphere, y along the axis, and the end that it belongs to, 0 or 1.
    """
    lower = np.linspace(-np.pi / 2, 0, cap + 1)
    latitudes = np.concatenate([lower, -lower[::-1]])
    ends = np.repeat([0.0, 1.0], cap + 1)
    turn = np.linspace(0, 2 * np.pi, around, endpoint=False)
    flat = np.cos(latitudes)[:, None]
    x, z = flat * np.cos(turn), flat * np.sin(turn)
    y = np.repeat(np.sin(latitudes)[:, None], around, axis=1)
    end = np.repeat(ends[:, None], around, axis=1)
    vertices = np.stack([x, y, z, end], axis=-1).reshape(-1, 4).astype(np.float32)
    return vertices, _sheet(len(latitudes), around)


def sphere_mesh(rows: int = 20, around: int = 32) -> tuple[Float32, Int32]:
    """Return the vertices (V, 3) and triangles (F, 3) of the unit sphere, its poles on the z axis."""
    latitudes = np.linspace(0, np.pi, rows)
    turn = np.linspace(0, 2 * np.pi, around, endpoint=False)
    flat = np.sin(latitudes)[:, None]
    x, y = flat * np.cos(turn), flat * np.sin(turn)
    z = np.repeat(np.cos(latitudes)[:, None], around, axis=1)
    return np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32), _sheet(rows, around)


def tube_mesh(count: int, around: int = 8) -> Int32:
    """Return int32 (F, 3): triangles of a tube of `count` rings with `around` vertices each."""
    return _sheet(count, around)
