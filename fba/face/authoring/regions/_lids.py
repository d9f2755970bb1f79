"""Eyelids and their lashes: FAPs 19-22.

Every vertex of a lid stays in its own upright plane and turns about the eyeball. A lid closes column by
column, each in proportion to its own opening, so that the margins meet along their whole length however the
way is split between upper and lower lid. The skin above the upper lid comes out of its fold and down to the
eyeball.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fba.arrays import Bool, Float64, Integer, Intp
from fba.face.authoring.regions._eye_opening import (
    CLOSED,
    LIDS,
    Opening,
    edge_length,
    measure_opening,
    measure_profile,
    push_edges_outside,
    push_vertices_outside,
    slide_lid,
    stretch_fold,
    thin_lid,
)
from fba.face.authoring.regions._eyes import Eye
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import Motion, fap_limits, unfold
from fba.face.authoring.surface._motion_limits import stop_at_folds
from fba.face.authoring.surface._weights import average_with_neighbours, trim_small
from fba.face.authoring.surface.attached_parts import hair_roots
from fba.face.authoring.surface.landmarks import Landmarks
from fba.face.authoring.surface.surface import weld_parts
from fba.face.model import Part
from fba.mesh import read_pixels
from fba.sampling import smoothstep

# Lashes or a liner that are painted on a lid, see `painted_width`:
LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Shares of red, green and blue (ITU-R BT.709)."""
GAMMA = 2.2
"""Exponent from pictures' values to the linear light of vertices' colours, near enough to compare them."""
STRIPS = 8
"""Number of strips, side by side, into which a lid is cut; each is measured separately."""
MARGIN_STEPS = 24
"""Number of distances from the margin, up to `MAX_DISTANCE`, at which a strip is measured."""
MAX_DISTANCE = 2.0
"""Distance from the margin, in distances of the crease, up to which paint is looked for; skin begins at 1."""
DARK_SHARE = 0.5
"""Brightness, as a share of that of the skin beside, below which paint begins."""
BRIGHT_SHARE = 0.7
"""Brightness, as a share of that of the skin beside, above which paint ends."""
SAMPLES = 12
"""Points across each edge of a triangle at which its colour is read."""
# How a lid moves:
STEP = 128
"""FAP units between two borders of the tables: an eighth of the motion from open to closed."""
REACH = 0.6
"""Largest reach of a lid's motion into the skin around it, in ES0."""
CREASE = 0.11
"""Distance from the margin to the crease in ES0, where its feature point is unknown."""
FOLD = {
    ("left", "upper"): "3.13",
    ("right", "upper"): "3.14",
    ("left", "lower"): "3.9",
    ("right", "lower"): "3.10",
}
"""The feature points on the creases."""
AT_CREASE = 0.25
"""Share of the margin's motion that the crease makes."""
MOTION_END = 3.5
"""Multiple of the crease's distance beyond which the skin does not move."""
EDGE = 0.4
"""Share of the distance to the crease up to which the lid's edge moves rigidly."""
MOST_EDGE = 0.8
"""The same, at most, for a lid with painted lashes or a liner: only bare skin stretches."""
MAX_OVERHANG = 0.2
"""Share by which the front edge of a lid may move further than the margin."""
OWN_SIDE = 0.6
"""Share of the distance between the lids: vertices that are nearer to the other lid follow less."""
CORNER_FACTOR = 0.4
"""Factor of distances at the corners of the eye."""
SMOOTHING_ROUNDS = 4
"""Rounds of averaging shares with those of neighbours."""
UNMOVED_POINTS = {
    "left": ("4.1", "4.3", "4.5", "9.7", "9.13", "5.3", "9.12"),
    "right": ("4.2", "4.4", "4.6", "9.6", "9.14", "5.4", "9.12"),
}
MIN_MEASURED_HEIGHT = 0.35
"""Only columns of the eye's opening at least this high, as a share of the highest, show how far a shape moves
a margin."""
LEAST_SCULPTED = 0.08
"""Least share of the opening by which a shape moves a margin that it shows how to move."""
MOST_BULGE = 0.02
"""Distance in ES0 by which the arcs of a lid may push skin further forward than its sculptor did."""
EDGE_SHARE = 0.7
"""Share of the margin's motion from which skin belongs to the edge of a lid more and more."""
LEAST_TURN = 0.3
"""Least motion of a margin, as a share of its largest, against which that of other vertices is measured."""
MAX_SUNK = 0.03
"""Shortfall of a margin from the clearance of moved lids, in radii of the eyeball, above which both margins
meet where they are, as a gap would be seen otherwise."""
MAX_HAIR_WIDTH = 0.04
"""Width of a single lash's root, at most, as a share of the eye's width."""
CORNER_WIDTH = 0.12
"""Distance from the corners, as a share of the eye's width, within which folds do not stop a lid."""


