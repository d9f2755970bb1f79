"""Keeps moving lids outside the eyeball."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.easing import smoothstep
from fba.face.authoring.regions._eye_opening import CLOSED
from fba.face.authoring.regions._eyes import Eye
from fba.face.authoring.surface.landmarks import Landmarks
from fba.face.authoring.surface.surface import Surface, positions_in
from fba.face.model import Part

CLEARANCE = 0.012
"""Clearance between a moved lid and the eyeball, as a share of the eyeball's radius."""
FULL_CLEARANCE = 0.3
"""Share of its motion after which a lid has its full clearance."""
MAX_CORNEA_ANGLE = np.radians(12.0)
"""Angle by which the cornea may have moved, because the eye turns."""
RADIUS_HALF_WIDTH = np.radians(4.0)
"""Half the width of the directions over which the eyeball's own radius is measured."""
ANGLES = np.linspace(0, np.pi, 73)
"""Angles from the gaze at which an eyeball's radius is measured."""
OUTSIDE_RADII = 0.97
"""Vertices this far out, in radii of the eyeball, count as outside."""
MAX_DIP_CORRECTION = 0.02
"""Largest correction for an edge that dips into the eyeball, as a share of its radius."""
BRIDGING_PASSES = 3
"""Number of passes: moving a vertex off the eyeball may pull another edge into it."""


@dataclass(frozen=True, eq=False)
class Profile:
    """Distance of an eyeball's surface from its centre in every direction, the cornea included.

    centre, gaze: (3,). size: radius of the eyeball. clearance: of the lids from it. dip: depth by which the
    middle of a lid's edge lies below its ends. straight: the eyeball's largest radius at each angle of
    `ANGLES` from the gaze; nearby: the largest within `MAX_CORNEA_ANGLE` of it. Lengths in metres.
    """

    centre: Float64
    gaze: Float64
    size: float
    clearance: float
    dip: float
    straight: Float64
    nearby: Float64

    def radius(self, points: Float64, *, around: bool) -> Float64:
        """Return (N,) metres: radius of the eyeball in the directions of points (N, 3), or its largest
        nearby."""
        angle, _ = _polar(points, self.centre, self.gaze)
        result: Float64 = np.interp(angle, ANGLES, self.nearby if around else self.straight)
        return result

    def is_outside(self, points: Float64, share: float = 1.0) -> Bool:
        """Return (N,) mask of points (N, 3) outside the eyeball. share: of its radius that counts as its
        surface."""
        reach = np.linalg.norm(points - self.centre, axis=1)
        return np.asarray(reach >= share * self.radius(points, around=False))

    def lift(
        self, points: Float64, shifts: Float64, *, edges: bool = True, always: Bool | None = None
    ) -> Float64:
        """Return (N, 3) forward shifts to add so that points that were outside the eyeball stay outside.

        edges: leave room for the edges between vertices, whose middles dip. always: (N,) mask of points that
        count as outside.
        """
        shifted = points + shifts
        way = np.linalg.norm(shifts, axis=1)
        outside = self.is_outside(points, OUTSIDE_RADII)
        pushed = (outside if always is None else outside | always) & (way > 1e-9)
        result = np.zeros_like(shifted)
        # vertices that hardly move, as in the lining of the other lid, stay
        most = way if always is None else np.where(always, np.inf, way)
        result[:, 2] = np.where(pushed, np.minimum(self.shortfall(shifted, edges=edges), most), 0.0)
        return result

    def shortfall(self, points: Float64, *, edges: bool = True) -> Float64:
        """Return (N,) metres by which points (N, 3) are too far back for a moved lid; 0 behind the centre.

        edges: leave room for the edges between vertices.
        """
        needed = self.radius(points, around=True) + self.clearance + (self.dip if edges else 0.0)
        arms = points - self.centre
        level = (arms[:, :2] ** 2).sum(axis=1)
        front = np.sqrt(np.maximum(needed**2 - level, 0.0))
        return np.where(arms[:, 2] > 0, np.maximum(front - arms[:, 2], 0.0), 0.0)


