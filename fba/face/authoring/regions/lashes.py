"""Motions of lashes, which follow the lid that they grow on."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float64
from fba.face.authoring.regions.eye_opening import CLOSED, LIDS, measure_opening, slide_lid
from fba.face.authoring.regions.eyes import Eye
from fba.face.authoring.surface.attached_parts import hair_roots
from fba.face.authoring.surface.landmarks import Landmarks
from fba.face.authoring.surface.motion import Motion
from fba.face.authoring.surface.surface import Surface
from fba.face.model import Part


def lash_motion(marks: Landmarks, eye: Eye, fap: int, part: Part, lid: Motion) -> Motion:
    """The motion of a part's lashes for a lid's FAP: each vertex turns as its root on the margin does."""
    side, name = LIDS[fap]
    opening = measure_opening(marks, eye)
    assert opening is not None  # the lid moves, so there is one
    shape = Surface([part])
    reach = [
        _distance(shape.vertices, marks.surface.vertices[marks.contour(f"{side} {which} lid")])
        for which in ("upper", "lower")
    ]
    pieces = shape.component
    closest = [np.full(pieces.max() + 1, np.inf) for _ in reach]
    for best, away in zip(closest, reach, strict=True):
        np.minimum.at(best, pieces, away)
    wide = opening.x[-1] - opening.x[0]
    mean = np.bincount(pieces, shape.vertices[:, 1]) / np.bincount(pieces)
    middle = float((opening.upper[:, 0] + opening.lower[:, 0]).mean()) / 2 + eye.centre[1]
    upper = np.where(np.abs(closest[0] - closest[1]) < 0.1 * wide, mean > middle, closest[0] < closest[1])
    grows = (upper == (name == "upper")) & (np.minimum(*closest) < 0.25 * wide)
    root = hair_roots(shape, reach[0 if name == "upper" else 1])
    moving = np.flatnonzero(grows[pieces][shape.number])
    points = part.vertices[moving].astype(np.float64)
    columns = shape.vertices[root[shape.number[moving]], 0]
    ways = np.clip(lid.values, *_sound_range(lid)) / CLOSED
    turns = slide_lid(points, np.ones(len(points)), opening, eye, name, ways, columns=columns)
    return Motion(lid.values, moving, turns)


def _sound_range(lid: Motion) -> tuple[float, float]:
    """(lowest, highest) value at which a lid still moves."""
    moved = np.abs(np.diff(lid.shifts, axis=0)).max(axis=(1, 2)) > 0
    used = np.flatnonzero(moved)
    return (float(lid.values[used[0]]), float(lid.values[used[-1] + 1])) if len(used) else (0.0, 0.0)


def _distance(points: Float64, line: Float64) -> Float64:
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(line).query(points)[0], dtype=np.float64)