def lid_motion(
    marks: Landmarks,
    limiter: Limiter,
    eye: Eye,
    fap: int,
    parts: Sequence[Part],
    sculpted: Float64 | None = None,
) -> Motion | str:
    """Return the motion of the surface for a lid's FAP, or the reason why it cannot be made.

    sculpted: (N, 3) displacements of the surface by which somebody closed this eye, metres: then each vertex
    makes the share of the margin's motion that it makes there, and folds in it are no reason to stop.
    """
    side, lid = LIDS[fap]
    own, other = marks.contour(f"{side} {lid} lid"), marks.contour(f"{side} {_other(lid)} lid")
    if not len(own) or not len(other):
        return f"the margin of the {side} {lid if not len(own) else _other(lid)} lid is not on the skin"
    opening = measure_opening(marks, eye)
    if opening is None:
        return f"the lids of the {side} eye are not one above the other"
    share = None if sculpted is None else sculpted_share(marks, opening, eye, lid, sculpted)
    follows = share is not None
    sculptors = limiter
    if sculpted is not None and follows:
        sculptors = limiter.without(_folded_vertices(limiter, sculpted))
    if share is None:
        share = _share(marks, opening, eye, lid, own, other, parts)
    vertices = np.flatnonzero(share > 0)
    points = marks.surface.vertices[vertices]
    values = lid_values(fap)
    shifts = slide_lid(points, share[vertices], opening, eye, lid, values / CLOSED)
    if sculpted is not None and follows:
        free = np.clip((1 - share[vertices]) / (1 - EDGE_SHARE), 0.0, 1.0)
        shifts[:, :, 2] -= free * _bulge(
            shifts, sculpted[vertices], values, MOST_BULGE * marks.fapu.ES * 1024
        )
    margins = np.concatenate([own, other])
    pinned = marks.surface.mask(margins)
    if eye.flat:  # the lids of a drawn eye slide in front of it, where no ball is in their way
        motion = unfold(marks.surface, sculptors, Motion(values, vertices, shifts), pinned, True)
    else:
        if lid == "upper" and not follows:
            shifts = thin_lid(points, share[vertices], shifts, values / CLOSED, opening, eye)
            shifts = stretch_fold(marks.surface, share, vertices, shifts, values / CLOSED, opening, eye)
        profile = measure_profile(eye, parts, edge_length(marks, own, other))
        # margins that lie in the eyeball, or close to it, meet where they are
        sunk = follows or profile.shortfall(marks.surface.vertices[margins]).max() > MAX_SUNK * profile.size
        shifts = push_vertices_outside(profile, points, shifts, values, pinned[vertices] if sunk else None)
        motion = unfold(marks.surface, sculptors, Motion(values, vertices, shifts), pinned, True)
        points = marks.surface.vertices[motion.vertices]
        shifts = push_vertices_outside(
            profile, points, motion.shifts, values, pinned[motion.vertices] if sunk else None
        )
        shifts = push_edges_outside(profile, marks.surface, motion.vertices, shifts, pinned, values)
        motion = Motion(values, motion.vertices, shifts)
    # in the corners of the eye, skin closes on itself, behind its margins too
    ends = marks.surface.vertices[own[[0, -1]]]
    near = np.linalg.norm(marks.surface.vertices[:, None] - ends, axis=2).min(axis=1)
    corners = np.flatnonzero(near < CORNER_WIDTH * np.linalg.norm(ends[1] - ends[0]))
    limited = stop_at_folds(limiter.without(corners), motion, turning=True)
    if not follows and _moving_range(limited)[1] >= CLOSED:
        return limited
    # an eye closes although its lids' edges roll in; no sculptor made the motion upwards
    closing = stop_at_folds(sculptors.without(np.union1d(margins, corners)), motion, turning=True)
    up, down = limited.values < 0, closing.values >= 0
    return Motion(
        np.concatenate([limited.values[up], closing.values[down]]),
        motion.vertices,
        np.concatenate([limited.shifts[up], closing.shifts[down]]),
    )


