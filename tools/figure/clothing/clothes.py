"""Shirt and trousers: the figure's own surface, cut along lines, moved outwards and smoothed.

Each garment is given by a function over points of the figure as modelled (arms held off the sides) that is
positive where the garment is; its edge is the line where the function is 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.spatial import cKDTree

from fba.arrays import Bool, Float64, Int64
from fba.body import Skeleton
from fba.mesh import vertex_normals
from fba.rotations import unit
from fba.sampling import smoothstep
from tools.figure.cutting import MIDLINE, Cloth
from tools.figure.person import Person

EdgeDistance = Callable[[Float64, Float64], Float64]

_NAMES = list(Skeleton.default().names)
MIRROR = np.array([_NAMES.index({"l_": "r_", "r_": "l_"}.get(n[:2], n[:2]) + n[2:]) for n in _NAMES])
"""For each joint the number of its mate on the other side."""
SHIRT = np.array([0.052, 0.088, 0.125])
"""Linear light."""
TROUSERS = np.array([0.054, 0.059, 0.070])
INSIDE = 1.7
"""Brightness of the inside of clothes and of their rims, relative to the cloth: little light gets there."""
HEM, RISE, WAIST = 0.910, 0.012, 0.982
"""Height of the shirt's hem in front and behind, how much higher it is at the sides, and the waistband's."""
DRAPE = ((4.0, 0.4, 0.0036), (7.0, 1.9, 0.0016))
"""Waves of the shirt about its hem: how many on half a turn, where they begin in radians, and metres."""
TURN_UP = (0.073, 0.45)
"""Height of the trousers' hem below the middle of the ankle, and how it rises to the front."""
SLEEVE = 0.62
"""Share of the upper arm that the sleeve covers."""
SHOULDER, ELBOW = np.array([0.161, 1.401, -0.063]), np.array([0.342, 1.176, -0.051])
LEG = -0.10
"""z of the middle of the ankle."""
BELLY = -0.045
"""z of the upright axis of the belly."""
AXIS = -0.0137
"""z of the vertical axis of the neck."""
NECKLINE = (
    (-75, -40, 0, 40, 75, 110, 180, 250),
    (1.4982, 1.4762, 1.4652, 1.4762, 1.4982, 1.5122, 1.5172, 1.5122),
)
"""Degrees from the front about the neck, and the height of the collar there."""
FOLD, DEEP = 0.003, 0.022
"""Metres by which the inside of an edge reaches below the skin, and back under the cloth."""
LONGEST, REFINED = 0.024, 2
"""Metres to which edges of the cloth are halved, so that outlines are round, and how often at most."""
NEAREST = 4
"""Vertices of the cloth from which what is folded in under them has its weights."""
HEMMED, STITCHED = 0.0018, 0.0006
"""Metres by which cloth stands out where it is doubled along an edge, and by which stitches draw it in."""
ROUNDED = ((0.0012, -0.0003), (0.0021, -0.0014), (0.0020, -0.0028))
"""Rows that round an edge: metres beyond it, and outwards."""
LEANING = (1.6, 1.4, 1.1, 0.8)
"""Shares of outwards to beyond in the normals of these rows and of what is folded in.

Surfaces that face the limb would be nearly black, and a dark rim narrower than a pixel looks jagged.
"""


@dataclass(frozen=True, eq=False)
class Garment:
    """A garment: vertices (V, 3), triangles (F, 3), colours (V, 4), weights (V, J).

    covered: depth of each vertex of the person under the garment, metres; negative where it is free.
    inside (V,): mask of vertices folded in at an edge, which is a crease. within (V,): metres from the edge.
    facing (V, 3): normals along an edge; 0 elsewhere, where the surface has its own.
    places (V, 2): of vertices in `picture`, a JPEG file, 0..1 from its left and upper edge.
    """

    vertices: Float64
    triangles: Int64
    colours: Float64
    weights: Float64
    covered: Float64
    inside: Bool
    within: Float64
    facing: Float64
    places: Float64 | None = None
    picture: bytes | None = None


@dataclass(frozen=True, eq=False)
class Body:
    """The person that garments are made from. weights: (V, J) of its vertices."""

    person: Person
    weights: Float64


