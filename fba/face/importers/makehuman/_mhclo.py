"""MakeHuman clothes (.mhclo): a mesh whose vertices are attached to triangles of the base mesh."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from fba.arrays import Float64
from fba.errors import ModelError
from fba.mesh.obj import read_obj
from fba.mesh.polygons import Polygons
from fba.mesh.text_files import find_beside, parse_integer, parse_number, read_words


def fit_clothes(path: Path, base: Float64) -> Polygons:
    """The mesh of an .mhclo file, placed on a base mesh (V, 3), in the base mesh's units.

    Each line after `verts` is either one vertex of the base, or three vertices, their weights and an
    offset; offsets are scaled by distances on the base mesh (`x_scale a b d`: |a - b| / d along x, and
    so on). Raises ModelError where the file or its OBJ file is missing or damaged.
    """
    scale = np.ones(3)
    mesh = None
    rows: list[Float64] = []
    reading = False
    for where, tokens in read_words(path):
        if tokens[0] == "obj_file" and len(tokens) > 1:
            mesh = find_beside(path, tokens[1])
        elif tokens[0] in ("x_scale", "y_scale", "z_scale") and len(tokens) == 4:
            axis = "xyz".index(tokens[0][0])
            ends = [_vertex(token, base, where) for token in tokens[1:3]]
            rest = parse_number(tokens[3], where, "a distance")
            if rest <= 0:
                raise ModelError(f"{where}: the distance of {tokens[0]} must be positive, not {tokens[3]}")
            scale[axis] = abs(base[ends[0], axis] - base[ends[1], axis]) / rest
        elif tokens[0] == "verts":
            reading = True
        elif reading and tokens[0][0].isdigit():
            rows.append(_position(tokens, base, scale, where))
        else:
            reading = False
    if mesh is None:
        raise ModelError(f"{path}: the mesh that its line 'obj_file' names is not in its folder")
    polygons = read_obj(mesh)
    if len(rows) != len(polygons.vertices):
        raise ModelError(
            f"{path}: gives positions for {len(rows)} vertices, but {mesh.name} has {len(polygons.vertices)}"
        )
    return replace(polygons, vertices=np.array(rows, dtype=np.float64))


def _vertex(token: str, base: Float64, where: str) -> int:
    index = parse_integer(token, where, "a vertex of the base mesh")
    if not 0 <= index < len(base):
        raise ModelError(f"{where}: vertex {index} of the base mesh does not exist; it has {len(base)}")
    return index


def _position(tokens: list[str], base: Float64, scale: Float64, where: str) -> Float64:
    """(3,) position of the vertex of one line."""
    if len(tokens) == 1:
        return np.asarray(base[_vertex(tokens[0], base, where)])
    if len(tokens) < 6:
        raise ModelError(f"{where}: one vertex, or three and their weights, are needed, not {len(tokens)}")
    corners = [_vertex(token, base, where) for token in tokens[:3]]
    weights = [parse_number(token, where, "a weight") for token in tokens[3:6]]
    offset = [parse_number(token, where, "an offset") for token in tokens[6:9]] or [0.0, 0.0, 0.0]
    if len(offset) != 3:
        raise ModelError(f"{where}: an offset has three numbers, not {len(offset)}")
    return np.asarray(weights @ base[corners] + np.array(offset) * scale, dtype=np.float64)
