"""Reshapes the base head into the standard's neutral face, with an adult's proportions.

The base has small eyes that look a little down, and a narrow mouth. Published norms of adults:
eyes some 29 mm wide and 34 mm apart, and a mouth 51 mm wide; the standard asks for lids that touch the rim
of the iris above and below, and lips that touch along a level line.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fba.arrays import Bool, Float64, Int64
from fba.sampling import smoothstep
from tools.figure.figure import Surface
from tools.figure.subdivide import Refined

EYE_CENTRE = np.array([0.0312, -0.0018, 0.0620])
"""Centre of the left eyeball in the frame of `figure.head`."""
EYE_RADIUS = 0.0123
IRIS = 0.0108
"""Diameter of the iris and height of the eye opening: IRISD0."""
LID_GAP = 0.00022
"""Metres between the inner edge of a lid and the eyeball."""
INNER_CORNER, OUTER_CORNER = np.array([0.0199, -0.0041]), np.array([0.0441, -0.0012])
"""Corners of the base's left eye opening, x and y."""
MARGIN_RING = 2
"""Ring of the lid margin's inner edge, counted from the border of the eye socket."""
MOUTH = np.array([0.0, -0.0708])
"""Point at which the lips meet, x and y."""
CONTACT_RING = 1
"""Ring along which the lips touch, counted from the border of the inside of the mouth."""

LID_THICKNESS, LID_THINNED = 0.0017, 0.85
"""Metres from the inner edge of an upper lid's margin up to its skin, and what share of more it loses."""
CREASE_ROUNDS = 14
"""Rounds of averaging with neighbours that soften the crease of the upper lids."""
UPPER_LIP = np.array([0.0, 0.0, 1.4, 1.4, 0.4, 0.2, 0.0]) / 1000
"""Metres by which rings of the upper lip, from the border of the inside on, are moved forward: it is round,
and its upper half faces the light."""
LIP_OVERLAP = 0.0009
"""Metres by which the upper lip reaches below that ring, behind it."""


@dataclass(frozen=True, eq=False)
class Marks:
    """Regions of the vertices of the head, by their distance in edges from eye sockets and mouth.

    eye: (V,) number of the ring around the border of the left or right eye socket, positive outside,
    negative inside, `FAR` if far away. mouth: the same around the border of the inside of the mouth.
    lip: (V,) 1 on the upper lip and above it, -1 on the lower lip and below it, 0 elsewhere.
    """

    eye: Int64 | Float64
    mouth: Int64 | Float64
    lip: Int64 | Float64


FAR = 99
ORIGIN = np.array([0.0, EYE_CENTRE[1], EYE_CENTRE[2] + EYE_RADIUS])
"""Origin of the finished head, between the pupils, in the frame of `figure.head`."""


def _interpolate_rings(refined: Refined, ring: Int64) -> Float64:
    """Return ring numbers of the coarse vertices interpolated to the fine ones."""
    value = refined.blend @ ring.astype(np.float64)
    far = refined.blend @ (ring == FAR).astype(np.float64)
    return np.where(far > 0, FAR, value)


def refine_marks(refined: Refined, coarse: Marks) -> Marks:
    """Return the marks of the coarse vertices interpolated to the fine ones."""
    eye, mouth = (_interpolate_rings(refined, rings) for rings in (coarse.eye, coarse.mouth))
    return Marks(eye, mouth, refined.blend @ coarse.lip.astype(np.float64))


def find_marks(head: Surface) -> Marks:
    """Return the marks of the base head."""
    inside, outside = head.vertices_of(head.tile == 1), head.vertices_of(head.tile == 0)
    border = inside & outside
    low = head.vertices[:, 1] < -0.03
    eye, mouth = (_signed_rings(head, border & chosen, inside & ~border) for chosen in (~low, low))
    return Marks(eye, mouth, _lips(head, mouth))


def _signed_rings(head: Surface, border: Bool, inside: Bool) -> Int64:
    rings = head.rings(np.flatnonzero(border), 16)
    return np.where(rings < 0, FAR, np.where(inside, -rings, rings))


def sculpt_head(head: Surface, marks: Marks) -> Surface:
    """Return the base head with eyes, mouth and nose in proportion; as symmetric as the base is."""
    vertices = _wider_eyes(head.vertices, marks)
    for _ in range(4):  # laying the lids on the eyeballs changes their height a little each time
        vertices = _open_lids(vertices, marks)
    vertices = _mouth(vertices, marks)
    vertices = _fuller_lips(vertices, marks)
    return replace(head, vertices=_nose(vertices))


