"""Lids, whose markers move rows of vertices instead of a cylinder, and eyes that look at somebody.

After sections 3.5.2 and 3.5.3 of the thesis that docs/virtual-markers.md names. Its lid is a separate mesh,
whose rows move by 1, 0.9 and 0.7 of the marker, and less towards the corners, as a Gaussian falls off. Here
rows are heights above the margin, so that they exist on lids of any mesh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fba.arrays import Float64, Intp
from fba.capture.markers._targets import LOWER_LIDS
from fba.capture.virtual_markers._heads import MarkedHead
from fba.capture.virtual_markers.influence import Influence
from fba.errors import ModelError
from fba.face.eyeball import LARGEST_GAZE
from fba.parameters import point_rows
from fba.rotations import axis_matrices

UPPER_ROWS = (1.0, 0.9, 0.7)
"""Shares of the marker's movement by which rows of an upper lid move, from the margin in equal steps to the
height of the lid, where nothing moves."""
LOWER_ROWS = (1.0, 0.9)
"""The same for a lower lid; the source says that both are alike, without numbers."""
LID_DEVIATION = 0.5
"""Standard deviation of the Gaussian along a lid, as a share of the distance from its middle to a corner. The
source has none; with this, margins of lids shut along their whole length."""
LID_HEIGHT = 0.55
"""Height of a lid above which nothing moves, as a share of the opening of its eye. Of all heights this brings
skin nearest to where FAP 19 takes it: 38 % of its motion off, 63 % at half the height."""
UPPER_SHARE = 0.7
"""Share of the upper lid in the narrowing of eyes."""
EYE_SIDES = ("left", "right")
"""Sides of the eyes, in the order of `LOWER_LIDS`."""


@dataclass(frozen=True, eq=False)
class Eye:
    """An eye. part: its number. rows: intp (V,), vertices of the head. centre: float64 (3,), in its unit."""

    part: int
    rows: Intp
    centre: Float64


def lid_at(head: MarkedHead, vertex: int) -> str:
    """Return the lid whose margin a vertex of the head is on, such as "left upper lid"; "" for none."""
    landmarks = head.landmarks
    if landmarks is not None and 0 <= vertex < len(head.skin.number):
        for side in EYE_SIDES:
            for half in ("upper", "lower"):
                margin = landmarks.contour(f"{side} {half} lid")
                if len(margin) > 2 and head.skin.number[vertex] in margin[1:-1]:
                    return f"{side} {half} lid"
    return ""


def lid_height(head: MarkedHead, lid: str) -> float:
    """Return the height of a lid, in the head's unit."""
    middles = list(LOWER_LIDS.items())[lid.startswith("right")]
    rows = [point_rows()[point] for point in middles]
    return LID_HEIGHT * float(np.linalg.norm(np.diff(head.points[rows], axis=0)))


def find_rows(head: MarkedHead, vertex: int, height: float) -> Influence:
    """Return the vertices of the skin that a lid's marker moves, and their shares.

    vertex: of the head, on the margin of a lid; the middle of its rows. height: of the lid above its margin,
    in the head's unit. Raises ModelError for a vertex that is on no known margin.
    """
    from scipy.spatial import cKDTree

    lid, landmarks = lid_at(head, vertex), head.landmarks
    if landmarks is None or not lid:
        raise ModelError(
            f"vertex {vertex} of {head.name} is on no lid's margin that is known: a lid's marker needs the "
            "head's feature points of the eyes (groups 3), and one of the vertices between their corners"
        )
    is_upper = "upper" in lid
    other = lid.replace("upper", "lower") if is_upper else lid.replace("lower", "upper")
    margin, opposite = landmarks.contour(lid), landmarks.contour(other)
    places, start = head.skin.vertices, int(head.skin.number[vertex])
    middle = int(np.flatnonzero(margin == start)[0])
    inner = margin[1:-1]  # corners belong to both lids, and stay
    steps = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places[margin], axis=0), axis=1))])
    offset = steps - steps[middle]
    along = np.where(offset < 0, offset / offset[0] if middle else 0.0, offset / offset[-1])[1:-1]
    reached = _walk(head, inner, opposite, height)
    away, nearest = cKDTree(places[inner]).query(places[reached], k=min(2, len(inner)))
    away, nearest = away.reshape(len(reached), -1), nearest.reshape(len(reached), -1)
    weights = 1 / np.maximum(away, 1e-9 * height)
    at = (weights * along[nearest]).sum(axis=1) / weights.sum(axis=1)
    far = away[:, 0] / height
    rows = UPPER_ROWS if is_upper else LOWER_ROWS
    factor = np.interp(far, np.linspace(0, 1, len(rows) + 1), (*rows, 0.0))
    shares = factor * np.exp(-0.5 * (at / LID_DEVIATION) ** 2)
    nearer = far < cKDTree(places[opposite]).query(places[reached])[0] / height
    kept = (shares > 0) & (nearer | np.isin(reached, inner))
    order = np.argsort(reached[kept] != start, kind="stable")  # the centre first
    vertices, distances = reached[kept][order], np.linalg.norm(places[reached[kept]] - places[start], axis=1)
    level = 1 + np.floor(far[kept] * len(rows)).astype(np.intp)
    return Influence(vertices, distances[order], level[order], height, shares[kept][order])