def _bulge(shifts: Float64, sculpted: Float64, values: Float64, most: float) -> Float64:
    """Return (K, N) by how far shifts (K, N, 3) push skin forward beyond a sculptor's (N, 3), metres.

    Up to `most` that does not matter. Above a drawn eye, which is large and flat, arcs about its ball would
    push the skin over the brow.
    """
    closed = shifts[np.abs(values - CLOSED).argmin()]
    further = np.maximum(closed[:, 2] - sculpted[:, 2], 0.0)
    further *= smoothstep(further / most - 1)
    return np.asarray(np.clip(values / CLOSED, 0.0, 1.0)[:, None] * further)


def sculpted_share(marks: Landmarks, opening: Opening, eye: Eye, lid: str, shift: Float64) -> Float64 | None:
    """Return (N,) shares of the margin's motion in a shape (N, 3); None where it moves this lid little."""
    side, sign = eye.side, (-1.0 if lid == "upper" else 1.0)
    own, other = marks.contour(f"{side} {lid} lid"), marks.contour(f"{side} {_other(lid)} lid")
    arms = marks.surface.vertices - eye.centre
    moved = arms + shift
    turn = sign * (np.arctan2(moved[:, 1], moved[:, 2]) - np.arctan2(arms[:, 1], arms[:, 2]))
    turn[(arms[:, 2] < -0.2 * eye.radius) | (moved[:, 2] < -0.2 * eye.radius)] = 0.0
    line = own[np.argsort(arms[own, 0], kind="stable")]
    gap = np.interp(arms[line, 0] + eye.centre[0], opening.x, opening.upper[:, 0] - opening.lower[:, 0])
    most = float(gap.max())
    # towards the corners, where both margins are close together, shares of little are no measure
    wide = gap > MIN_MEASURED_HEIGHT * most
    if wide.sum() < 2 or np.median(turn[line][wide] * eye.radius / gap[wide]) < LEAST_SCULPTED:
        return None
    at_margin = np.interp(arms[:, 0], arms[line, 0][wide], turn[line][wide])
    at_margin = np.maximum(at_margin, LEAST_TURN * float(turn[line].max()))
    out = np.interp(arms[:, 0], arms[line, 0], np.hypot(arms[line, 1], arms[line, 2]))
    away = np.hypot(arms[:, 1], arms[:, 2]) / np.maximum(out, 1e-12)
    share = np.clip(turn * np.maximum(away, 1.0) / at_margin, 0.0, 1 + MAX_OVERHANG)
    reach = REACH * marks.fapu.ES * 1024
    share *= smoothstep(2 - 2 * np.minimum(marks.surface.distances(own, reach), reach) / reach)
    share[own] = 1.0
    share[np.setdiff1d(other, own)] = 0.0
    return trim_small(share)


def _folded_vertices(limiter: Limiter, shift: Float64) -> Intp:
    """Return the vertices of the triangles that a shape folds. shift: (N, 3)."""
    patch = limiter.patch(np.flatnonzero(np.abs(shift).max(axis=1) > 0))
    if not len(patch.triangles):
        return np.zeros(0, dtype=np.intp)
    return np.unique(patch.triangles[~patch.soundness(shift, turning=True)])


