"""Checks that no triangle turns over or tears at the limits of a FAP's range."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fba.arrays import Bool, Float64, Integer
from fba.face.checks._findings import Finding
from fba.face.checks._posing import Poser
from fba.face.model import Part
from fba.face.points import HEAD_PITCH, HEAD_ROLL, HEAD_YAW, OPEN_JAW, TONGUE_ROLL
from fba.geometry import nearest_rotation
from fba.parameters import faps
from fba.rotations import cross, dot, lengths

TURNING = {OPEN_JAW, 19, 20, 21, 22, TONGUE_ROLL}
"""FAPs that rotate the skin: under these a triangle has turned over if it faces away from its neighbours."""
HAIR = ("lash", "hair")
"""Kinds of parts that are two-sided: their triangles cannot turn over."""
LIDS = {19, 20, 21, 22}
EYE_CORNERS = ("3.7", "3.11", "3.8", "3.12")
CORNER_RADIUS = 0.12
"""Radius about the eye's corners that is not checked, as a share of the eye's width."""
RIGID = {HEAD_PITCH, HEAD_YAW, HEAD_ROLL}
MAX_STRETCH = 8.0
"""Factor by which an edge may grow."""
SHORT_EDGE = 0.3
"""Share of the typical edge length, which stands for shorter edges there."""
MAX_TURNED_SHARE = 0.003
"""Share of the moving surface that may turn over in the folds of skin at the corners of eyes."""
DEGENERATE = 1e-5
"""Triangles smaller than this share of the median area are ignored."""
TURNED_COSINE = -0.3
"""A triangle has turned over if the cosine between its normal and its neighbours' is below this."""


def check_extremes(poser: Poser, fap: int) -> Iterator[Finding]:
    """Yield a finding per part whose triangles turn over or tear at either end of a FAP's range."""
    entry = faps()[fap - 1]
    if fap in RIGID or entry.i_limits is None:
        return
    for limit in entry.i_limits:
        if not limit:
            continue
        value = float(limit * entry.step)
        moved = poser.pose({fap: value})
        for part in poser.model.parts:
            own = slice(poser.model.starts[part.name], poser.model.starts[part.name] + len(part.vertices))
            before, after = poser.neutral[own], moved[own]
            if np.abs(after - before).max(initial=0.0) < 1e-9 or _moved_rigidly(before, after):
                continue
            over, torn, share = count_damage(
                before, after, _checked_triangles(poser, part, fap), turning=fap in TURNING
            )
            if part.kind in HAIR:
                over = 0
            if over and not (fap in TURNING and share <= MAX_TURNED_SHARE):
                yield Finding(
                    entry.label,
                    "no triangle turns over at the limits of its range",
                    f"{over} of part {part.name!r}, {share:.2%} of what moves, at {value:g}",
                    "none",
                )
            if torn:
                yield Finding(
                    entry.label,
                    "no triangle explodes at the limits of its range",
                    f"{torn} edges of part {part.name!r} more than {MAX_STRETCH:g} times as long "
                    f"at {value:g}",
                    "none",
                )


def _checked_triangles(poser: Poser, part: Part, fap: int) -> Integer:
    """Return (M, 3) triangles of a part; for lid FAPs without those at the eyes' corners, where skin
    folds."""
    if fap not in LIDS:
        return part.triangles
    corners = np.array([poser.point(name) for name in EYE_CORNERS])
    wide = np.linalg.norm(corners[0] - corners[1]), np.linalg.norm(corners[2] - corners[3])
    away = np.linalg.norm(part.vertices[:, None] - corners, axis=2)
    within = (np.nan_to_num(away, nan=np.inf) < CORNER_RADIUS * np.nan_to_num(np.repeat(wide, 2))).any(axis=1)
    counted: Integer = part.triangles[~_touching(within, part.triangles)]
    return counted


def _touching(mask: Bool, triangles: Integer) -> Bool:
    """Return (F,) mask of the triangles (F, 3) with a vertex in a mask (V,)."""
    touching: Bool = mask[triangles[:, 0]] | mask[triangles[:, 1]] | mask[triangles[:, 2]]
    return touching


def count_damage(
    before: Float64, after: Float64, triangles: Integer, *, turning: bool
) -> tuple[int, int, float]:
    """Return (triangles turned over, edges torn, share of the moving area turned over)."""
    moves = np.abs(after - before) > 1e-9
    moved_triangles = triangles[_touching(moves[:, 0] | moves[:, 1] | moves[:, 2], triangles)]
    sides = [
        (
            before[moved_triangles[:, k]] - before[moved_triangles[:, k - 1]],
            after[moved_triangles[:, k]] - after[moved_triangles[:, k - 1]],
        )
        for k in range(3)
    ]
    normals = [cross(sides[0][which], sides[1][which]) for which in (0, 1)]
    areas = lengths(normals[0])
    not_degenerate = areas > DEGENERATE * np.median(areas) if len(areas) else areas > 0
    if turning:
        facing = [_facing(normal, moved_triangles, len(before)) for normal in normals]
        over = (facing[0] > 0) & (facing[1] < TURNED_COSINE)
    else:
        over = dot(normals[0], normals[1]) <= 0
    over &= not_degenerate
    edges = np.array([[lengths(side[which]) for side in sides] for which in (0, 1)])
    typical = float(np.median(edges[0])) if edges.size else 0.0
    torn = edges[1] > MAX_STRETCH * np.maximum(edges[0], SHORT_EDGE * typical)
    share = float(areas[over].sum() / max(areas.sum(), 1e-30))
    return int(over.sum()), int(torn.sum()), share


def _facing(normals: Float64, triangles: Integer, count: int) -> Float64:
    """Return (F,) cosine between each triangle's normal and that of the triangles around it."""
    sums = np.zeros((count, 3))
    for corner in range(3):
        np.add.at(sums, triangles[:, corner], normals)
    around = sums[triangles].sum(axis=1) - 3 * normals
    product = lengths(around) * lengths(normals)
    result: Float64 = np.where(product > 0, dot(around, normals) / np.maximum(product, 1e-300), 1.0)
    return result


def _moved_rigidly(before: Float64, after: Float64) -> bool:
    """Return whether the vertices moved as a rigid body, which harms no triangle."""
    a, b = before - before.mean(axis=0), after - after.mean(axis=0)
    return bool(np.abs(a @ nearest_rotation(a.T @ b) - b).max() < 1e-4 * max(float(np.ptp(a)), 1e-9))
