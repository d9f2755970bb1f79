"""Keeps moving lids outside the eyeball."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.easing import smoothstep
from fba.face.authoring.regions.eye_opening import CLOSED
from fba.face.authoring.regions.eyes import Eye
from fba.face.authoring.surface.landmarks import Landmarks
from fba.face.authoring.surface.surface import Surface
from fba.face.model import Part

CLEARANCE = 0.012
"""Clearance between a moved lid and the eyeball, as a share of the eyeball's radius."""
FULL_CLEARANCE = 0.3
"""Share of the way after which a lid has its full clearance."""
BULGE = np.radians(12.0)
"""Angle by which the cornea may be elsewhere, because the eye turns."""
STRICT = np.radians(4.0)
OUTSIDE = 0.97
"""Vertices this far out, in radii of the eyeball, count as outside."""
DEEPEST = 0.02
"""Largest correction for an edge that dips into the eyeball, as a share of its radius."""
BRIDGINGS = 3
"""Moving a vertex off the eyeball may pull another edge into it: number of passes."""


class Profile:
    """Distance of an eyeball's surface from its centre in every direction, the cornea included."""

    def __init__(self, eye: Eye, parts: Sequence[Part], edge: float) -> None:
        """edge: typical length of the lids' edges, whose middles dip below their ends."""
        self._eye = eye
        self._clearance = CLEARANCE * eye.radius
        self._dip = edge**2 / (8 * eye.radius)
        self._angles = np.linspace(0, np.pi, 73)
        self._here = np.full(73, 0.0)
        self._around = np.full(73, eye.radius)
        for part in parts:
            if part.name not in eye.parts:
                continue
            arms = part.vertices.astype(np.float64) - eye.centre
            reach = np.linalg.norm(arms, axis=1)
            angle = np.arccos(np.clip(arms @ eye.gaze / np.maximum(reach, 1e-12), -1, 1))
            for k, at in enumerate(self._angles):
                for radii, within in ((self._here, STRICT), (self._around, BULGE)):
                    near = np.abs(angle - at) < within
                    if near.any():
                        radii[k] = max(radii[k], float(reach[near].max()))
        self._here[self._here == 0.0] = eye.radius

    def radius(self, points: Float64, *, around: bool) -> Float64:
        """(N,) metres: radius of the eyeball in the directions of points (N, 3), or its largest nearby."""
        arms = points - self._eye.centre
        reach = np.linalg.norm(arms, axis=1)
        angle = np.arccos(np.clip(arms @ self._eye.gaze / np.maximum(reach, 1e-12), -1, 1))
        result: Float64 = np.interp(angle, self._angles, self._around if around else self._here)
        return result

    @property
    def reach(self) -> float:
        """Radius of the eyeball, metres."""
        return self._eye.radius

    def before(self, points: Float64) -> Bool:
        """(N,) mask of points (N, 3) outside the eyeball."""
        reach = np.linalg.norm(points - self._eye.centre, axis=1)
        return np.asarray(reach >= self.radius(points, around=False))

    def lift(self, points: Float64, shifts: Float64, *, edges: bool = True) -> Float64:
        """(N, 3) forward shifts to add so that points that were outside the eyeball stay outside.

        edges: leave room for the edges between vertices, whose middles dip.
        """
        at = points + shifts
        needed = self.radius(at, around=True) + self._clearance + (self._dip if edges else 0.0)
        arms = at - self._eye.centre
        level = (arms[:, :2] ** 2).sum(axis=1)
        outside = np.linalg.norm(points - self._eye.centre, axis=1) >= OUTSIDE * self.radius(
            points, around=False
        )
        before = np.sqrt(np.maximum(needed**2 - level, 0.0))
        moved = np.linalg.norm(shifts, axis=1) > 1e-9
        push = np.where(outside & moved & (arms[:, 2] > 0), np.maximum(before - arms[:, 2], 0.0), 0.0)
        result = np.zeros_like(at)
        result[:, 2] = push
        return result


def edge_length(marks: Landmarks, own: Intp, other: Intp) -> float:
    """A typical length of the longer edges at the margins of an eye, metres."""
    surface = marks.surface
    at_margin = np.zeros(len(surface), dtype=bool)
    at_margin[own] = at_margin[other] = True
    edges = surface.vertices[surface.edges[at_margin[surface.edges].any(axis=1)]]
    return float(np.percentile(np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1), 80)) if len(edges) else 0.0


def push_vertices_outside(profile: Profile, points: Float64, shifts: Float64, values: Float64) -> Float64:
    """Shifts (K, N, 3) corrected so that no vertex cuts the eyeball, increasingly along the way."""
    result = shifts.copy()
    for k, share in enumerate(smoothstep(np.abs(values) / CLOSED / FULL_CLEARANCE)):
        result[k] += profile.lift(points, shifts[k]) * share
    return result


def push_edges_outside(
    profile: Profile, surface: Surface, vertices: Intp, shifts: Float64, margins: Bool, values: Float64
) -> Float64:
    """Shifts (K, N, 3) with vertices moved forwards where their edges would cut the eyeball."""
    place = np.full(len(surface), -1)
    place[vertices] = np.arange(len(vertices))
    # a lid's inner side may run into the eyeball where nobody sees it
    before = (place >= 0) & profile.before(surface.vertices)
    edges = surface.edges[before[surface.edges].all(axis=1)]
    # margins meet those of the other lid where they are
    free = ~margins[edges]
    local, points = place[edges], surface.vertices[vertices]
    result = shifts.copy()
    for k, share in enumerate(smoothstep(np.abs(values) / CLOSED / FULL_CLEARANCE)):
        for _ in range(BRIDGINGS):
            middles = points[local].mean(axis=1)
            push = profile.lift(middles, result[k][local].mean(axis=1), edges=False)[:, 2]
            # only edges with both ends outside are corrected
            push[~profile.before(points + result[k])[local].all(axis=1)] = 0.0
            push = np.minimum(push, DEEPEST * profile.reach)
            worst = np.zeros(len(vertices))
            np.maximum.at(worst, local[free], np.repeat(2 * share * push, 2)[free.ravel()])
            if not worst.any():
                break
            result[k, :, 2] += worst
    return result