def narrow(head: MarkedHead, share: float) -> Float64:
    """Return displacements of vertices that narrow the eyes: float64 (N, 3).

    share: of their opening. Upper lids take `UPPER_SHARE` of it, lower lids the rest, by their rows; if the
    head has eyes, lids move round them. Raises ModelError for a head whose lids are not known.
    """
    moved = np.zeros((len(head.skin), 3))
    rows = point_rows()
    has_lids = False
    for upper, lower in LOWER_LIDS.items():
        bound = int(head.bound[rows[upper]]), int(head.bound[rows[lower]])
        if min(bound) < 0 or not all(lid_at(head, vertex) for vertex in bound):
            continue
        has_lids = True
        gap = head.vertices[bound[1]] - head.vertices[bound[0]]
        for vertex, part in ((bound[0], UPPER_SHARE), (bound[1], UPPER_SHARE - 1)):
            influence = find_rows(head, vertex, lid_height(head, lid_at(head, vertex)))
            moved[influence.vertices] += np.outer(influence.shares, share * part * gap)
    if not has_lids:
        raise ModelError(
            f"{head.name}: no eye can narrow, as its lids' feature points (group 3) are not known"
        )
    for eye in find_eyes(head):
        beside = np.flatnonzero(moved.any(axis=1))
        arm = head.skin.vertices[beside] - eye.centre
        radius = np.linalg.norm(head.vertices[eye.rows] - eye.centre, axis=1).max()
        near = np.linalg.norm(arm, axis=1) < 2 * radius
        arm, beside = arm[near], beside[near]
        turned = arm + moved[beside]
        turned *= (np.linalg.norm(arm, axis=1) / np.linalg.norm(turned, axis=1))[:, None]
        moved[beside] = turned - arm
    result: Float64 = head.followers @ moved
    return result


def find_eyes(head: MarkedHead) -> tuple[Eye, ...]:
    """Return the eyes of a head: its parts of that kind, each with the middle of the sphere that fits it."""
    eyes = []
    for number, (part, rows) in enumerate(zip(head.parts, head.rows, strict=True)):
        if part.kind == "eye" and len(part.triangles):
            used = np.unique(rows[part.triangles])
            places = head.vertices[used]
            middle = places.mean(axis=0)
            local = places - middle
            sphere = np.column_stack([2 * local, np.ones(len(local))])
            fit = np.linalg.lstsq(sphere, (local**2).sum(axis=1), rcond=None)[0]
            eyes.append(Eye(number, np.unique(rows), middle + fit[:3]))
    return tuple(eyes)


def turn_to_camera(rotation: Float64) -> Float64:
    """Return rotations of the eyes in a head with which they keep looking at the camera: float64 (T, 3, 3).

    rotation: float64 (T, 3, 3), of the head from the neutral face, in which it looks at the camera. Eyes turn
    against its yaw and pitch, as far as eyes can; its shift does not count.
    """
    front = rotation[:, 2, :]  # the direction to the camera in the head's axes: the inverse times +z
    yaw = np.arctan2(front[:, 0], front[:, 2])
    pitch = -np.arcsin(np.clip(front[:, 1], -1.0, 1.0))
    share = LARGEST_GAZE / np.maximum(np.hypot(yaw, pitch), LARGEST_GAZE)
    return axis_matrices(1, share * yaw) @ axis_matrices(0, share * pitch)


def _walk(head: MarkedHead, margin: Intp, barrier: Intp, height: float) -> Intp:
    """Return the vertices of the skin that are connected with a margin within a height, up to a barrier."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    places, triangles = head.skin.vertices, head.skin.triangles
    near = cKDTree(places[margin]).query(places, distance_upper_bound=height)[0] < height
    near[barrier] = False
    near[margin] = True
    start, end = triangles.T.ravel(), np.roll(triangles, -1, axis=1).T.ravel()
    both = near[start] & near[end]
    count = len(places)
    joined = csr_array((np.ones(int(both.sum())), (start[both], end[both])), shape=(count, count))
    label = connected_components(joined, directed=False)[1]
    return np.flatnonzero(near & np.isin(label, np.unique(label[margin])))
