"""The ears: FAPs 65-68. A raised ear moves rigidly about its soft root; of a pulled ear, the rim moves
furthest."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from fba.arrays import Float64, Intp
from fba.easing import smoothstep
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import Motion
from fba.face.authoring.surface._motion_limits import eased_linear_motion
from fba.face.authoring.surface._weights import average_with_neighbours, trim_small
from fba.face.authoring.surface.landmarks import Landmarks
from fba.parameters import faps

EARS = {
    "left": {"top": "10.1", "back": "10.3", "lobe": "10.5", "below": "10.7", "above": "10.9"},
    "right": {"top": "10.2", "back": "10.4", "lobe": "10.6", "below": "10.8", "above": "10.10"},
}
"""Feature points of the ears; "below" and "above" are where they meet the face."""
RAISE = {65: "left", 66: "right"}
PULL = {67: "left", 68: "right"}
RIGID_WIDTH = 0.55
"""Share of the ear's width from its rim up to which it moves as a whole."""
ROOT_WIDTH = 1.15
"""Share of the ear's width from its rim beyond which it does not move."""
FADE_RADII = (1.1, 1.7)
"""Multiples of the ear's size between which the motion of the head around it fades out."""
DEPTH_FACTOR = 1.2
"""The ear is taken to be deeper, front to back, than its points say by this factor."""
LEAST_PULL = 0.1
"""Share of a pull that the root of the ear makes."""
SMOOTHING_ROUNDS = 6
"""Rounds of averaging shares with those of neighbours."""


def ear_motions(marks: Landmarks, limiter: Limiter) -> tuple[dict[int, Motion], dict[int, str]]:
    """Return (motions of the surface by FAP, reasons by FAP for those that this face cannot have)."""
    motions: dict[int, Motion] = {}
    lost: dict[int, str] = {}
    for fap, side in (RAISE | PULL).items():
        if reason := marks.missing_point(fap):
            lost[fap] = reason
            continue
        share = _share(marks, side, pull=fap in PULL)
        vertices = np.flatnonzero(share)
        pinned = marks.surface.mask(marks.vertices_of(faps()[fap - 1].feature_points))
        field = share[vertices][:, None] * marks.step(fap)
        motions[fap] = eased_linear_motion(marks.surface, limiter, vertices, field, fap, pinned)
    return motions, lost


def _share(marks: Landmarks, side: str, *, pull: bool) -> Float64:
    """Return (N,) share of the ear's motion at each vertex."""
    names = EARS[side]
    surface = marks.surface
    top, back, lobe, below, above = (marks.point_or_average(name) for name in names.values())
    root = (below + above) / 2
    width = float(np.linalg.norm(back - root))
    rim = _rim(marks, names)
    away = surface.distances(rim, 1.5 * width) / width
    share = 1 - smoothstep((np.nan_to_num(away, posinf=9.0) - RIGID_WIDTH) / (ROOT_WIDTH - RIGID_WIDTH))
    share = average_with_neighbours(surface, share, SMOOTHING_ROUNDS)
    centre = ((top + lobe) / 2 + (back + root) / 2) / 2
    half = np.array([np.inf, np.linalg.norm(top - lobe) / 2, abs(back[2] - root[2]) / 2 * DEPTH_FACTOR])
    beside = np.linalg.norm((surface.vertices - centre) / half, axis=1)
    share *= 1 - smoothstep((beside - FADE_RADII[0]) / (FADE_RADII[1] - FADE_RADII[0]))
    if pull:
        out = root - back
        far = 1 - ((surface.vertices - back) @ out) / (out @ out)
        share = share * (LEAST_PULL + (1 - LEAST_PULL) * np.clip(far, 0.0, 1.2))
    own = marks.vertex[names["back" if pull else "top"]]
    return trim_small(share / max(share[own], 1e-9))


def _rim(marks: Landmarks, names: dict[str, str]) -> Intp:
    """Return the vertices around the ear, from its upper end at the face over the back to the lobe."""
    known = marks.vertices_of(names[key] for key in ("top", "back", "lobe"))
    return np.unique(np.concatenate([known, *(marks.surface.path(a, b) for a, b in pairwise(known))]))
