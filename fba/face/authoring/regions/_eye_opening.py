"""The opening of an eye and the eyeball behind it.

The opening is cut into upright columns, in which lids slide about the eyeball; moving lids stay outside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fba.arrays import Bool, Float64, Intp
from fba.face.authoring.regions._eyes import Eye
from fba.face.authoring.surface._weights import solve_smooth_field
from fba.face.authoring.surface.landmarks import Landmarks
from fba.face.authoring.surface.surface import Surface, positions_in
from fba.face.eyeball import polar
from fba.face.model import Part
from fba.rotations import unit
from fba.sampling import smoothstep

LIDS = {19: ("left", "upper"), 20: ("right", "upper"), 21: ("left", "lower"), 22: ("right", "lower")}
CLOSED = 1024
COLUMNS = 65
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
STRETCHED = (0.02, 0.85)
"""Shares of the margin's motion between which the skin of a closed upper lid is stretched."""
OUTER = 1.05
"""Radii of the eyeball beyond which there is the outside of a lid, not its lining."""
MOST_RAISED = 0.06
MOST_IN_CORNER = 0.25
"""How far, in radii of the eyeball, that raises or sinks a vertex at most, and one in a corner of the eye."""
CORNER = 0.4
"""Distance from the corners, as a share of the eye's width, up to which the skin counts as theirs."""
LID_THICKNESS = 0.17
"""Distance of a closed lid's skin from the eyeball, in radii of it, that is not made thinner."""
THINNED = 0.7
"""Share of what is more, that a closed lid loses: the skin of its fold does not come down with it."""
PLATE_RINGS = 3
"""Rings of vertices around it whose positions say how it bends at its edge."""
SLACK = 0.01
"""Metres over which it is stiff, see `solve_smooth_field`."""


@dataclass(frozen=True, eq=False)
class Opening:
    """The opening of one eye by columns.

    x: (C,) rising. upper, lower: (C, 2) height and depth of the margins there from the eyeball's centre,
    metres.
    """

    x: Float64
    upper: Float64
    lower: Float64


def measure_opening(marks: Landmarks, eye: Eye) -> Opening | None:
    """Return the columns of an eye's opening, or None where its lids are not one above the other.

    None also if a margin is not on the skin, as when one of its feature points is missing.
    """
    lines = []
    for lid in ("upper", "lower"):
        walk = marks.surface.vertices[marks.contour(f"{eye.side} {lid} lid")]
        if not len(walk):
            return None
        lines.append(walk[np.argsort(walk[:, 0], kind="stable")])
    left = max(line[0, 0] for line in lines)
    right = min(line[-1, 0] for line in lines)
    if not right > left:
        return None
    x = np.linspace(left, right, COLUMNS)
    x = np.unique(
        np.concatenate([x, *(line[(line[:, 0] > left) & (line[:, 0] < right), 0] for line in lines)])
    )
    margins = [
        np.stack([np.interp(x, line[:, 0], line[:, axis] - eye.centre[axis]) for axis in (1, 2)], axis=1)
        for line in lines
    ]
    if not (margins[0][1:-1, 0] > margins[1][1:-1, 0]).mean() > 0.7:
        return None
    return Opening(x, *margins)


def slide_lid(
    points: Float64,
    share: Float64,
    opening: Opening,
    eye: Eye,
    lid: str,
    way: Float64,
    *,
    columns: Float64 | None = None,
) -> Float64:
    """Return (K, N, 3) shifts of points, metres, when a lid has gone shares (K,) of the way to the other.

    share: (N,), share of the margin's motion in each point's column. columns: (N,), x of the columns, where
    they are not the points' own, as of a lash that goes with its root.
    """
    own, other = (opening.upper, opening.lower) if lid == "upper" else (opening.lower, opening.upper)
    column = np.clip(points[:, 0] if columns is None else columns, opening.x[0], opening.x[-1])
    here, there = (
        np.stack([np.interp(column, opening.x, line[:, axis]) for axis in (0, 1)], axis=1)
        for line in (own, other)
    )
    radius, across = np.hypot(*here.T), np.hypot(*there.T)
    height = points[:, 1] - eye.centre[1]
    depth = points[:, 2] - eye.centre[2]
    distance = np.hypot(height, depth)
    # points further out than the margin turn less, so that they move no further than it does
    part = share if columns is not None else share * np.minimum(1.0, radius / np.maximum(distance, 1e-12))
    start = np.arcsin(np.clip(here[:, 0] / np.maximum(radius, 1e-12), -1, 1))
    shifts = np.zeros((len(way), len(points), 3))
    for k, t in enumerate(way):
        goal = here[:, 0] + t * (there[:, 0] - here[:, 0])
        size = radius + np.clip(t, 0, 1) * (across - radius)
        size = np.maximum(size, np.abs(goal) * 1.0001)
        turn = (np.arcsin(goal / np.maximum(size, 1e-12)) - start) * part
        grown = 1 + share * (size / np.maximum(radius, 1e-12) - 1)
        cos, sin = np.cos(turn), np.sin(turn)
        shifts[k, :, 1] = (height * cos + depth * sin) * grown - height
        shifts[k, :, 2] = (depth * cos - height * sin) * grown - depth
    shifts[way == 0] = 0.0
    return shifts