def depth_below_collar(p: Float64) -> Float64:
    """Return (N,) metres by which points (N, 3) are below the collar."""
    turn = np.degrees(np.arctan2(np.abs(p[:, 0]), p[:, 2] - AXIS))
    return PchipInterpolator(*NECKLINE)(turn) - p[:, 1]


def length_inside_sleeve(p: Float64) -> Float64:
    """Return (N,) metres from the end of the sleeve to points (N, 3), towards the shoulder."""
    folded = np.stack([np.abs(p[:, 0]), p[:, 1], p[:, 2]], axis=1)
    arm = ELBOW - SHOULDER
    length = np.linalg.norm(arm)
    return SLEEVE * length - (folded - SHOULDER) @ (arm / length)


def height_above_hem(p: Float64) -> Float64:
    """Return (N,) metres by which points (N, 3) are above the trousers' hem."""
    return p[:, 1] - TURN_UP[0] - TURN_UP[1] * np.clip(p[:, 2] - LEG, -0.05, 0.09)


def height_above_shirt_hem(p: Float64) -> Float64:
    """Return (N,) metres by which points (N, 3) are above the shirt's hem."""
    x, z = p[:, 0], p[:, 2] - BELLY
    return p[:, 1] - HEM - RISE * x**2 / np.maximum(x**2 + z**2, 1e-9)


def _drape(p: Float64) -> Float64:
    """Return (N,) metres by which a shirt that hangs stands off more or less at points (N, 3)."""
    turn = np.arctan2(np.abs(p[:, 0]), p[:, 2] - BELLY)
    waves = sum(high * np.cos(number * turn + start) for number, start, high in DRAPE)
    return waves * smoothstep((HEM + 0.16 - p[:, 1]) / 0.14)


def make_shirt(body: Body) -> Garment:
    """Return a T-shirt."""
    p = body.person.vertices
    arms = body.person.arms > 0.5

    def edge_distance(points: Float64, kind: Float64) -> Float64:
        ends = length_inside_sleeve(points), depth_below_collar(points), height_above_shirt_hem(points)
        return np.choose(kind.astype(int), ends)

    # On an arm only the sleeve's plane counts: the hem's and the collar's would cut it, and it the trunk.
    kind = np.where(arms, 0, np.where(p[:, 1] > 1.25, 1, 2))
    loose = smoothstep((1.30 - p[:, 1]) / 0.25)
    collar = ~arms * smoothstep(1 - depth_below_collar(p) / 0.05) * (p[:, 1] > 1.25)
    below = np.maximum(-vertex_normals(p, body.person.triangles)[:, 1], 0.0)  # cloth hangs under an arm
    thick = (
        0.0042
        + (0.0075 * loose + _drape(p)) * ~arms
        + 0.0026 * collar  # a bent neck must stay below it
        + (0.0040 + 0.0055 * below) * arms * smoothstep((0.13 - length_inside_sleeve(p)) / 0.13)
    )
    slack = 0.5 + np.where(arms, 0.3, 0.4 * loose)
    return _make_garment(body, edge_distance, kind, thick, slack, 14, SHIRT, 0.014)


def make_trousers(body: Body) -> Garment:
    """Return plain trousers, a little wide below the knee."""
    p = body.person.vertices

    def edge_distance(points: Float64, kind: Float64) -> Float64:
        ends = np.full(len(points), -1.0), WAIST - points[:, 1], height_above_hem(points)
        return np.choose(kind.astype(int), ends)

    kind = np.where(body.person.arms > 0.3, 0, np.where(p[:, 1] > 0.6, 1, 2))
    below = smoothstep((0.86 - p[:, 1]) / 0.5)
    thick = (
        0.0010
        + 0.0025 * smoothstep((0.95 - p[:, 1]) / 0.05)
        + 0.0085 * below
        + 0.0085 * smoothstep((0.19 - p[:, 1]) / 0.10)  # over the shoe
    )
    return _make_garment(body, edge_distance, kind, thick, 0.5 + 0.35 * below, 10, TROUSERS, 0.016)


