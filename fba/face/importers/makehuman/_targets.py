"""MakeHuman's targets: displacements of the base mesh, applied to the parts of a head."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from fba.arrays import Float32, Float64
from fba.errors import ModelError
from fba.face.importers.makehuman.makehuman import EYES, METRES, MakeHumanHead, eye_pieces
from fba.mesh.text_files import parse_integer, parse_number, read_words

FOLDERS = ("expression-units", "targets/expression/units/caucasian", "../targets/expression/units/caucasian")
"""Folders of MakeHuman's expression units, relative to the base mesh."""


def read_target(path: str | os.PathLike[str], vertices: int) -> Float64:
    """Displacements float64 (vertices, 3) of a .target file, in units of the base mesh.

    Lines are a vertex and three numbers. Raises ModelError naming the line.
    """
    moved = np.zeros((vertices, 3))
    seen = 0
    for where, tokens in read_words(path):
        if len(tokens) != 4:
            raise ModelError(
                f"{where}: a vertex and three numbers are expected, not {' '.join(tokens)[:60]!r}"
            )
        vertex = parse_integer(tokens[0], where, "a vertex")
        if not 0 <= vertex < vertices:
            raise ModelError(f"{where}: vertex {vertex} does not exist; the base mesh has {vertices}")
        moved[vertex] = [parse_number(token, where, "a coordinate") for token in tokens[1:]]
        seen += 1
    if not seen:
        raise ModelError(f"{os.fspath(path)}: moves no vertex")
    return moved


def target_files(folder: str | os.PathLike[str]) -> dict[str, Path]:
    """Files of the expression units beside a base mesh, by name."""
    for name in FOLDERS:
        if (Path(folder) / name).is_dir():
            return {file.stem: file for file in sorted((Path(folder) / name).glob("*.target"))}
    return {}


def shape_of(head: MakeHumanHead, moved: Float64) -> Mapping[str, Float32]:
    """Displacements of the parts of a head, metres, by part, for displacements (V, 3) of the base mesh.

    Eyes that are fitted to the base mesh follow it. Parts that do not move are left out.
    """
    moves: dict[str, Float32] = {}
    eyes = None
    for piece in head.pieces:
        if len(piece.origin) and piece.origin[0] < 0:
            if eyes is None:
                before = eye_pieces(head.folder / EYES, head.base.vertices)
                after = eye_pieces(head.folder / EYES, head.base.vertices + moved)
                eyes = {
                    a.part.name: (b.part.vertices - a.part.vertices)
                    for a, b in zip(before, after, strict=True)
                }
            shift = eyes[piece.part.name]
        else:
            shift = (moved[piece.origin] * METRES).astype(np.float32)
        if np.abs(shift).max() > 1e-7:
            moves[piece.part.name] = shift
    return moves


def expression_shapes(head: MakeHumanHead) -> dict[str, Mapping[str, Float32]]:
    """All expression units that lie beside the base mesh, as shapes of the head."""
    count = len(head.base.vertices)
    files = target_files(head.folder)
    return {name: shape_of(head, read_target(file, count)) for name, file in files.items()}