def _both_sides(vertices: Float64) -> tuple[Float64, Float64]:
    """Return vertices mirrored onto the left side, and the sign of x of each vertex."""
    sign = np.where(vertices[:, 0] < 0, -1.0, 1.0)
    left = vertices.copy()
    left[:, 0] *= sign
    return left, sign


def _wider_eyes(vertices: Float64, marks: Marks) -> Float64:
    left, sign = _both_sides(vertices)
    near = (marks.eye != FAR) & (left[:, 2] > 0.045)
    offset = left - EYE_CENTRE
    distance = np.hypot(offset[:, 0] / 1.3, offset[:, 1])
    weight = np.where(near, 1 - smoothstep((distance - 0.010) / 0.014), 0.0)
    stretch = np.where(offset[:, 0] < 0, 0.25, 0.10)
    ball = marks.eye < 0  # the socket stays around the eyeball
    # The nose bridge between the eyes must not be crossed.
    left[:, 0] += offset[:, 0] * stretch * weight * np.where(ball, 0.5, 1.0)
    left[:, 0] = np.where(np.abs(vertices[:, 0]) < 1e-6, 0.0, left[:, 0])
    left[:, 0] *= sign
    return left


def eye_corners() -> tuple[Float64, Float64]:
    """Return inner and outer corner of the left eye after `_wider_eyes`, x and y."""
    inner, outer = INNER_CORNER.copy(), OUTER_CORNER.copy()
    inner[0] += (inner[0] - EYE_CENTRE[0]) * 0.25
    outer[0] += (outer[0] - EYE_CENTRE[0]) * 0.10
    return inner, outer


def opening_profile(x: Float64) -> Float64:
    """Return (N,) height of the lid opening at each x: 0 at the corners of the left eye, 1 in the middle."""
    inner, outer = eye_corners()
    t = np.clip((x - inner[0]) / (outer[0] - inner[0]), 0, 1)
    middle = (EYE_CENTRE[0] - inner[0]) / (outer[0] - inner[0])
    warped = np.where(t < middle, t / middle * 0.5, 0.5 + (t - middle) / (1 - middle) * 0.5)
    return np.sin(np.pi * warped) ** 0.85


def upper_side(x: Float64, y: Float64) -> Bool:
    """Return (N,) mask of points near the left eye above the line through its corners."""
    inner, outer = eye_corners()
    return y > np.interp(x, [inner[0], outer[0]], [inner[1], outer[1]])


def _open_lids(vertices: Float64, marks: Marks) -> Float64:
    left, sign = _both_sides(vertices)
    ring = marks.eye
    region = (ring != FAR) & (left[:, 2] > 0.045)
    upper = upper_side(left[:, 0], left[:, 1])
    margin = region & (ring == MARGIN_RING)
    target_y = {True: EYE_CENTRE[1] + IRIS / 2, False: EYE_CENTRE[1] - IRIS / 2}
    for side in (True, False):
        on_side = region & (upper == side)
        edge = margin & (upper == side)
        # One vertex of each margin is moved to the middle of the pupil.
        nearest = left[edge, 0][np.abs(left[edge, 0] - EYE_CENTRE[0]).argmin()]
        bump = np.exp(-(((left[:, 0] - nearest) / 0.005) ** 2)) * (1 - smoothstep((np.abs(ring) - 3) / 5.0))
        left[:, 0] += (EYE_CENTRE[0] - nearest) * bump * on_side
        order = np.argsort(left[edge, 0])
        x, y = left[edge, 0][order], left[edge, 1][order]
        move = target_y[side] - np.interp(EYE_CENTRE[0], x, y)
        fade = np.where(ring >= 0, 1 - smoothstep((ring - 4) / 8.0), 1 - smoothstep(-ring / 3.0))
        shift = move * opening_profile(left[:, 0]) * fade * on_side
        left[:, 1] += shift
    left = _onto_eyeball(left, ring, region)
    left[:, 0] *= sign
    return left


def _onto_eyeball(left: Float64, ring: Int64, region: Bool) -> Float64:
    """Return vertices with lids and skin around them laid on the eyeball, and the socket outside of it."""
    offset = left - EYE_CENTRE
    distance = np.linalg.norm(offset, axis=1)
    edge = region & (ring == MARGIN_RING)
    # The rings outside the margin move like the margin in the same direction from the eyeball.
    angle = np.arctan2(offset[:, 1], offset[:, 0])
    order = np.argsort(angle[edge])
    correction = (EYE_RADIUS + LID_GAP - distance[edge])[order]
    caruncle = left[edge, 0][order] < EYE_CENTRE[0] - EYE_RADIUS * 0.86
    correction = np.where(caruncle, np.clip(correction, -0.001, None), correction)
    sorted_angles = angle[edge][order]
    pull = np.interp(angle, sorted_angles, correction, period=2 * np.pi)
    fade = 1 - smoothstep((ring - 3) / 6.0)
    outside = region & (ring >= 1)
    moved = left + offset / distance[:, None] * (pull * fade * outside)[:, None]
    within = region & (ring <= 1)
    min_distance = EYE_RADIUS + np.where(ring >= 0, LID_GAP + 0.0001, 0.0009)
    offset = moved - EYE_CENTRE
    distance = np.linalg.norm(offset, axis=1)
    new_distance = np.where(within, np.maximum(distance, min_distance), distance)
    return EYE_CENTRE + offset / distance[:, None] * new_distance[:, None]