def lid_values(fap: int) -> Float64:
    """Return (K,) rising borders over the FAP's range, extended to where the lid meets the other one."""
    low, high = fap_limits(fap)
    high = max(high, float(CLOSED))
    between = np.arange(np.ceil(low / STEP) * STEP, high + 1, STEP)
    return np.unique(np.concatenate([[low, 0.0, high], between[(between > low) & (between < high)]]))


def _other(lid: str) -> str:
    return "lower" if lid == "upper" else "upper"


def _share(
    marks: Landmarks, opening: Opening, eye: Eye, lid: str, own: Intp, other: Intp, parts: Sequence[Part]
) -> Float64:
    """Return (N,) share of the margin's motion at each vertex of a column.

    1 on the lid's edge, a quarter at the crease, 0 well before the brow; towards the corners, where the
    crease is closer, within a shorter distance. parts: of the face; what is painted on their skin widens the
    edge, as it would be drawn out over the eye otherwise.
    """
    surface, es, side = marks.surface, marks.fapu.ES * 1024, eye.side
    stays = np.setdiff1d(other, own)
    still = marks.vertices_of(UNMOVED_POINTS[side])
    away = surface.distances(own, 2 * REACH * es)
    crease = CREASE * es
    if marks.has(FOLD[side, lid]):
        crease = float(np.clip(away[marks.vertex[FOLD[side, lid]]], 0.8 * crease, 1.5 * crease))
    gap = np.maximum(opening.upper[:, 0] - opening.lower[:, 0], 0.0)
    high = np.interp(surface.vertices[:, 0], opening.x, gap / gap.max())
    end = max(min(MOTION_END, 0.85 * float(away[still].min(initial=np.inf)) / crease), EDGE + 0.3)
    painted = painted_width(marks, opening, eye, lid, parts, crease)
    near = np.maximum(crease * (CORNER_FACTOR + (1 - CORNER_FACTOR) * high), painted / MOST_EDGE)
    edge = np.maximum(painted / near, EDGE)
    folds = away / near
    inner = np.where(folds < edge, folds * EDGE / edge, EDGE + (folds - edge) * (1 - EDGE) / (1 - edge))
    folds = np.where(folds < 1, inner, folds)
    power = np.log(AT_CREASE) / np.log(1 - (1 - EDGE) / (end - EDGE)) if end > 1 + EDGE else 2.0
    share = np.clip((end - np.maximum(folds, EDGE)) / (end - EDGE), 0.0, 1.0) ** power
    overhang = _overhang(surface.vertices, opening, eye, lid, gap.max())
    share *= 1 + overhang * np.clip(2 - folds / EDGE, 0.0, 1.0)
    opposite = surface.distances(stays, 4 * REACH * es)
    with np.errstate(invalid="ignore"):
        share *= smoothstep(np.nan_to_num(opposite / (away + opposite), nan=1.0) / OWN_SIDE)
    # distances along edges are uneven
    pinned = surface.mask(np.concatenate([own, stays]))
    share[own] = 1.0
    share[stays] = 0.0
    pinned |= (away < painted) & (opposite > away)
    share = np.where(pinned, share, average_with_neighbours(surface, share, SMOOTHING_ROUNDS))
    return trim_small(share)


def _overhang(points: Float64, opening: Opening, eye: Eye, lid: str, widest: float) -> Float64:
    """Return (N,) share by which a lid's front edge moves further than the margin, to meet the other's.

    The margin lies on the eyeball; the front edge before it is further away from the other lid.
    """
    margin, sign = (opening.upper, 1.0) if lid == "upper" else (opening.lower, -1.0)
    height, depth = (np.interp(points[:, 0], opening.x, margin[:, axis]) for axis in (0, 1))
    gap = np.interp(points[:, 0], opening.x, opening.upper[:, 0] - opening.lower[:, 0])
    before = points[:, 2] - eye.centre[2] > depth
    back = np.maximum(sign * (points[:, 1] - eye.centre[1] - height), 0.0)
    further = np.clip(2 * back / np.maximum(gap, 0.2 * widest), 0.0, MAX_OVERHANG)
    return np.where(before, further, 0.0)


