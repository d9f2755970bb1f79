"""Virtual markers that go with captured ones where no marker can be: inner lips, and the ends of lids."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from fba.arrays import Float64, Intp
from fba.capture.virtual_markers.heads import MarkedHead
from fba.capture.virtual_markers.mapping import VirtualMarker
from fba.errors import ModelError
from fba.face.authoring.surface.landmarks import find_landmarks
from fba.face.feature_points import row_of

INNER_LIPS = {"2.2": "8.1", "2.3": "8.2", "2.6": "8.5", "2.7": "8.6", "2.8": "8.7", "2.9": "8.8"}
"""Points of the inner lips, and of the outer ones that they go with."""
LIP_RADIUS, LIP_DEPTH = 0.012, 0.004
"""Metres that these reach: any deeper, a walk goes through the mouth to the other lip."""
LIDS = {"3.1": "left upper lid", "3.2": "right upper lid", "3.3": "left lower lid", "3.4": "right lower lid"}
"""Contours through the middles of lids."""
ALONG = (0.4, 0.7)
"""Places along a lid, from its middle to either corner, that go with the middle."""


def find_companions(
    head: MarkedHead, vertices: Mapping[str, int], places: Mapping[str, str], names: Collection[str]
) -> dict[str, VirtualMarker]:
    """Return virtual markers that follow captured ones, by names of their own.

    vertices: of captured markers on the head. places: marker -> place on the face. names: of all captured
    markers. Inner lips go as far as the outer ones, unless captured markers are there. A lid goes
    less far towards its corners: as the margins of an open and of a shut lid are arcs, by 1 - f^2 at the
    share f of the way from its middle.
    """
    at = {place: name for name, place in places.items() if name in vertices}
    found = _inner_lips(head, at) if not set(INNER_LIPS) & set(places.values()) else {}
    found |= _lids(head, at, vertices)
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


def _lids(head: MarkedHead, at: Mapping[str, str], vertices: Mapping[str, int]) -> dict[str, VirtualMarker]:
    if not set(LIDS) & set(at):
        return {}
    try:
        landmarks = find_landmarks(head.skin, head.points * head.metres, head.bound)
    except ModelError:  # a face without units
        return {}
    one_of = np.zeros(len(head.skin), dtype=np.intp)
    one_of[head.skin.number] = np.arange(len(head.skin.number))
    found = {}
    for middle, contour in LIDS.items():
        if middle not in at:
            continue
        along = landmarks.contour(contour)
        start = np.flatnonzero(along == head.skin.number[vertices[at[middle]]])
        if not len(start):
            continue
        for number, half in enumerate((along[: int(start[0]) + 1][::-1], along[int(start[0]) :])):
            for step, (vertex, share, corner) in enumerate(_along(head.skin.vertices, half), 1):
                name = f"{at[middle]} {2 * number + step}"
                found[name] = VirtualMarker(
                    int(one_of[vertex]), round(corner, 6), round(corner, 6), follows=at[middle], share=share
                )
    return found


def _along(places: Float64, half: Intp) -> list[tuple[int, float, float]]:
    """Return (vertex, share, distance of the corner) at steps along half a lid, from its middle."""
    way = np.cumsum(np.linalg.norm(np.diff(places[half], axis=0), axis=1))
    if len(way) < len(ALONG) + 1 or not way[-1] > 0:
        return []
    shares = np.concatenate([[0.0], way / way[-1]])
    result = []
    for wanted in ALONG:
        nearest = int(np.abs(shares - wanted).argmin())
        corner = float(np.linalg.norm(places[half[nearest]] - places[half[-1]]))
        if 0 < nearest < len(half) - 1 and corner > 0:
            result.append((int(half[nearest]), round(float(1 - shares[nearest] ** 2), 4), corner))
    return result
