"""FDP files: the positions of the feature points of a face, as text or as the XML of Xface.

A text FDP file has a line `<group.index> x y z <mesh.vertex>` a point, as docs/formats.md says; an Xface
file names vertices of mesh files, and for each FAP the vertices around a point that follow it.
"""

from __future__ import annotations

import os
import warnings

import numpy as np

from fba.arrays import Float64
from fba.errors import FbaWarning, ModelError
from fba.face.feature_points import names, row_of
from fba.face.importers.points._fdp_data import Fdp, repair_sides_with_warning
from fba.face.importers.points.xface import read_xface, xface_points
from fba.text_files import parse_integer, parse_number, read_bytes, read_words


def read_fdp_points(path: str | os.PathLike[str]) -> Float64:
    """Return the feature points of an FDP file: float64 (84, 3), in the file's unit, NaN for those not in it.

    A point on the wrong side of the face, or eye corners that are swapped, are corrected with an
    FbaWarning. An Xface file names vertices of mesh files; the points are looked up there. Raises
    ModelError where the file is damaged or its mesh files are missing.
    """
    fdp = read_fdp(path)
    if fdp.format == "xface":
        return xface_points(fdp)
    return fdp.points


def read_fdp(path: str | os.PathLike[str]) -> Fdp:
    """Return the content of an FDP file, points repaired as by `read_fdp_points`. ModelError for damage."""
    name = os.fspath(path)
    if read_bytes(name)[:4096].lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"<"):
        return read_xface(name)
    return _load_text(name)


def _load_text(path: str) -> Fdp:
    points = np.full((len(names()), 3), np.nan)
    vertices: dict[str, tuple[str, int]] = {}
    unknown: list[str] = []
    header = False
    for where, tokens in read_words(path):
        if not header:
            if len(tokens) < 2 or not tokens[0].startswith("1."):
                raise ModelError(
                    f"{where}: an FDP file begins with '1.0 NAME', not {' '.join(tokens)[:40]!r}"
                )
            header = True
        elif tokens[0] in ("NUL", "NLL"):
            continue  # the number of points of the inner lips, for another player
        elif len(tokens) not in (4, 5):
            raise ModelError(
                f"{where}: a feature point is 'GROUP.INDEX x y z MESH.VERTEX', not {' '.join(tokens)[:60]!r}"
            )
        elif tokens[0] not in row_of():
            unknown.append(tokens[0])
        else:
            point = tokens[0]
            if np.isfinite(points[row_of()[point]]).any():
                raise ModelError(f"{where}: feature point {point} is listed twice")
            points[row_of()[point]] = [parse_number(token, where, "a coordinate") for token in tokens[1:4]]
            if len(tokens) == 5:
                mesh, _, vertex = tokens[4].partition(".")
                index = parse_integer(vertex, where, "the vertex in MESH.VERTEX")
                if index >= 0:
                    vertices[point] = (mesh, index)
    if not np.isfinite(points).any():
        raise ModelError(f"{path}: contains no feature points")
    if unknown:
        warnings.warn(
            f"{path}: left out {', '.join(unknown[:5])}: the standard has no such feature point",
            FbaWarning,
            stacklevel=4,
        )
    return Fdp(path, "text", repair_sides_with_warning(points, path, stacklevel=4), vertices)