def lay_on_eyeballs(vertices: Float64, ring: Float64) -> Float64:
    """Return vertices of the refined head with lid margins and sockets moved out of the eyeballs again."""
    left, sign = _both_sides(vertices)
    offset = left - EYE_CENTRE
    distance = np.linalg.norm(offset, axis=1)
    region = (ring != FAR) & (left[:, 2] > 0.045)
    min_distance = np.where(ring > 1.0, EYE_RADIUS + LID_GAP, EYE_RADIUS + LID_GAP + 0.0001)
    min_distance = np.where(ring < 0, EYE_RADIUS + 0.0009, min_distance)
    new_distances = np.where(region & (ring <= 8), np.maximum(distance, min_distance), distance)
    moved = EYE_CENTRE + offset / distance[:, None] * new_distances[:, None]
    moved[:, 0] *= sign
    return moved


def _mouth(vertices: Float64, marks: Marks) -> Float64:
    """Return vertices with a wider mouth, whose lips touch along a level line."""
    ring, lip = marks.mouth, marks.lip
    distance = np.hypot(vertices[:, 0] / 1.25, vertices[:, 1] - MOUTH[1])
    weight = np.where(vertices[:, 2] > 0.02, 1 - smoothstep((distance - 0.016) / 0.022), 0.0)
    vertices = vertices.copy()
    vertices[:, 0] *= 1 + 0.11 * weight
    contact = ring == CONTACT_RING
    lines = {}
    for side in (1, -1):
        on_side = np.flatnonzero(contact & (lip == side))
        lines[side] = vertices[on_side[np.argsort(vertices[on_side, 0])]]
    x = vertices[:, 0]
    corner = vertices[contact][np.abs(vertices[contact, 0]).argmax()]
    ends = sorted([corner, corner * (-1.0, 1.0, 1.0)], key=lambda end: float(end[0]))
    for side, line in lines.items():  # both lines end in the corners
        lines[side] = np.concatenate([ends[:1], line, ends[1:]])
    y = {side: np.interp(x, line[:, 0], line[:, 1]) for side, line in lines.items()}
    z = {side: np.interp(x, line[:, 0], line[:, 2]) for side, line in lines.items()}
    fade = np.where(ring == FAR, 0.0, 1 - smoothstep((np.abs(ring - CONTACT_RING) - 1) / 9.0))
    # In the corners, between both lips, the two lines meet, so either can be used.
    label = np.where((lip == 0) & (ring != FAR), 1, lip)
    for side in (1, -1):
        on_side = label == side
        vertices[on_side, 1] += ((MOUTH[1] - y[side]) * fade)[on_side]
        vertices[on_side, 2] += (((z[1] + z[-1]) / 2 - z[side]) * fade)[on_side]
    return vertices


def press_lips(vertices: Float64, marks: Marks) -> Float64:
    """Return vertices of the refined head whose upper lip reaches down behind the lower one.

    So no picture, however small or coarse, shows a gap between closed lips.
    """
    behind = (marks.mouth > 0) & (marks.mouth < CONTACT_RING) & (marks.lip == 1)
    depth = LIP_OVERLAP * (1 - smoothstep((np.abs(vertices[:, 0]) - 0.017) / 0.007))
    vertices = vertices.copy()
    vertices[behind, 1] = np.minimum(vertices[behind, 1], MOUTH[1] - depth[behind])
    return vertices


def thin_lids(vertices: Float64, marks: Marks) -> Float64:
    """Return vertices of the refined head with upper lids as thin as lids are.

    The base's margins are twice as thick, which shows as a rim, and would hang over the lower lids when
    the eyes close.
    """
    left, sign = _both_sides(vertices)
    upper = upper_side(left[:, 0], left[:, 1]) & (marks.eye != FAR) & (left[:, 2] > 0.045)
    offset = left - EYE_CENTRE
    distance = np.linalg.norm(offset, axis=1)
    angle = np.arctan2(offset[:, 1], offset[:, 0])
    margin = upper & (np.abs(marks.eye - MARGIN_RING) < 0.1)
    order = np.argsort(angle[margin])
    inner = np.interp(angle, angle[margin][order], distance[margin][order])
    excess = np.maximum(distance - inner - LID_THICKNESS, 0.0)
    ring = np.where(upper, marks.eye, 0.0)
    share = smoothstep((ring - MARGIN_RING) / 0.5) * (1 - smoothstep((ring - 5.0) / 3.0))
    share *= smoothstep(opening_profile(left[:, 0]) / 0.7)
    moved = left - offset / distance[:, None] * (LID_THINNED * share * excess)[:, None]
    moved[:, 0] *= sign
    return moved