def measure_profile(eye: Eye, parts: Sequence[Part], edge: float) -> Profile:
    """Return the profile of an eye's parts. edge: typical length of the lids' edges, metres."""
    straight = np.full(len(ANGLES), 0.0)
    nearby = np.full(len(ANGLES), eye.radius)
    for part in parts:
        if part.name not in eye.parts:
            continue
        angle, reach = _polar(part.vertices.astype(np.float64), eye.centre, eye.gaze)
        for k, direction in enumerate(ANGLES):
            for radii, within in ((straight, RADIUS_HALF_WIDTH), (nearby, MAX_CORNEA_ANGLE)):
                near = np.abs(angle - direction) < within
                radii[k] = max(radii[k], float(reach[near].max(initial=0.0)))
    straight[straight == 0.0] = eye.radius
    dip = edge**2 / (8 * eye.radius)
    return Profile(eye.centre, eye.gaze, eye.radius, CLEARANCE * eye.radius, dip, straight, nearby)


def _polar(points: Float64, centre: Float64, axis: Float64) -> tuple[Float64, Float64]:
    """Return (angles (N,) from an axis, distances (N,) from a centre) of points (N, 3)."""
    arms = points - centre
    distance = np.linalg.norm(arms, axis=1)
    return np.arccos(np.clip(arms @ axis / np.maximum(distance, 1e-12), -1, 1)), distance


def edge_length(marks: Landmarks, own: Intp, other: Intp) -> float:
    """Return a typical length of the longer edges at the margins of an eye, metres."""
    surface = marks.surface
    at_margin = surface.mask(np.concatenate([own, other]))
    edges = surface.vertices[surface.edges[at_margin[surface.edges].any(axis=1)]]
    return float(np.percentile(np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1), 80)) if len(edges) else 0.0


def push_vertices_outside(
    profile: Profile, points: Float64, shifts: Float64, values: Float64, margins: Bool | None = None
) -> Float64:
    """Return the shifts (K, N, 3) corrected, increasingly along the motion, so that no vertex cuts the
    eyeball.

    margins: (N,) mask of the vertices of both lids' margins where these must meet also if the eyeball is so
    large that some lie in it. They are kept outside while they move, and end on the other margin where it is.
    """
    result = shifts.copy()
    ways = np.abs(values) / CLOSED
    for k, share in enumerate(smoothstep(ways / FULL_CLEARANCE)):
        push = profile.lift(points, shifts[k], always=margins)
        if margins is not None:
            push[margins] *= smoothstep(max(min(ways[k], 1 - ways[k]), 0.0) / FULL_CLEARANCE)
            push[~margins] *= share
        else:
            push *= share
        result[k] += push
    return result


def push_edges_outside(
    profile: Profile, surface: Surface, vertices: Intp, shifts: Float64, margins: Bool, values: Float64
) -> Float64:
    """Return the shifts (K, N, 3) with vertices moved forwards where their edges would cut the eyeball."""
    # a lid's inner side may run into the eyeball where nobody sees it
    in_front = surface.mask(vertices) & profile.is_outside(surface.vertices)
    edges = surface.edges[in_front[surface.edges].all(axis=1)]
    # margins meet those of the other lid where they are
    free = ~margins[edges]
    local, points = positions_in(vertices, len(surface))[edges], surface.vertices[vertices]
    result = shifts.copy()
    for k, share in enumerate(smoothstep(np.abs(values) / CLOSED / FULL_CLEARANCE)):
        for _ in range(BRIDGING_PASSES):
            middles = points[local].mean(axis=1)
            push = profile.lift(middles, result[k][local].mean(axis=1), edges=False)[:, 2]
            # only edges with both ends outside are corrected
            push[~profile.is_outside(points + result[k])[local].all(axis=1)] = 0.0
            push = np.minimum(push, MAX_DIP_CORRECTION * profile.size)
            worst = np.zeros(len(vertices))
            np.maximum.at(worst, local[free], np.repeat(2 * share * push, 2)[free.ravel()])
            if not worst.any():
                break
            result[k, :, 2] += worst
    return result