def _make_garment(
    body: Body,
    edge_distance: EdgeDistance,
    kind: Float64,
    thick: Float64,
    slack: Float64,
    rounds: int,
    colour: Float64,
    band: float,
) -> Garment:
    """Return the garment where edge_distance(points, kind), the distance to its edge, is positive.

    kind (V,): number of the edge that applies. thick (V,): metres off the skin. slack (V,): share by which
    hollows are smoothed over. band: width of a darker band along the edges, metres.
    """
    surface, triangles = body.person, body.person.triangles
    normals = vertex_normals(surface.vertices, triangles).astype(np.float64)
    value = edge_distance(surface.vertices, kind)
    values = np.stack([value, kind, thick, slack], axis=1)
    cloth = Cloth(surface.vertices, normals, body.weights, values, triangles).cut_above(value)
    cloth, _ = cloth.split(cloth.values[:, 0] - band)
    free = np.ones(len(cloth.vertices))
    free[np.unique(cloth.border)] = 0
    outward = cloth.smooth_rows(cloth.normals, np.ones(len(free)), rounds)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    vertices = cloth.smooth_rows(cloth.vertices, cloth.values[:, 3] * free, rounds)
    # Smoothing must not sink the cloth into the body.
    sunk = np.minimum(((vertices - cloth.vertices) * outward).sum(axis=1), 0.0)
    vertices = vertices + outward * (cloth.values[:, 2] - sunk)[:, None]
    values = np.concatenate([cloth.values[:, :3], cloth.vertices[:, :1], outward], axis=1)
    normals = vertex_normals(vertices, cloth.triangles).astype(np.float64)
    cloth = Cloth(vertices, normals, cloth.weights, values, cloth.triangles)
    for _ in range(REFINED):
        cloth = cloth.refine(LONGEST)
    return _hem(cloth, edge_distance, value, colour, band)


def _hem(
    cloth: Cloth, edge_distance: EdgeDistance, covered: Float64, colour: Float64, band: float
) -> Garment:
    """Return the garment of a cloth, with its edges evened, doubled, rounded and folded in.

    values (V, 7) of the cloth: distance to the edge, which edge, metres off the skin, x as modelled, which
    tells the halves apart, and directions outwards. covered: as of `Garment`. Others: as for `_make_garment`.
    """
    thickness, side, outward = cloth.values[:, 2], cloth.values[:, 3], unit(cloth.values[:, 4:])
    kinds = np.rint(cloth.values[:, 1])
    lines = np.unique(cloth.border), np.flatnonzero(np.abs(cloth.values[:, 0] - band) < 1e-9)
    rim = lines[0]
    vertices = _even_rim(cloth.vertices, cloth.border, rim)
    for rows, level in zip(lines, (0.0, band), strict=True):
        vertices[rows] = _move_onto_edge(
            vertices[rows], level, lambda p, rows=rows: edge_distance(p, kinds[rows])
        )
    vertices[rim] += outward[rim] * HEMMED
    vertices[lines[1]] -= outward[lines[1]] * STITCHED
    # The edge is rounded, and folded in below the skin.
    beyond = vertices[rim] - _move_onto_edge(
        vertices[rim], 0.001, lambda p: edge_distance(p, kinds[rim])
    )  # a millimetre away from the cloth
    beyond /= np.maximum(np.linalg.norm(beyond, axis=1, keepdims=True), 1e-9)
    rows = [vertices[rim] + along * beyond + out * outward[rim] for along, out in ROUNDED]
    rows.append(vertices[rim] - DEEP * beyond - outward[rim] * (thickness[rim] + HEMMED + FOLD)[:, None])
    count = len(rim)
    place = {vertex: len(vertices) + k for k, vertex in enumerate(rim.tolist())}
    loop = np.array([[a, b, place[a], place[b]] for a, b in cloth.border.tolist()])
    strips = []
    for row in range(len(rows)):
        a, b = loop[:, :2].T if row == 0 else loop[:, 2:].T + count * (row - 1)
        c, d = loop[:, 2:].T + count * row
        strips += [np.stack([b, a, c], axis=1), np.stack([b, c, d], axis=1)]
    faces = np.concatenate([cloth.triangles, *strips])
    # Coarser meshes keep where shades meet: along the rim, which has the normals of the cloth.
    inner = np.arange(len(faces)) >= len(cloth.triangles)
    # What is folded in moves with the cloth over it, or it would come out where that bends.
    over = cloth.weights[cKDTree(vertices).query(rows[-1], k=NEAREST)[1]].mean(axis=1)
    weights = np.concatenate([cloth.weights, *[cloth.weights[rim]] * len(ROUNDED), over])
    everything = np.concatenate([vertices, *rows])
    facing = [unit(beyond + share * outward[rim]) for share in LEANING]
    turned = np.concatenate([np.zeros_like(vertices), *facing])
    across = np.concatenate([cloth.values[:, 0], *[cloth.values[rim, 0]] * len(rows)])
    shade = np.where(inner, INSIDE, 1.0)
    side = np.concatenate([side, *[side[rim]] * len(rows)])
    values = np.concatenate([weights, across[:, None], turned], axis=1)
    everything, values, faces, shade = _mirror(everything, values, faces, shade, side)
    everything, values, faces, tone = _split_by_shade(everything, values, faces, shade)
    weights, within, facing = values[:, :-4], values[:, -4], values[:, -3:]
    inside = facing.any(axis=1)
    tone[~inside] = 1.0
    colours = np.concatenate([tone[:, None] * colour, np.full((len(tone), 1), 0.06)], axis=1)
    return Garment(everything, faces, colours, weights, covered, inside, within, facing)


