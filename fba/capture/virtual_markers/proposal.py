"""`propose_mapping`: a first mapping, by places of the markers, laid onto feature points of the head."""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from fba.arrays import Float64
from fba.capture.markers._motion import MarkerMotion
from fba.capture.markers._targets import LIDS, RIGID, SKULL, target_points
from fba.capture.markers.marker_maps import find_map
from fba.capture.virtual_markers._heads import MarkedHead
from fba.capture.virtual_markers.lids import lid_at, lid_height
from fba.capture.virtual_markers.mapping import MarkerMapping, VirtualMarker
from fba.errors import ModelError
from fba.geometry import FittedSimilarity, fit_similarity, principal_axes
from fba.parameters import point_rows

MIN_POINTS = 3
"""Smallest number of points that define an alignment."""
MIN_SPREAD = 0.02
"""Smallest sideways spread of points, as a share of their length."""
MAX_MIRROR_RATIO = 0.5
"""Largest ratio of the error of the mirror image to that of the points if these are mirrored."""
MIN_MIRROR_ERROR = 0.05
"""Smallest error of mirrored points, as a share of their size: flat sets of markers do not show it."""


def lay_onto(points: Float64, places: Float64) -> FittedSimilarity:
    """Return the similarity that lays points (K, 3) onto places (K, 3), by least squares.

    The determinant of its rotation is -1 if the points are mirrored. ModelError for fewer than three points,
    or points on one line.
    """
    if len(points) < MIN_POINTS:
        raise ModelError(
            f"{len(points)} markers with a vertex cannot be laid onto a head: "
            f"{MIN_POINTS} at least are needed"
        )
    for what, cloud in (("markers", points), ("vertices of the virtual markers", places)):
        _, spread = principal_axes(cloud)
        if not spread[1] > MIN_SPREAD * spread[0]:
            raise ModelError(f"the {what} are all on one line, or in one place")
    plain, mirrored = (fit_similarity(points, places, reflected=reflected) for reflected in (False, True))
    size = float(np.sqrt(((places - places.mean(axis=0)) ** 2).sum(axis=1).mean()))
    is_mirrored = mirrored.error < MAX_MIRROR_RATIO * plain.error and plain.error > MIN_MIRROR_ERROR * size
    return mirrored if is_mirrored else plain


MIN_PLACES = 6
"""Smallest number of markers at places that the head has. They show where the other markers are."""
MAX_POINT_DISTANCE = 0.015
"""Largest distance of a vertex from its feature point, in metres: a mask has no ears."""
MAX_SKIN_DISTANCE = 0.03
"""Largest distance from the skin, in metres, of a marker without a place that gets a vertex."""
NEIGHBOURS = 3
"""Number of nearest markers that a virtual marker reaches."""
REACH = 1.2
"""Ratio of the radius to the distance of the farthest of these neighbours."""
RADIUS_RANGE = (0.010, 0.045)
"""Smallest and largest proposed radius, metres on a head of natural size."""
FIRST_RADIUS = 0.03
"""Radius of the first virtual marker, metres on a head of natural size."""
EYE_CORNERS = ("3.7", "3.11", "3.12", "3.8")
LID_REACH = 0.8
"""Radius of a lid, as a share of the distance to the nearer corner of the eye: a walk that reaches the corner
goes on to the other lid."""
INNER_LIPS = {"2.2": "8.1", "2.3": "8.2", "2.6": "8.5", "2.7": "8.6", "2.8": "8.7", "2.9": "8.8"}
"""Feature points of the inner lips, and those of the outer lips that they follow."""
LIP_RADIUS = 0.012
"""Radius of virtual markers on inner lips, in metres."""
LIP_DEPTH = 0.004
"""Depth of virtual markers on inner lips, in metres: a deeper walk would reach the other lip."""


