"""What does not change in a face model that is shown: colours, pictures, and how far its neck bends."""

from __future__ import annotations

import io
import warnings
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from fba.errors import FbaWarning
from fba.face.model import FaceModel, Part, point_row
from player.shapes import FaceShape

Float32 = npt.NDArray[np.float32]
Float64 = npt.NDArray[np.float64]

SCATTER = {"skin": 1.0, "tongue": 0.8, "mouth": 0.8, "teeth": 0.5, "eye": 0.3}
TWO_SIDED = ("brow", "lash", "hair", "other", "teeth", "tongue")
HAIRY = ("lash", "brow", "hair")
THICKEST_HAIR = 0.0012
"""A strip wider than this (m) is no single hair."""
LARGEST_PICTURE = 4096
"""Textures of more pixels across are made smaller."""
ROUGH = 0.36
RELIEF = 0.022
"""Strength of the skin's relief, and metres until it repeats."""
NECK = 2.3
"""Length over which a neck bends, in distances from eyes to nose (ENS)."""


def sway(model: FaceModel) -> Float32:
    """(V,) how far each vertex goes with the head: 1 above jaw and ears, falling to 0 along the neck."""
    chin = known_middle(model, ("2.1", "2.10"))
    lobe = known_middle(model, ("10.7", "10.8", "10.5", "10.6", "7.1"))
    if chin is None or lobe is None:
        return np.ones(len(model.vertices), dtype=np.float32)
    reach = NECK * model.fapu.ENS * 1024
    y, z = model.vertices[:, 1].astype(np.float64), model.vertices[:, 2].astype(np.float64)
    # The border between head and neck rises from below the chin to below the ears, and stays level behind.
    along = np.clip((z - lobe[2]) / max(chin[2] - lobe[2], 1e-6), 0.0, 1.0)
    border = lobe[1] + (chin[1] - 0.12 * reach - lobe[1]) * along
    share = np.clip(1 - (border - y) / reach, 0.0, 1.0)
    smooth: Float32 = (share * share * (3 - 2 * share)).astype(np.float32)
    return smooth


def known_middle(model: FaceModel, names: Sequence[str]) -> Float64 | None:
    """Middle of the first two of those feature points that the face has, or None."""
    places = np.array([model.points[point_row(name)] for name in names])
    known = places[np.isfinite(places).all(axis=1)][:2]
    return np.asarray(known.mean(axis=0)) if len(known) else None


def part_shape(part: Part, sways: Float32) -> FaceShape:
    """What does not change in a part. sways (V,): how far its vertices would go with the head."""
    colours = part.colours
    if colours is None:
        row = (*part.material.colour, 1.0 - part.material.roughness)
        colours = np.tile(np.array(row, dtype=np.float32), (len(part.vertices), 1))
    picture = _picture(part) if part.texcoords is not None else None
    return FaceShape(
        part.triangles,
        colours,
        sways if part.kind in ("skin", "hair", "other") else np.ones_like(sways),
        part.texcoords,
        picture,
        SCATTER.get(part.kind, 0.0),
        _relief(part),
        part.kind in TWO_SIDED,
        hairs(part) if part.kind in HAIRY and picture is None else None,
        name=part.name,
        kind=part.kind,
    )


def hairs(part: Part) -> Float32 | None:
    """(V, 8) as `FaceShape.across` has it, or None where a part is not of single hairs.

    A hair is a strip of two rows of vertices that ends in a point: the vertex opposite to one is the
    nearest that an edge joins it to.
    """
    if not len(part.triangles):
        return None
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    vertices, count = part.vertices.astype(np.float64), len(part.vertices)
    edges = part.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).astype(np.intp)
    edges = np.concatenate([edges, edges[:, ::-1]])
    apart = vertices[edges[:, 0]] - vertices[edges[:, 1]]
    length = np.linalg.norm(apart, axis=1)
    order = np.lexsort((length, edges[:, 0]))
    rows, first = np.unique(edges[order, 0], return_index=True)
    nearest = order[first]
    opposite = np.arange(count)
    opposite[rows] = edges[nearest, 1]
    paired = (opposite[opposite] == np.arange(count)) & (opposite != np.arange(count))
    half = np.zeros(count)
    half[rows] = length[nearest] / 2
    if not paired.any() or 2 * float(np.median(half[paired])) > THICKEST_HAIR:
        return None
    pieces, hair = connected_components(csr_matrix((np.ones(len(edges)), edges.T), (count, count)))
    tip = np.full(pieces, -1)
    tip[hair[~paired]] = np.flatnonzero(~paired)  # a point is not opposite to what is nearest to it
    kept = paired & (tip[hair] >= 0)
    found = np.zeros((count, 8), dtype=np.float32)
    found[:, 7] = np.where(np.arange(count) < opposite, 1, -1)
    found[kept, :3] = _units(vertices[kept] - vertices[opposite[kept]])
    found[kept, 3] = half[kept]
    found[kept, 4:7] = _units(vertices[tip[hair[kept]]] - vertices[kept])
    return found


def _units(vectors: Float64) -> Float64:
    unit: Float64 = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
    return unit


def _relief(part: Part) -> tuple[float, float]:
    """Strength of the skin's relief and its repeats, so that a repeat is `RELIEF` metres wide."""
    if part.kind != "skin" or part.texcoords is None or not len(part.triangles):
        return (0.0, 1.0)
    corners, flat = part.vertices[part.triangles], part.texcoords[part.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    a, b = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    spread = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    laid = spread > 1e-9
    if not laid.any():
        return (0.0, 1.0)
    metres = float(np.sqrt(np.median(area[laid] / spread[laid])))  # across the whole picture
    return (ROUGH, min(metres / RELIEF, 200.0))


def _picture(part: Part) -> npt.NDArray[np.uint8] | None:
    """(H, W, 4) the part's texture, or None where there is none that can be read."""
    if part.material.texture is None:
        return None
    from PIL import Image

    try:
        with Image.open(io.BytesIO(part.material.texture), formats=("PNG", "JPEG")) as image:
            if max(image.size) > LARGEST_PICTURE:
                image.draft("RGB", (LARGEST_PICTURE, LARGEST_PICTURE))
                image.thumbnail((LARGEST_PICTURE, LARGEST_PICTURE))
            return np.asarray(image.convert("RGBA"))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        warnings.warn(
            f"the texture of part {part.name!r} cannot be read ({error}): its colour is shown instead",
            FbaWarning,
            stacklevel=2,
        )
        return None
