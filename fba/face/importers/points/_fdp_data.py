"""The content of an FDP file, and the repair of feature points on the wrong side of the face."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fba.arrays import Float64
from fba.errors import FbaWarning
from fba.face.feature_points import MIRRORED, row_of


@dataclass(frozen=True, slots=True)
class Influence:
    """Vertices of an Xface mesh that follow a FAP, less with distance from the point.

    fap: its number. shape: the file's name for the falloff. weight: at the point itself. mesh: the
    submesh; point: the vertex in it; vertices: those that follow.
    """

    fap: int
    shape: str
    weight: float
    mesh: str
    point: int
    vertices: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class XfaceMesh:
    """A mesh file that an Xface file names. alias, category: what it shows ("Rest", "Expression").

    bind: what its submeshes are, by the file's word ("LeftEye", "UpperTeeth", "Hair").
    """

    alias: str
    category: str
    file: str
    bind: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Fdp:
    """The content of an FDP file.

    path: the file. format: "text" or "xface". points: float64 (84, 3), in the file's own unit, NaN where
    it gives none. vertices: the mesh (as the file names it) and the vertex of a point, by its name.
    distances: the face's distances ENS0, ES0, IRISD0, MNS0, MW0 as Xface files give them. meshes,
    influences: of Xface files.
    """

    path: str
    format: str
    points: Float64
    vertices: Mapping[str, tuple[str, int]]
    distances: Mapping[str, float] = field(default_factory=dict)
    meshes: tuple[XfaceMesh, ...] = ()
    influences: tuple[Influence, ...] = ()


def repair_sides_with_warning(points: Float64, path: str, *, stacklevel: int = 2) -> Float64:
    """Return the points (84, 3) with left and right repaired as `repair_sides` does; an FbaWarning names the
    changes."""
    right, swaps, mirrored = repair_sides(points)
    changed = [f"{a} and {b} have changed places" for a, b in swaps]
    changed += [f"{name} is on the other side" for name in mirrored]
    if changed:
        warnings.warn(
            f"{path}: corrected (+x is the subject's left): {'; '.join(changed[:6])}"
            + (f"; and {len(changed) - 6} more" if len(changed) > 6 else ""),
            FbaWarning,
            stacklevel=stacklevel + 1,
        )
    return right


def repair_sides(points: Float64) -> tuple[Float64, list[tuple[str, str]], list[str]]:
    """Return (points (84, 3) on their own sides of the face, pairs that were swapped, points that were
    mirrored).

    Unchanged where most pairs do not lie left and right in x: then the axes are not the standard's.
    """
    points = points.copy()
    row = row_of()
    midline = points[[row[name] for name in ("2.1", "2.2", "2.3", "2.10", "8.1", "8.2", "9.3", "9.15")], 0]
    middle = float(np.nanmedian(midline)) if np.isfinite(midline).any() else 0.0
    swaps: list[tuple[str, str]] = []
    mirrored: list[str] = []
    pairs = points[[(row[left], row[right]) for left, right in MIRRORED.items()], 0] - middle
    apart = np.sign(pairs[:, 0]) * np.sign(pairs[:, 1])
    if (apart == -1).sum() < (apart >= 0).sum():
        return points, swaps, mirrored

    def swap(a: str, b: str) -> None:
        points[[row[a], row[b]]] = points[[row[b], row[a]]]
        swaps.append((a, b))

    for left, right in MIRRORED.items():
        x, y = points[row[left], 0] - middle, points[row[right], 0] - middle
        if x < 0 < y:
            swap(left, right)
            continue
        for name, wrong in ((left, x < 0), (right, y > 0)):
            if wrong:
                points[row[name], 0] = 2 * middle - points[row[name], 0]
                mirrored.append(name)
    for inner, outer in (("3.8", "3.12"), ("3.7", "3.11")):
        # of both corners of an eye, the first one is further to the left
        if points[row[inner], 0] < points[row[outer], 0]:
            swap(inner, outer)
    return points, swaps, mirrored
