"""FDP files: where the feature points of a face are. Text files, and the XML of Xface.

A text FDP file has a line `<group.index> x y z <mesh.vertex>` a point (digest text-formats.md); an Xface
file names vertices of mesh files, and for each FAP the vertices around a point that follow it.
"""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from fba.errors import FbaWarning, ModelError
from fba.face.feature_points import MIRRORED, names, row_of
from fba.mesh.text_files import number, whole, whole_number, words

Float64 = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Influence:
    """Vertices of an Xface mesh that follow a FAP: the further from the point, the less.

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
    """What an FDP file holds.

    path: the file. format: "text" or "xface". points: float64 (84, 3), in the file's own unit, NaN where
    it says nothing. vertices: the mesh (as the file names it) and the vertex of a point, by its name.
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


def read_fdp(path: str | os.PathLike[str]) -> Float64:
    """Feature points of an FDP file: float64 (84, 3), in the file's unit, NaN where it has none.

    A point on the wrong side of the face, or eye corners that changed places, are put right with an
    FbaWarning. An Xface file names vertices of mesh files; the points are looked up there. Raises
    ModelError where the file is damaged or its mesh files are missing.
    """
    fdp = load_fdp(path)
    if fdp.format == "xface":
        from fba.face.importers.points.xface import xface_points

        return xface_points(fdp)
    return fdp.points


def load_fdp(path: str | os.PathLike[str]) -> Fdp:
    """All that an FDP file says, points put right as `read_fdp` does; ModelError where damaged."""
    name = os.fspath(path)
    if whole(name)[:4096].lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        from fba.face.importers.points.xface import load_xface

        return load_xface(name)
    return _load_text(name)


def _load_text(path: str) -> Fdp:
    points = np.full((len(names()), 3), np.nan)
    vertices: dict[str, tuple[str, int]] = {}
    strange: list[str] = []
    header = False
    for where, tokens in words(path):
        if not header:
            if len(tokens) < 2 or not tokens[0].startswith("1."):
                raise ModelError(
                    f"{where}: an FDP file begins with '1.0 NAME', not {' '.join(tokens)[:40]!r}"
                )
            header = True
        elif tokens[0] in ("NUL", "NLL"):
            continue  # how many points the inner lips have in another player
        elif len(tokens) not in (4, 5):
            raise ModelError(
                f"{where}: a feature point is 'GROUP.INDEX x y z MESH.VERTEX', not {' '.join(tokens)[:60]!r}"
            )
        elif tokens[0] not in row_of():
            strange.append(tokens[0])
        else:
            point = tokens[0]
            if np.isfinite(points[row_of()[point]]).any():
                raise ModelError(f"{where}: feature point {point} comes twice")
            points[row_of()[point]] = [number(token, where, "a coordinate") for token in tokens[1:4]]
            if len(tokens) == 5:
                mesh, _, vertex = tokens[4].partition(".")
                index = whole_number(vertex, where, "the vertex in MESH.VERTEX")
                if index >= 0:
                    vertices[point] = (mesh, index)
    if not np.isfinite(points).any():
        raise ModelError(f"{path}: there is no feature point in it")
    if strange:
        warnings.warn(
            f"{path}: left out {', '.join(strange[:5])}: the standard has no such feature point",
            FbaWarning,
            stacklevel=4,
        )
    return Fdp(path, "text", on_their_sides(points, path, stacklevel=4), vertices)


def on_their_sides(points: Float64, path: str, *, stacklevel: int = 2) -> Float64:
    """Points on the wrong side mirrored, changed places changed back; an FbaWarning names them."""
    right, swaps, mirrored = sides(points)
    changed = [f"{a} and {b} have changed places" for a, b in swaps]
    changed += [f"{name} is on the other side" for name in mirrored]
    if changed:
        warnings.warn(
            f"{path}: put right (+x is the subject's left): {'; '.join(changed[:6])}"
            + (f"; and {len(changed) - 6} more" if len(changed) > 6 else ""),
            FbaWarning,
            stacklevel=stacklevel + 1,
        )
    return right


def sides(points: Float64) -> tuple[Float64, list[tuple[str, str]], list[str]]:
    """Points (84, 3) on their sides of the face; the pairs that had changed places, and those mirrored.

    As they are where most pairs have no left and right in x: then the axes are others than the standard's.
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
        # of two corners of an eye the first named is the one more to the left
        if points[row[inner], 0] < points[row[outer], 0]:
            swap(inner, outer)
    return points, swaps, mirrored