def lash_motion(marks: Landmarks, eye: Eye, fap: int, part: Part, skin: Motion) -> Motion:
    """Return the motion of a part's lashes: each vertex turns as its root does in the skin's motion."""
    from scipy.spatial import cKDTree

    side, lid = LIDS[fap]
    opening = measure_opening(marks, eye)
    assert opening is not None  # the lid moves, so there is one
    shape = weld_parts([part])
    reach = [
        cKDTree(marks.surface.vertices[marks.contour(f"{side} {which} lid")]).query(shape.vertices)[0]
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
    grows = (upper == (lid == "upper")) & (np.minimum(*closest) < 0.25 * wide)
    root = hair_roots(shape, reach[0 if lid == "upper" else 1])
    moving = np.flatnonzero(grows[pieces][shape.number])
    points = part.vertices[moving].astype(np.float64)
    of_root = root[shape.number[moving]]
    hair = _single_hairs(shape.vertices[root, 0], pieces, MAX_HAIR_WIDTH * wide)
    columns = _shared(shape.vertices[root, :1], pieces, hair)[shape.number[moving], 0]
    # they do not turn as an eye is opened wide: drawn eyes are so flat that they would stand on end
    ways = np.maximum(np.clip(skin.values, *_moving_range(skin)) / CLOSED, 0.0)
    turns = slide_lid(points, np.ones(len(points)), opening, eye, lid, ways, columns=columns)
    # roots stay in the skin, which a fold or the other lid may have stopped
    _, nearest = cKDTree(marks.surface.vertices[skin.vertices]).query(shape.vertices[root])
    at_root = slide_lid(
        shape.vertices[of_root], np.ones(len(points)), opening, eye, lid, ways, columns=columns
    )
    for k, at in enumerate(at_root):
        turns[k] += _shared(skin.shifts[k, nearest], pieces, hair)[shape.number[moving]] - at
    return Motion(skin.values, moving, turns)


def _single_hairs(columns: Float64, pieces: Intp, width: float) -> Bool:
    """Return (N,) mask of vertices of pieces whose roots, at columns (N,), are not wider than this."""
    low, high = np.full(pieces.max() + 1, np.inf), np.full(pieces.max() + 1, -np.inf)
    np.minimum.at(low, pieces, columns)
    np.maximum.at(high, pieces, columns)
    return np.asarray((high - low <= width)[pieces])


def _shared(values: Float64, pieces: Intp, single: Bool) -> Float64:
    """Return values (N, K), of single hairs the mean of each: they do not bend."""
    count = np.bincount(pieces)
    mean = np.stack([np.bincount(pieces, column) / count for column in values.T], axis=1)
    return np.where(single[:, None], mean[pieces], values)


def _moving_range(skin: Motion) -> tuple[float, float]:
    """Return (lowest, highest) value at which a motion still goes on."""
    moved = np.abs(np.diff(skin.shifts, axis=0)).max(axis=(1, 2)) > 0
    used = np.flatnonzero(moved)
    return (float(skin.values[used[0]]), float(skin.values[used[-1] + 1])) if len(used) else (0.0, 0.0)


def painted_width(
    marks: Landmarks, opening: Opening, eye: Eye, lid: str, parts: Sequence[Part], crease: float
) -> float:
    """Return the distance from a lid's margin up to which its skin is painted dark, metres; else 0.

    crease: distance of the lid's crease from the margin, metres. The colour is that of the skin's texture and
    of its vertices; a picture that cannot be read is taken for plain.
    """
    away, column, brightness = _samples(marks, opening, eye, lid, parts, MAX_DISTANCE * crease)
    strip = np.floor((column - opening.x[0]) / (opening.x[-1] - opening.x[0]) * STRIPS)
    step = np.minimum(away / (MAX_DISTANCE * crease) * MARGIN_STEPS, MARGIN_STEPS - 1).astype(np.intp)
    widths = []
    for number in range(STRIPS):
        here = strip == number
        line = np.array([_median(brightness[here & (step == each)]) for each in range(MARGIN_STEPS)])
        skin = _median(brightness[here & (away > crease)])
        seen = np.flatnonzero(np.isfinite(line))
        if len(seen) and skin > 0:
            line = np.interp(np.arange(MARGIN_STEPS), seen, line[seen]) / skin
            ends = np.flatnonzero(line > BRIGHT_SHARE)
            dark = line[0] < DARK_SHARE and len(ends) > 0
            widths.append(ends[0] * MAX_DISTANCE * crease / MARGIN_STEPS if dark else 0.0)
    return float(np.median(widths)) if widths else 0.0


def _median(values: Float64) -> float:
    return float(np.median(values)) if len(values) else np.nan


def _samples(
    marks: Landmarks, opening: Opening, eye: Eye, lid: str, parts: Sequence[Part], reach: float
) -> tuple[Float64, Float64, Float64]:
    """Return the distance from the margin (M,), x (M,) and brightness (M,) of points on a lid's outside."""
    surface = marks.surface
    far = surface.distances(marks.contour(f"{eye.side} {lid} lid"), reach)
    margin = opening.upper if lid == "upper" else opening.lower
    weights = _barycentric()
    found: list[tuple[Float64, Float64, Float64]] = []
    start = 0
    for part in parts:
        numbers = surface.find(np.arange(start, start + len(part.vertices)))
        start += len(part.vertices)
        corners = numbers[part.triangles]
        near = (corners >= 0).all(axis=1) & np.isfinite(far[corners]).all(axis=1)
        if part.kind != "skin" or not near.any():
            continue
        triangles = part.triangles[near]
        points = np.einsum("sc,fcx->fsx", weights, part.vertices[triangles].astype(np.float64)).reshape(-1, 3)
        away = np.einsum("sc,fc->fs", weights, far[corners[near]]).reshape(-1)
        height, depth = (np.interp(points[:, 0], opening.x, margin[:, axis]) for axis in (0, 1))
        up = points[:, 1] - eye.centre[1] - height
        outside = (up > 0) if lid == "upper" else (up < 0)
        outside &= points[:, 2] - eye.centre[2] > depth
        outside &= (points[:, 0] > opening.x[0]) & (points[:, 0] < opening.x[-1])
        found.append((away[outside], points[outside, 0], _brightness(part, triangles, weights)[outside]))
    if not found:
        return np.zeros(0), np.zeros(0), np.zeros(0)
    away, column, bright = (np.concatenate(each) for each in zip(*found, strict=True))
    return away, column, bright


def _barycentric() -> Float64:
    """Return (S, 3) weights of a triangle's corners at points spread over it."""
    first, second = np.meshgrid(np.arange(SAMPLES), np.arange(SAMPLES))
    inside = first + second < SAMPLES
    a, b = (first[inside] + 1 / 3) / SAMPLES, (second[inside] + 1 / 3) / SAMPLES
    return np.stack([a, b, 1 - a - b], axis=1)


def _brightness(part: Part, triangles: Integer, weights: Float64) -> Float64:
    """Return (F * S,) brightness of points on a part's triangles, 1 where it is plain white."""
    bright = np.ones(len(triangles) * len(weights))
    if part.colours is not None:
        light = np.einsum("sc,fc->fs", weights, part.colours[triangles, :3] @ LUMINANCE).reshape(-1)
        bright *= np.clip(light, 0.0, 1.0) ** (1 / GAMMA)
    picture = None if part.material.texture is None else read_pixels(part.material.texture)
    if picture is not None and part.texcoords is not None:
        places = np.einsum("sc,fcx->fsx", weights, part.texcoords[triangles]).reshape(-1, 2) % 1.0
        rows, columns = (
            np.minimum((places[:, 1 - axis] * picture.shape[axis]).astype(np.intp), picture.shape[axis] - 1)
            for axis in (0, 1)
        )
        bright *= picture[rows, columns, :3] @ LUMINANCE / 255
    return bright