def thin_lid(
    points: Float64, share: Float64, shifts: Float64, ways: Float64, opening: Opening, eye: Eye
) -> Float64:
    """Return the shifts (K, N, 3) of an upper lid that grows thin as it closes, as a lid does.

    At rest, its skin is as far out as the fold above it, which would come down as a thick flap. points:
    (N, 3), with shares (N,) of the margin's motion. ways: (K,), 1 where the eye is closed.
    """
    column = np.clip(points[:, 0], opening.x[0], opening.x[-1])
    margins = [
        np.hypot(opening.x - eye.centre[0], np.hypot(*line.T)) for line in (opening.upper, opening.lower)
    ]
    inner = np.maximum(np.interp(column, opening.x, np.maximum(*margins)), eye.radius)
    arms = points + shifts - eye.centre
    away = np.linalg.norm(arms, axis=2)
    excess = np.maximum(away - inner - LID_THICKNESS * eye.radius, 0.0)
    lost = THINNED * smoothstep(ways)[:, None] * np.clip(share, 0.0, 1.0) * excess
    return np.asarray(shifts - (lost / away)[:, :, None] * arms)


def stretch_fold(
    surface: Surface,
    share: Float64,
    vertices: Intp,
    shifts: Float64,
    ways: Float64,
    opening: Opening,
    eye: Eye,
) -> Float64:
    """Return the shifts (K, M, 3) of an upper lid with the skin above its edge stretched as it closes.

    Closed, that skin is smooth like a bent plate, without ridges of the fold that it came out of; towards the
    corners of the eye, where lids run into the skin around, their edges are, too. share: (N,), share of the
    margin's motion at each vertex of the surface. vertices: (M,), those that move. ways: (K,), 1 where the
    eye is closed.
    """
    closed = surface.vertices.copy()
    closed[vertices] += shifts[np.abs(ways - 1).argmin()]
    outwards = unit(closed - eye.centre)
    arms = surface.vertices - eye.centre
    outer = (np.linalg.norm(arms, axis=1) > OUTER * eye.radius) & (arms[:, 2] > 0)
    along = (closed[:, 0] - opening.x[0]) / (opening.x[-1] - opening.x[0])
    corner = 1 - smoothstep(np.minimum(along, 1 - along) / CORNER)
    # margins, whose share is 1, meet where they are
    free = outer & (share > STRETCHED[0]) & (share < STRETCHED[1] + corner) & (share != 1.0)
    near = free
    for _ in range(PLATE_RINGS):
        near = near | surface.mask(surface.edges[near[surface.edges].any(axis=1)].ravel())
    fixed = np.flatnonzero(near & ~free)
    smooth = solve_smooth_field(surface, free, fixed, closed[fixed], slack=SLACK)
    raised = ((smooth - closed) * outwards).sum(axis=1)
    # between vertices, the skin of a coarse mesh is lower
    edges = surface.edges[free[surface.edges].any(axis=1)]
    dips, low = ((closed[edges[:, 0]] - closed[edges[:, 1]]) ** 2).sum(axis=1), np.zeros(len(surface))
    np.maximum.at(low, edges, dips[:, None] / (4 * eye.radius))
    lowest = np.minimum(OUTER * eye.radius + low - np.linalg.norm(closed - eye.centre, axis=1), 0.0)
    most = (MOST_RAISED + (MOST_IN_CORNER - MOST_RAISED) * corner) * eye.radius
    raised = np.clip(raised, np.maximum(lowest, -most), most)
    raised[~free] = 0.0
    return np.asarray(shifts + smoothstep(ways)[:, None, None] * (raised[:, None] * outwards)[vertices])


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
        """Return (N,) metres: radius of the eyeball towards points (N, 3), or its largest nearby."""
        angle, _ = polar(points, self.centre, self.gaze)
        return np.interp(angle, ANGLES, self.nearby if around else self.straight)

    def is_outside(self, points: Float64, share: float = 1.0) -> Bool:
        """Return (N,) mask of points (N, 3) outside the eyeball, or outside a share of its radius."""
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
        """Return (N,) metres that points are too far back for a moved lid, with room for its `edges`."""
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
        angle, reach = polar(part.vertices.astype(np.float64), eye.centre, eye.gaze)
        for k, direction in enumerate(ANGLES):
            for radii, within in ((straight, RADIUS_HALF_WIDTH), (nearby, MAX_CORNEA_ANGLE)):
                near = np.abs(angle - direction) < within
                radii[k] = max(radii[k], float(reach[near].max(initial=0.0)))
    straight[straight == 0.0] = eye.radius
    dip = edge**2 / (8 * eye.radius)
    return Profile(eye.centre, eye.gaze, eye.radius, CLEARANCE * eye.radius, dip, straight, nearby)


def edge_length(marks: Landmarks, own: Intp, other: Intp) -> float:
    """Return a typical length of the longer edges at the margins of an eye, metres."""
    surface = marks.surface
    at_margin = surface.mask(np.concatenate([own, other]))
    edges = surface.vertices[surface.edges[at_margin[surface.edges].any(axis=1)]]
    return float(np.percentile(np.linalg.norm(edges[:, 0] - edges[:, 1], axis=1), 80)) if len(edges) else 0.0


def push_vertices_outside(
    profile: Profile, points: Float64, shifts: Float64, values: Float64, margins: Bool | None = None
) -> Float64:
    """Return the shifts (K, N, 3), corrected ever more along the motion so that no vertex cuts the eyeball.

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
