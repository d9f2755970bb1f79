"""Vertices beside the skin that go with it: brows, lashes, and what is inside the mouth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from fba.arrays import Float64, Intp
from fba.face.authoring.surface.attached_parts import attach
from fba.face.authoring.surface.surface import Surface
from fba.face.deform.deformer import Deformer
from fba.face.model import FaceModel, Part, point_row
from fba.parameters import FAP_COUNT

ON_SKIN = ("brow", "lash")
"""Kinds of parts that go with the skin that they are on."""
IN_MOUTH = ("teeth", "tongue")
"""Kinds of parts that go with the chin, as far as the jaw's FAP moves them."""
OPEN_JAW, OPENED = 3, 300
"""The jaw's FAP, and a value of it."""
CHINS = ("2.1", "2.10")
NEAR, SMALL = 0.006, 0.08
"""Metres from the skin, with all vertices, and metres across, up to which a piece goes with it."""

Followed = tuple[Intp, Intp, Float64]
"""Vertices of the head, vertices of the skin that they go with, and how far."""


def find_followers(
    parts: Sequence[Part], rows: Sequence[Intp], skin: Surface, metres: float, model: FaceModel | None
) -> Any:
    """Return how far each vertex of a head goes with each vertex of its skin: sparse float64 (N, S).

    parts, rows, metres, model: as of `MarkedHead`. skin: whose `number` has N vertices. A vertex of the skin
    goes with itself. Of a face model, brows and lashes go with the skin around their roots, teeth and tongue
    with the chin as far as FAP 3 moves them. Of another head, small pieces close to the skin go with it.
    """
    from scipy.sparse import csr_array

    if model is None:
        found = _small_pieces(skin, metres)
    else:
        found = []
        opened = _open_jaw(model)
        for part, own in zip(parts, rows, strict=True):
            if part.kind in ON_SKIN and len(part.triangles):
                found.append(_attached(skin, part, own))
            elif part.kind in IN_MOUTH:
                found += _with_jaw(model, skin, part, own, opened)
    alone = np.ones(len(skin.number), dtype=bool)
    for each, _, _ in found:
        alone[each] = False
    themselves = np.flatnonzero(alone)
    every = np.concatenate([themselves, *(each for each, _, _ in found)])
    goes_with = np.concatenate([skin.number[themselves], *(each for _, each, _ in found)])
    values = np.concatenate([np.ones(len(themselves)), *(each for _, _, each in found)])
    return csr_array((values, (every, goes_with)), shape=(len(skin.number), len(skin)))


def _attached(skin: Surface, part: Part, rows: Intp) -> Followed:
    anchors = attach(skin, part)
    corners = skin.triangles[anchors.triangles]
    return np.repeat(rows, 3), corners.ravel(), anchors.shares.ravel()


def _with_jaw(model: FaceModel, skin: Surface, part: Part, rows: Intp, opened: Float64) -> list[Followed]:
    """Return that a part goes with the chin, as far as the jaw moves it; nothing if it does not.

    opened: float64 (N, 3), how far each vertex moves when the jaw opens.
    """
    chin = next((int(model.bound[point_row(name)]) for name in CHINS), -1)
    whole = float(np.linalg.norm(opened[chin])) if chin >= 0 else 0.0
    if not whole > 0:
        return []
    share = np.minimum(np.linalg.norm(opened[rows], axis=1) / whole, 1.0)
    moved = np.flatnonzero(share)
    return [(rows[moved], np.full(len(moved), skin.number[chin]), share[moved])]


def _open_jaw(model: FaceModel) -> Float64:
    """Return how far each vertex moves when the jaw opens: float64 (N, 3), metres."""
    faps = np.zeros(FAP_COUNT, dtype=np.float32)
    deformer = Deformer(model)
    rest = deformer.local(faps).astype(np.float64)
    faps[OPEN_JAW - 1] = OPENED
    return np.asarray(deformer.local(faps) - rest)


def _small_pieces(skin: Surface, metres: float) -> list[Followed]:
    """Return that connected pieces go with the largest one, if they are small and lie on it."""
    from scipy.spatial import cKDTree

    used = np.unique(skin.triangles)
    sizes = np.bincount(skin.component[used])
    if (sizes > 0).sum() < 2:
        return []
    largest = int(sizes.argmax())
    main = used[skin.component[used] == largest]
    others = used[skin.component[used] != largest]
    away, nearest = cKDTree(skin.vertices[main]).query(skin.vertices[others])
    piece = skin.component[others]
    farthest = np.zeros(len(sizes))
    np.maximum.at(farthest, piece, away)
    low, high = np.full((len(sizes), 3), np.inf), np.full((len(sizes), 3), -np.inf)
    np.minimum.at(low, piece, skin.vertices[others])
    np.maximum.at(high, piece, skin.vertices[others])
    lies = (farthest * metres < NEAR) & ((high - low).max(axis=1) * metres < SMALL)
    goes_with = np.full(len(skin), -1)
    goes_with[others[lies[piece]]] = main[nearest[lies[piece]]]
    vertices = np.flatnonzero(goes_with[skin.number] >= 0)
    return [(vertices, goes_with[skin.number[vertices]], np.ones(len(vertices)))]