def _move_onto_edge(positions: Float64, level: float, edge_distance: Callable[[Float64], Float64]) -> Float64:
    """Return points (N, 3) moved to where edge_distance(points) is exactly `level`."""
    step = 1e-4
    for _ in range(4):
        value = edge_distance(positions) - level
        slope = np.stack(
            [(edge_distance(positions + step * axis) - level - value) / step for axis in np.eye(3)], axis=1
        )
        move = -(value / np.maximum((slope**2).sum(axis=1), 0.25))[:, None] * slope
        length = np.linalg.norm(move, axis=1, keepdims=True)
        positions = positions + move * np.minimum(1.0, 0.02 / np.maximum(length, 1e-9))
    return positions


def _even_rim(vertices: Float64, border: Int64, rim: Int64) -> Float64:
    """Return vertices with the rim smoothed, alternating inwards and outwards so that it does not shrink."""
    vertices = vertices.copy()
    count = np.bincount(border.ravel(), minlength=len(vertices))[:, None]
    for share in (0.5, -0.52) * 14:
        total = np.zeros_like(vertices)
        for a, b in (border.T, border[:, ::-1].T):
            np.add.at(total, a, vertices[b])
        vertices[rim] += share * (total[rim] / count[rim] - vertices[rim])
    return vertices


def _mirror(
    vertices: Float64, weights: Float64, faces: Int64, shade: Float64, side: Float64
) -> tuple[Float64, Float64, Int64, Float64]:
    """Return the left half and its mirror image. side (V,): x of the vertices before smoothing.

    weights (V, J + N): of the joints, values that are the same on both sides, and a direction.
    """
    half = (side[faces] > -MIDLINE).all(axis=1)
    used, left = np.unique(faces[half], return_inverse=True)
    left = left.reshape(-1, 3)
    middle = np.abs(side[used]) < MIDLINE
    positions, carried = vertices[used].copy(), weights[used].copy()
    other = carried.copy()
    other[:, : len(MIRROR)] = carried[:, MIRROR]
    other[:, -3] *= -1.0
    positions[middle, 0] = 0.0
    carried[middle] = (carried[middle] + other[middle]) / 2
    number = np.arange(len(used))
    number[~middle] = len(used) + np.arange((~middle).sum())
    return (
        np.concatenate([positions, positions[~middle] * (-1.0, 1.0, 1.0)]),
        np.concatenate([carried, other[~middle]]),
        np.concatenate([left, number[left][:, ::-1]]),
        np.tile(shade[half], 2),
    )


def _split_by_shade(
    vertices: Float64, weights: Float64, faces: Int64, shade: Float64
) -> tuple[Float64, Float64, Int64, Float64]:
    """Return the mesh with vertices doubled where shades meet; the last array is each vertex's shade."""
    pairs = np.stack([faces.ravel(), np.repeat(np.unique(shade, return_inverse=True)[1], 3)], axis=1)
    unique, number = np.unique(pairs, axis=0, return_inverse=True)
    rows = unique[:, 0]
    return vertices[rows], weights[rows], number.reshape(-1, 3), np.unique(shade)[unique[:, 1]]
