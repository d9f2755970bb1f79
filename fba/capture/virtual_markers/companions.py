"""Virtual markers that go with captured ones where no marker can be: inner lips."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from fba.capture.virtual_markers.heads import MarkedHead
from fba.capture.virtual_markers.mapping import VirtualMarker
from fba.face.feature_points import row_of

INNER_LIPS = {"2.2": "8.1", "2.3": "8.2", "2.6": "8.5", "2.7": "8.6", "2.8": "8.7", "2.9": "8.8"}
"""Points of the inner lips, and of the outer ones that they go with."""
LIP_RADIUS, LIP_DEPTH = 0.012, 0.004
"""Metres that these reach: any deeper, a walk goes through the mouth to the other lip."""


def find_companions(
    head: MarkedHead, vertices: Mapping[str, int], places: Mapping[str, str], names: Collection[str]
) -> dict[str, VirtualMarker]:
    """Return virtual markers that follow captured ones, by names of their own.

    vertices: of captured markers on the head. places: marker -> place on the face. names: of all captured
    markers. Inner lips go as far as the outer ones, unless captured markers are there.
    """
    at = {place: name for name, place in places.items() if name in vertices}
    found = _inner_lips(head, at) if not set(INNER_LIPS) & set(places.values()) else {}
    taken = set(vertices.values())
    result: dict[str, VirtualMarker] = {}
    for name, marker in found.items():
        if name not in names and marker.vertex not in taken:
            taken.add(marker.vertex or 0)
            result[name] = marker
    return result


def _inner_lips(head: MarkedHead, at: Mapping[str, str]) -> dict[str, VirtualMarker]:
    radius, depth = (round(size / head.metres, 6) for size in (LIP_RADIUS, LIP_DEPTH))
    found = {}
    for inner, outer in INNER_LIPS.items():
        vertex = int(head.bound[row_of()[inner]])
        if outer in at and vertex >= 0 and np.isin(vertex, head.face):
            found[f"{at[outer]} inner"] = VirtualMarker(vertex, radius, depth, follows=at[outer])
    return found