def soften_crease(vertices: Float64, marks: Marks, edges: Int64) -> Float64:
    """Return vertices of the refined head without the hood over the outer third of the upper lids.

    It would stay as a sharp fold when the eyes close. edges: (E, 2) of the refined head.
    """
    left, _ = _both_sides(vertices)
    upper = upper_side(left[:, 0], left[:, 1]) & (marks.eye != FAR)
    ring = np.where(upper, marks.eye, 0.0)
    share = smoothstep((ring - 3.5) / 1.5) * (1 - smoothstep((ring - 13.0) / 3.0))
    share *= smoothstep((left[:, 0] - 0.035) / 0.007)
    both = np.concatenate([edges, edges[:, ::-1]])
    count = np.bincount(both[:, 0], minlength=len(vertices))[:, None]
    for _ in range(CREASE_ROUNDS):
        mean = np.stack(
            [np.bincount(both[:, 0], axis[both[:, 1]], len(vertices)) for axis in vertices.T], axis=1
        )
        vertices = vertices + 0.5 * share[:, None] * (mean / np.maximum(count, 1) - vertices)
    return vertices


def _fuller_lips(vertices: Float64, marks: Marks) -> Float64:
    """Return vertices with the red of the lips a little higher and rounder; the line of contact stays."""
    rings = np.where(marks.mouth == FAR, 0, np.maximum(marks.mouth - CONTACT_RING, 0)).astype(np.float64)
    fade = np.where(rings > 0, np.exp(-(((rings - 3.0) / 2.2) ** 2)), 0.0)
    middle = 1 - smoothstep((np.abs(vertices[:, 0]) - 0.006) / 0.018)
    vertices = vertices.copy()
    lift = np.where(marks.lip > 0, 0.0011, -0.0013)
    vertices[:, 1] += np.where(marks.lip != 0, lift, 0.0) * fade * (0.25 + 0.75 * middle)
    vertices[:, 2] += 0.0008 * fade * middle
    sides = 1 - smoothstep((np.abs(vertices[:, 0]) - 0.008) / 0.014)
    forward = np.interp(marks.mouth, np.arange(len(UPPER_LIP)), UPPER_LIP)
    vertices[:, 2] += np.where(marks.lip > 0, forward * sides, 0.0)
    return vertices


def _nose(vertices: Float64) -> Float64:
    """Return vertices with a finer, lower tip of the nose, so that the nostrils face down, not ahead."""
    tip = np.array([0.0, -0.0385, 0.106])
    distance = np.linalg.norm((vertices - tip) * (0.75, 1.0, 0.8), axis=1)
    weight = 1 - smoothstep((distance - 0.004) / 0.020)
    vertices = vertices.copy()
    vertices[:, 1] -= 0.0024 * weight
    # Narrower, with a flatter front than a ball's.
    vertices[:, 0] *= 1 - 0.10 * weight
    away = np.linalg.norm((vertices - tip)[:, :2], axis=1)
    vertices[:, 2] -= 0.0007 * np.exp(-((away / 0.006) ** 2)) * weight
    return vertices


def _lips(head: Surface, ring: Int64) -> Int64:
    """Return (V,) 1 on and above the upper lip, -1 on and below the lower, 0 elsewhere; from the texture."""
    inside = head.tile == 1
    heights = head.uvs[head.corners][:, :, 1].mean(axis=1)
    faces = inside & (head.vertices[head.quads][:, :, 1] < -0.03).all(axis=1)
    votes = np.zeros(len(head.vertices))
    np.add.at(votes, head.quads[faces].ravel(), np.repeat(np.where(heights[faces] > 0.8065, 1.0, -1.0), 4))
    label = np.where((ring != FAR) & (ring <= 0), np.sign(votes), 0.0)
    for k in range(1, int(ring[ring != FAR].max()) + 1):
        total = np.zeros(len(label))
        for a, b in (head.edges.T, head.edges[:, ::-1].T):
            step = (ring[a] == k) & (ring[b] == k - 1)
            np.add.at(total, a[step], label[b[step]])
        label = np.where(ring == k, np.sign(total), label)
    return label.astype(np.int64)
