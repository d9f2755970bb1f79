"""How far each vertex of a head goes with each virtual marker."""

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

LEAST_DIRECTION = 0.05
"""Combinations of markers that their overlapping reach hardly tells apart, relative to the clearest, are left
out of the solution for `match`."""


@dataclass(frozen=True, eq=False)
class MarkerWeights:
    """The weights of K virtual markers.

    names: of the markers. influences: what each moves, as vertices of the head's skin. shares: sparse float64
    (N, K), by how much of each marker's displacement each vertex of the head moves. solve: float64 (K, K);
    `shares @ (solve @ displacements)` is how far vertices move.
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
    """Return what virtual markers with a vertex move, each for itself, as vertices of the head's skin.

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

    What is not skin goes with it as `find_followers` says. Errors as of `find_influences`.
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
        solve = np.linalg.pinv(overlap, rcond=LEAST_DIRECTION)
    return MarkerWeights(names, tuple(influences), (head.followers @ on_skin).tocsr(), solve)
