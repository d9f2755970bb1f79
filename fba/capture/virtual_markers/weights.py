"""`MarkerWeights`: how far each vertex of a head moves with each virtual marker."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fba.arrays import Float64
from fba.capture.virtual_markers._heads import MarkedHead
from fba.capture.virtual_markers.influence import Influence, give_to_nearest
from fba.capture.virtual_markers.lids import find_rows
from fba.capture.virtual_markers.mapping import MarkerMapping, VirtualMarker

MIN_SINGULAR_VALUE = 0.05
"""Smallest singular value of the overlap of markers, relative to the largest, that the solution of `match`
uses: smaller ones belong to markers that their overlap hardly tells apart."""


@dataclass(frozen=True, eq=False)
class MarkerWeights:
    """The weights of K virtual markers.

    names: of the markers. influences: of each, as vertices of the head's skin. shares: sparse float64 (N, K),
    of each marker's displacement in that of each vertex of the head. solve: float64 (K, K); vertices move by
    `shares @ (solve @ displacements)`.
    """

    names: tuple[str, ...]
    influences: tuple[Influence, ...]
    shares: Any
    solve: Float64

    def moved(self, displacements: Float64) -> Float64:
        """Return how far each vertex moves, float64 (N, 3), for displacements of the markers (K, 3)."""
        result: Float64 = self.shares @ (self.solve @ displacements)
        return result


def find_influences(head: MarkedHead, markers: Iterable[VirtualMarker]) -> list[Influence]:
    """Return the influence of each virtual marker with a vertex, as vertices of the head's skin.

    Errors as of `WalkedMesh.walk` and `find_rows`.
    """
    listed = list(markers)
    number = head.skin.number
    walked = head.walked.walk([(int(number[each.vertex or 0]), each.radius, each.depth) for each in listed])
    return [
        find_rows(head, each.vertex or 0, each.radius) if each.lid else influence
        for each, influence in zip(listed, walked, strict=True)
    ]


def find_weights(head: MarkedHead, mapping: MarkerMapping) -> MarkerWeights:
    """Return the weights of all virtual markers that have a vertex, in their order.

    Parts that are not skin follow it, see `find_followers`. Errors as of `find_influences`.
    """
    from scipy.sparse import csr_array

    markers = mapping.centres
    names = tuple(markers)
    number = head.skin.number
    influences = find_influences(head, markers.values())
    if mapping.assignment == "exclusive":
        influences = give_to_nearest(influences)
    rows = np.concatenate([np.zeros(0, np.intp), *(each.vertices for each in influences)])
    columns = np.repeat(np.arange(len(names)), [len(each.vertices) for each in influences])
    values = np.concatenate([np.zeros(0), *(each.shares for each in influences)])
    on_skin = csr_array((values, (rows, columns)), shape=(len(head.skin), len(names)))
    solve = np.eye(len(names))
    if mapping.overlap == "match" and names:
        overlap = on_skin[number[[each.vertex or 0 for each in markers.values()]]].toarray()
        solve = np.linalg.pinv(overlap, rcond=MIN_SINGULAR_VALUE)
    return MarkerWeights(names, tuple(influences), (head.followers @ on_skin).tocsr(), solve)
