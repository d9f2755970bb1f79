"""Several pieces of a mesh file as one part: geometry, shapes, colours and textures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fba.arrays import Float32
from fba.face.importers.assembly._atlas import make_atlas
from fba.face.importers.assembly.polygon_parts import Piece
from fba.face.model import Material, Part


def join_pieces(pieces: Sequence[Piece], name: str, kind: str) -> Piece:
    """Several pieces as one part, which looks as they do.

    Where textures differ, they become one; colours that differ become those of the vertices. Roughness,
    opacity and the like are those of the largest piece.
    """
    if len(pieces) == 1:
        return replace(pieces[0], part=replace(pieces[0].part, name=name, kind=kind))
    parts = [piece.part for piece in pieces]
    main = max(parts, key=lambda part: len(part.vertices))
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    same_colour = all(part.colours is None and part.material.colour == main.material.colour for part in parts)
    material, texcoords = _join_textures(parts, main)
    joined = Part(
        name,
        kind,
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.triangles + start for part, start in zip(parts, starts[:-1], strict=True)]),
        np.concatenate([part.normals for part in parts if part.normals is not None]),
        texcoords,
        None if same_colour else np.concatenate([_colours(part) for part in parts]),
        material if same_colour else replace(material, colour=(1.0, 1.0, 1.0)),
    )
    origins = [
        piece.origin if len(piece.origin) else np.full(len(piece.part.vertices), -1, dtype=np.int32)
        for piece in pieces
    ]
    morphs = {
        shape: np.concatenate(
            [piece.morphs.get(shape, np.zeros_like(piece.part.vertices)) for piece in pieces]
        )
        for shape in sorted({shape for piece in pieces for shape in piece.morphs})
    }
    return Piece(joined, pieces[0].material, np.concatenate(origins), morphs)


def _join_textures(parts: Sequence[Part], main: Part) -> tuple[Material, Float32 | None]:
    """(material of the joined part, its texture coordinates (V, 2) or None).

    Where the textures cannot become one, that of the main part stays, and others are as their colours.
    """
    if all(part.material.texture is None or part.texcoords is None for part in parts):
        return replace(main.material, texture=None), None
    if len({part.material.texture for part in parts}) > 1 and (atlas := make_atlas(parts)) is not None:
        return replace(main.material, texture=atlas.texture), np.concatenate(atlas.texcoords)
    if main.texcoords is None:
        return replace(main.material, texture=None), None
    return main.material, np.concatenate([_own_texcoords(part, main) for part in parts])


def _own_texcoords(part: Part, main: Part) -> Float32:
    """(V, 2) texture coordinates of a part, 0 where it has another texture than the main part."""
    if part.texcoords is None or part.material.texture != main.material.texture:
        return np.zeros((len(part.vertices), 2), np.float32)
    return part.texcoords


def _colours(part: Part) -> Float32:
    """(V, 4) colours of a part's vertices, without any of their own those of its material."""
    if part.colours is not None:
        return part.colours
    return np.tile(
        np.array([*part.material.colour, 1.0 - part.material.roughness], np.float32), (len(part.vertices), 1)
    )
