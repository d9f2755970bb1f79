"""Warps the adult head's feature points to those located on another head."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from fba.arrays import Float64
from fba.face.feature_points import FREE_POINTS, MIRRORED, names, neutral_points
from fba.face.importers.assembly._polygon_parts import Piece
from fba.parameters import point_rows

ROWS = {"9.8": "upper teeth", "9.10": "upper teeth", "9.9": "lower teeth", "9.11": "lower teeth"}
"""Parts that points of the teeth stand on."""
UNWARPED_POINTS = ("3.5", "3.6", "3.7", "3.8", "3.11", "3.12", "6.1", "6.2", "6.3", "6.4")
"""Points that are not used for the warp: pupils may lie behind the lids or in front of them."""
HAIR = 0.3
"""Distance (of the pupils) within which the crown may be that of hair, and does not shape the face."""
FOLD_DISTANCE = 0.08
"""Usual distance of the fold of a lid from its margin, in distances of the pupils."""
SMOOTHING = 0.1
"""Smoothing of the warp: points that coincide on the adult head may be apart on another."""


def warp_points(
    pieces: Sequence[Piece],
    located: Mapping[str, Float64],
    *,
    symmetric: bool = False,
    own: Collection[str] = (),
) -> Float64:
    """Return (84, 3) the adult head's points, warped to those located and moved onto parts of their kind.

    symmetric: points of the right side stand on the vertices that mirror those of the left. own: those of the
    right side that stay where they were located.
    """
    from scipy.interpolate import RBFInterpolator
    from scipy.spatial import cKDTree

    from fba.face.authoring.surface.binding import kinds_for_point

    row, adult = point_rows(), neutral_points()
    known = dict(located)
    middle = float((known["3.5"] + known["3.6"])[0]) / 2
    for left, right in MIRRORED.items():
        if (left in known) != (right in known):
            present, absent = (left, right) if left in known else (right, left)
            known[absent] = known[present] * (-1, 1, 1) + (2 * middle, 0, 0)
    scale = float(known["3.5"][0] - known["3.6"][0]) / float(adult[row["3.5"], 0] - adult[row["3.6"], 0])
    left_out = (*UNWARPED_POINTS, "11.4") if _may_be_hair(known, adult, scale) else UNWARPED_POINTS
    used = [name for name in known if name not in left_out]
    source = np.array([adult[row[name]] for name in used])
    target = np.array([known[name] for name in used]) / scale
    warp = RBFInterpolator(source, target, kernel="linear", degree=1, smoothing=SMOOTHING)
    points: Float64 = warp(adult) * scale
    centre = points[[row["3.5"], row["3.6"], row["7.1"]]].mean(axis=0)
    trees = {}
    mirrored = {right: left for left, right in MIRRORED.items()} if symmetric else {}
    for name in known.keys() & own:
        mirrored.pop(name, None)
    for name in sorted(names(), key=lambda name: name in mirrored):
        if name in known:
            points[row[name]] = known[name]
        if name in mirrored and np.isfinite(points[row[mirrored[name]]]).all():
            # left points come first and stand on their vertices by now
            points[row[name]] = points[row[mirrored[name]]] * (-1, 1, 1) + (2 * middle, 0, 0)
        if name in FREE_POINTS:
            continue
        # located points are vertices, or lie on the profile between some
        key = (*kinds_for_point(name), ROWS.get(name, ""), str(name in known))
        if key not in trees:
            candidates = [
                piece.part.vertices.astype(np.float64) if name in known else _outside(piece, centre)
                for piece in pieces
                if piece.part.kind in kinds_for_point(name)
                and piece.part.name == ROWS.get(name, piece.part.name)
            ]
            trees[key] = cKDTree(np.concatenate(candidates)) if candidates else None
        tree = trees[key]
        points[row[name]] = np.nan if tree is None else tree.data[tree.query(points[row[name]])[1]]
    _put_folds_beyond_lids(pieces, points)
    return points


def _may_be_hair(known: Mapping[str, Float64], adult: Float64, scale: float) -> bool:
    """Whether the crown (11.4) is off the adult head's by no more than hair is thick."""
    row = point_rows()
    if "11.4" not in known:
        return False
    right, left = adult[[row["3.6"], row["3.5"]]]
    off = (known["11.4"] - (known["3.5"] + known["3.6"]) / 2) / scale - (
        adult[row["11.4"]] - (left + right) / 2
    )
    return bool(np.linalg.norm(off[1:]) < HAIR * (left[0] - right[0]))


def _put_folds_beyond_lids(pieces: Sequence[Piece], points: Float64) -> None:
    """Move the folds of lids, in place, that the warp put on the wrong side of the margin."""
    row = point_rows()
    apart = float(points[row["3.5"], 0] - points[row["3.6"], 0])
    skin = [piece.part.vertices.astype(np.float64) for piece in pieces if piece.part.kind == "skin"]
    vertices = np.concatenate(skin) if skin else np.zeros((0, 3))
    for fold, margin, way in (
        ("3.9", "3.3", -1),
        ("3.10", "3.4", -1),
        ("3.13", "3.1", 1),
        ("3.14", "3.2", 1),
    ):
        edge = points[row[margin]]
        if way * (points[row[fold], 1] - edge[1]) > 0 or not np.isfinite(edge).all():
            continue
        away = np.linalg.norm(vertices - edge - (0.0, way * FOLD_DISTANCE * apart, 0.0), axis=1)
        away[way * (vertices[:, 1] - edge[1]) < FOLD_DISTANCE / 2 * apart] = np.inf
        if np.isfinite(away).any():
            points[row[fold]] = vertices[int(away.argmin())]


def _outside(piece: Piece, centre: Float64) -> Float64:
    """Return (N, 3) vertices that face away from the head's centre: not those of sockets and throat."""
    vertices = piece.part.vertices.astype(np.float64)
    if piece.part.kind != "skin" or piece.part.normals is None:
        return vertices
    looks = np.einsum("ij,ij->i", vertices - centre, piece.part.normals)
    return vertices[looks > 0] if (looks > 0).any() else vertices
