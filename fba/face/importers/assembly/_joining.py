"""Several pieces of a mesh file as one part: geometry, shapes, colours and textures.

One picture holds the textures of all, so that they keep their looks.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Float32, Float64, UInt8
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.model import Material, Part
from fba.mesh import read_pixels

MAX_PIXELS = 4096
"""Pixels, each way, of the largest picture that is made."""
TILE_MARGIN = 8
"""Pixels around each tile that repeat its edge, so that smaller versions of the picture do not mix tiles."""
MAX_REPEATS = 4.0
"""Times that a texture may be repeated over a surface; more would leave too few pixels to each."""
PLAIN_PIXELS = 4
"""Pixels, each way, of the white tile of parts without a texture."""
JPEG_QUALITY = 92


def join_pieces(pieces: Sequence[Piece], name: str, kind: str) -> Piece:
    """Return several pieces as one part, which looks as they do.

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
    """Return the material of the joined part, and its texture coordinates (V, 2) or None.

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
    """Return texture coordinates (V, 2) of a part, 0 where it has another texture than the main part."""
    if part.texcoords is None or part.material.texture != main.material.texture:
        return np.zeros((len(part.vertices), 2), np.float32)
    return part.texcoords


def _colours(part: Part) -> Float32:
    """Return colours (V, 4) of a part's vertices; those of its material where the vertices have none."""
    if part.colours is not None:
        return part.colours
    return np.tile(
        np.array([*part.material.colour, 1.0 - part.material.roughness], np.float32), (len(part.vertices), 1)
    )


@dataclass(frozen=True)
class Atlas:
    """One texture for several parts. texture: PNG or JPEG; texcoords: float32 (V, 2) of each part in it."""

    texture: bytes
    texcoords: tuple[Float32, ...]


@dataclass(frozen=True)
class _Tile:
    """What some parts show of one texture: its corner and size, in texture coordinates, and its pixels."""

    low: Float64
    size: Float64
    pixels: UInt8


def make_atlas(parts: Sequence[Part]) -> Atlas | None:
    """Return a texture of what each part shows of its own, side by side; None where there cannot be one.

    Textures repeat, as glTF's do by default. Parts without a texture get a white spot. It cannot be made of
    pictures that are damaged or too large, nor of textures that repeat more than `MAX_REPEATS` times.
    """
    textures = list(dict.fromkeys(part.material.texture for part in parts))
    most = MAX_PIXELS // len(textures) - 2 * (TILE_MARGIN + 1)
    tiles: list[_Tile] = []
    for texture in textures:
        own = [part.texcoords for part in parts if part.material.texture == texture]
        coords = [each for each in own if each is not None and len(each)]
        white = np.full((PLAIN_PIXELS, PLAIN_PIXELS, 4), 255, dtype=np.uint8)
        plain = _Tile(np.zeros(2), np.ones(2), white)
        tile = plain if texture is None else _tile(texture, coords, most)
        if tile is None:
            return None
        tiles.append(tile)
    wide = sum(tile.pixels.shape[1] + 2 * TILE_MARGIN for tile in tiles)
    tall = max(tile.pixels.shape[0] + 2 * TILE_MARGIN for tile in tiles)
    picture = np.full((tall, wide, 4), 255, dtype=np.uint8)
    starts = []
    left = 0
    for tile in tiles:
        padded = np.pad(
            tile.pixels, ((TILE_MARGIN, TILE_MARGIN), (TILE_MARGIN, TILE_MARGIN), (0, 0)), mode="edge"
        )
        picture[: padded.shape[0], left : left + padded.shape[1]] = padded
        starts.append(left + TILE_MARGIN)
        left += padded.shape[1]
    texcoords = []
    for part in parts:
        index = textures.index(part.material.texture)
        tile, corner = tiles[index], np.array([starts[index], TILE_MARGIN])
        shown = np.array(tile.pixels.shape[1::-1])
        if part.texcoords is None or part.material.texture is None:
            within = np.full((len(part.vertices), 2), 0.5)
        else:
            within = (part.texcoords - tile.low) / tile.size
        texcoords.append(((corner + within * shown) / (wide, tall)).astype(np.float32))
    return Atlas(_encode(picture), tuple(texcoords))


def _tile(texture: bytes, texcoords: Sequence[Float32], most: int) -> _Tile | None:
    """Return what texture coordinates show of a texture, at most `most` pixels wide and high, or None."""
    if not texcoords or most < PLAIN_PIXELS:
        return None
    low = np.min([each.min(axis=0) for each in texcoords], axis=0).astype(np.float64)
    high = np.max([each.max(axis=0) for each in texcoords], axis=0).astype(np.float64)
    pixels = read_pixels(texture, most / max(float((high - low).max()), 1e-3))
    if pixels is None or ((high - low) > MAX_REPEATS).any():
        return None
    height, width = pixels.shape[:2]
    scale = np.array([width, height])
    first = np.floor(low * scale).astype(np.int64)
    last = np.maximum(np.ceil(high * scale).astype(np.int64), first + 1)
    rows, columns = np.arange(first[1], last[1]) % height, np.arange(first[0], last[0]) % width
    return _Tile(first / scale, (last - first) / scale, pixels[rows[:, None], columns])


def _encode(pixels: UInt8) -> bytes:
    """Return a picture as JPEG, or as PNG where it is not opaque."""
    from PIL import Image

    stream = io.BytesIO()
    image = Image.fromarray(pixels)
    if (pixels[..., 3] == 255).all():
        image.convert("RGB").save(stream, "JPEG", quality=JPEG_QUALITY, subsampling=0)
    else:
        image.save(stream, "PNG", compress_level=3)
    return stream.getvalue()