def propose_mapping(
    motion: MarkerMotion, head: MarkedHead, places: Mapping[str, str] | None = None
) -> MarkerMapping:
    """Return virtual markers for a capture and a head.

    places: marker -> place on the face, as of `fba.capture.from_markers`; None to find them by names, or by
    the cloud's shape. A marker at a feature point of the head gets its vertex; a marker that the face does
    not move is fixed. Others are laid onto the nearest skin between them, and virtual markers on inner lips
    follow captured markers. The radius reaches just beyond the third nearest marker; lids move by their rows,
    see `lids.find_rows`.

    Raises ModelError where too few places are known.
    """
    places = find_map(motion)[0] if places is None else dict(places)
    targets = _known_targets(head)
    at = {name: targets[place] for name, place in places.items() if place in targets}
    if len(at) < MIN_PLACES:
        raise ModelError(
            f"no mapping can be proposed: of {len(places)} markers with a place on the face, {head.name} has "
            f"the feature points of {len(at)}, and {MIN_PLACES} are needed. Choose vertices by hand, or give "
            "the head's feature points"
        )
    rows = point_rows()
    vertices: dict[str, int] = {}
    for name, place in at.items():
        bound = int(head.bound[rows[places[name]]]) if places[name] in rows else -1
        vertex, away = (bound, 0.0) if bound >= 0 and _on_skin(head, bound) else head.nearest(place)
        if vertex not in vertices.values() and away < MAX_POINT_DISTANCE / head.metres:
            vertices[name] = vertex
    fixed = {name for name, place in places.items() if place in RIGID}
    others = [name for name in motion.names if name not in vertices and name not in fixed]
    others += [
        name
        for name in fixed
        if name not in vertices and places[name] not in targets and places[name] != SKULL
    ]
    vertices |= _lay_others(motion, head, vertices, others)
    radii = _radii(head, vertices, places)
    markers = {}
    for name in motion.names:
        if name in vertices:
            lid = lid_at(head, vertices[name]) if places.get(name) in LIDS else ""
            radius = round(lid_height(head, lid), 6) if lid else radii[name]
            markers[name] = VirtualMarker(vertices[name], radius, radius, name in fixed, lid=bool(lid))
    markers |= _find_companions(head, vertices, places, motion.names)
    # markers on a cap, or where this head has no skin, still show how the head moves
    markers |= {
        name: VirtualMarker(None, fixed=True) for name in motion.names if name in fixed - set(vertices)
    }
    return MarkerMapping(markers).for_head(head)


def _known_targets(head: MarkedHead) -> dict[str, Float64]:
    """Return the positions of those places of markers that a head has."""
    return {name: at for name, at in target_points(head.points).items() if np.isfinite(at).all()}


def _on_skin(head: MarkedHead, vertex: int) -> bool:
    return bool(np.isin(vertex, head.face))


def _lay_others(
    motion: MarkerMotion, head: MarkedHead, vertices: Mapping[str, int], others: list[str]
) -> dict[str, int]:
    """Return vertices for markers without a place, by their positions among those with a vertex."""
    from scipy.interpolate import RBFInterpolator

    frame = _fullest_frame(motion, list(vertices))
    cloud = dict(zip(motion.names, motion.positions[frame], strict=True))
    placed = [name for name in vertices if np.isfinite(cloud[name]).all()]
    others = [name for name in others if np.isfinite(cloud[name]).all()]
    if not others or len(placed) < MIN_PLACES:
        return {}
    there = head.vertices[[vertices[name] for name in placed]]
    points = np.array([cloud[name] for name in placed])
    fit = lay_onto(points, there)
    laid = fit.apply(points)
    field = RBFInterpolator(laid, there - laid, kernel="linear", degree=0)
    wanted = fit.apply(np.array([cloud[name] for name in others]))
    wanted = wanted + field(wanted)
    result: dict[str, int] = {}
    for name, place in zip(others, wanted, strict=True):
        vertex, away = head.nearest(place)
        if away < MAX_SKIN_DISTANCE / head.metres and vertex not in (*vertices.values(), *result.values()):
            result[name] = vertex
    return result


def _fullest_frame(motion: MarkerMotion, names: list[str]) -> int:
    """Return the first frame in which most of these markers are seen."""
    columns = [motion.names.index(name) for name in names]
    return int(motion.seen[:, columns].sum(axis=1).argmax())


def _radii(head: MarkedHead, vertices: Mapping[str, int], places: Mapping[str, str]) -> dict[str, float]:
    """Return a radius for each marker, in the head's unit."""
    from scipy.spatial import cKDTree

    names = list(vertices)
    at = head.vertices[list(vertices.values())]
    away = cKDTree(at).query(at, k=min(NEIGHBOURS + 1, len(names)))[0]
    low, high = (size / head.metres for size in RADIUS_RANGE)
    corners = head.points[[point_rows()[name] for name in EYE_CORNERS]]
    corners = corners[np.isfinite(corners).all(axis=1)]
    result = {}
    for name, place, usual in zip(names, at, np.clip(REACH * away[:, -1], low, high).tolist(), strict=True):
        most = high
        if places.get(name) in LIDS and len(corners):
            most = LID_REACH * float(np.linalg.norm(corners - place, axis=1).min())
        result[name] = round(min(usual, most), 6)
    return result


def usual_radius(mapping: MarkerMapping, head: MarkedHead) -> float:
    """Return the radius of a new virtual marker, in the head's unit: the median of all."""
    radii = [marker.radius for marker in mapping.centres.values()]
    return float(np.median(radii)) if radii else FIRST_RADIUS / head.metres


def _find_companions(
    head: MarkedHead, vertices: Mapping[str, int], places: Mapping[str, str], names: Collection[str]
) -> dict[str, VirtualMarker]:
    """Return virtual markers with new names that follow captured markers, where no marker can be.

    vertices: of captured markers on the head. places: marker -> place on the face. names: of all captured
    markers. Inner lips move as far as the outer lips, unless captured markers are there.
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
        vertex = int(head.bound[point_rows()[inner]])
        if outer in at and vertex >= 0 and np.isin(vertex, head.face):
            found[f"{at[outer]} inner"] = VirtualMarker(vertex, radius, depth, follows=at[outer])
    return found
