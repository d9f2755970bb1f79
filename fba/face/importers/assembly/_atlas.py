"""One picture of the textures of several parts, so that parts that are joined keep their looks."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Float32, Float64, UInt8
from fba.face.model import Part
from fba.mesh.pictures import read_pixels

LARGEST = 4096
"""Pixels, each way, of the largest picture that is made."""
MARGIN = 8
"""Pixels around each tile that repeat its edge, so that smaller versions of the picture do not mix tiles."""
REPEATS = 4.0
"""Most often that a texture may be repeated over a surface; more would leave too few pixels to each."""
PLAIN = 4
"""Pixels, each way, of the white tile of parts without a texture."""
QUALITY = 92


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
    """One texture with what each part shows of its own, side by side; None where one cannot be made.

    Textures repeat, as glTF's do by default. Parts without a texture get a white spot. It cannot be made of
    pictures that are damaged or too large, nor of textures that repeat more than `REPEATS` times.
    """
    textures = list(dict.fromkeys(part.material.texture for part in parts))
    most = LARGEST // len(textures) - 2 * (MARGIN + 1)
    tiles: list[_Tile] = []
    for texture in textures:
        own = [part.texcoords for part in parts if part.material.texture == texture]
        coords = [each for each in own if each is not None and len(each)]
        tile = _plain_tile() if texture is None else _tile(texture, coords, most)
        if tile is None:
            return None
        tiles.append(tile)
    wide = sum(tile.pixels.shape[1] + 2 * MARGIN for tile in tiles)
    tall = max(tile.pixels.shape[0] + 2 * MARGIN for tile in tiles)
    picture = np.full((tall, wide, 4), 255, dtype=np.uint8)
    starts = []
    left = 0
    for tile in tiles:
        padded = np.pad(tile.pixels, ((MARGIN, MARGIN), (MARGIN, MARGIN), (0, 0)), mode="edge")
        picture[: padded.shape[0], left : left + padded.shape[1]] = padded
        starts.append(left + MARGIN)
        left += padded.shape[1]
    texcoords = []
    for part in parts:
        index = textures.index(part.material.texture)
        tile, corner = tiles[index], np.array([starts[index], MARGIN])
        shown = np.array(tile.pixels.shape[1::-1])
        if part.texcoords is None or part.material.texture is None:
            within = np.full((len(part.vertices), 2), 0.5)
        else:
            within = (part.texcoords - tile.low) / tile.size
        texcoords.append(((corner + within * shown) / (wide, tall)).astype(np.float32))
    return Atlas(_encode(picture), tuple(texcoords))


def _plain_tile() -> _Tile:
    """A white tile."""
    return _Tile(np.zeros(2), np.ones(2), np.full((PLAIN, PLAIN, 4), 255, dtype=np.uint8))


def _tile(texture: bytes, texcoords: Sequence[Float32], most: int) -> _Tile | None:
    """What texture coordinates, arrays (V, 2), show of a texture, at most `size` pixels each way.

    None where that cannot be cut out.
    """
    if not texcoords or most < PLAIN:
        return None
    low = np.min([each.min(axis=0) for each in texcoords], axis=0).astype(np.float64)
    high = np.max([each.max(axis=0) for each in texcoords], axis=0).astype(np.float64)
    pixels = read_pixels(texture, most / max(float((high - low).max()), 1e-3))
    if pixels is None or ((high - low) > REPEATS).any():
        return None
    height, width = pixels.shape[:2]
    scale = np.array([width, height])
    first = np.floor(low * scale).astype(np.int64)
    last = np.maximum(np.ceil(high * scale).astype(np.int64), first + 1)
    rows, columns = np.arange(first[1], last[1]) % height, np.arange(first[0], last[0]) % width
    return _Tile(first / scale, (last - first) / scale, pixels[rows[:, None], columns])


def _encode(pixels: UInt8) -> bytes:
    """A picture as JPEG, or as PNG where it is not opaque."""
    from PIL import Image

    stream = io.BytesIO()
    image = Image.fromarray(pixels)
    if (pixels[..., 3] == 255).all():
        image.convert("RGB").save(stream, "JPEG", quality=QUALITY, subsampling=0)
    else:
        image.save(stream, "PNG", compress_level=3)
    return stream.getvalue()
