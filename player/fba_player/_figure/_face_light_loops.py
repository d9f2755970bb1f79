"""Compiled loops of `fba_player._figure.face_light`: light at vertices from their precomputed visibility.

Bounds: a table (`face_light._table`) has a column for each vertex of a part, or for each vertex near the
mouth, whose numbers are columns of the first. Light has a row for each vertex: checked here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fba.arrays import Float32, Intp
from fba.compiled import compiled


class Table(NamedTuple):
    """Visibility of N vertices (see `fba_player._figure.occlusion`) with the mouth shut, and, of the M
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


@compiled
def light_vertices(table: Table, basis: Float32, wide: float, added: float, light: Float32) -> None:
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
def blend_swaying(light: Float32, still: Float32, rows: Intp, share: Float32) -> None:
    """Blend rows of light (N, 4) with `still` (M, 4), the light of the same vertices at rest. share: (M,),
    how far each moves with the head."""
    for k in range(len(rows)):
        for column in range(4):
            light[rows[k], column] = still[k, column] + share[k] * (light[rows[k], column] - still[k, column])


@compiled
def _products(
    light: Float32, through: Float32, basis: Float32, count: int
) -> tuple[Float32, Float32, Float32]:
    """Return key light, rim light, and rim light through the skin, each (count,)."""
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
