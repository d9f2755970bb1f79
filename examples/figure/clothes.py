"""Shirt, trousers and shoes: the figure's own surface, cut along lines, set off and smoothed.

Each garment is given by a function over places of the figure as modelled (arms held off the sides) that is
positive where the garment is; its edge is laid exactly along the line where the function is 0.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import figure
import numpy as np
import numpy.typing as npt

Float64 = npt.NDArray[np.float64]
Int64 = npt.NDArray[np.int64]
Bool = npt.NDArray[np.bool_]

SHIRT = np.array([0.052, 0.088, 0.125])
"""Linear light."""
TROUSERS = np.array([0.040, 0.042, 0.048])
SHOES = np.array([0.055, 0.050, 0.047])
SOLE = np.array([0.45, 0.44, 0.42])
HEM, WAIST, ANKLE = 0.925, 1.015, 0.088
SLEEVE = 0.62
"""How much of the upper arm the sleeve covers."""
SHOULDER, ELBOW = np.array([0.161, 1.401, -0.063]), np.array([0.342, 1.176, -0.051])
AXIS = -0.0137
"""z of the vertical axis of the neck."""
NECKLINE = ((0, 40, 75, 110, 180), (1.4672, 1.4742, 1.4982, 1.5122, 1.5172))
"""Degrees from the front about the neck, and the height of the collar there."""


@dataclass(frozen=True, eq=False)
class Garment:
    """vertices (V, 3), triangles (F, 3), colours (V, 4), source (V,): the figure's vertex that each one
    moves with. covered (figure's vertices,): whether the garment hides it for certain."""

    vertices: Float64
    triangles: Int64
    colours: Float64
    source: Int64
    covered: Bool


def shirt(surface: figure.Surface, arms: Bool) -> Garment:
    """A T-shirt. arms (V,): vertices that the arms move rather than the trunk."""

    def inside(p: Float64) -> Float64:
        turn = np.degrees(np.arctan2(np.abs(p[:, 0]), p[:, 2] - AXIS))
        collar = np.interp(turn, *NECKLINE) - p[:, 1]
        return np.minimum(np.minimum(collar, p[:, 1] - HEM), _sleeve(p))

    sleeve = _sleeve(surface.vertices)
    trunk = ~arms | ((sleeve > -0.02) & (sleeve < 0.29)) | (surface.vertices[:, 1] > 1.3)
    loose = _smooth((1.30 - surface.vertices[:, 1]) / 0.25)
    thick = 0.0042 + 0.0075 * loose * ~arms + 0.005 * arms * _smooth((0.13 - _sleeve(surface.vertices)) / 0.13)
    return _made(surface, inside, trunk, thick, 7, SHIRT, 0.06, slack=0.35 + 0.4 * loose)


def _sleeve(p: Float64) -> Float64:
    """How far places are from the end of the sleeve, towards the shoulder; metres."""
    folded = np.stack([np.abs(p[:, 0]), p[:, 1], p[:, 2]], axis=1)
    arm = ELBOW - SHOULDER
    length = np.linalg.norm(arm)
    along = (folded - SHOULDER) @ (arm / length)
    beyond = (folded[:, 0] > 0.145) & (folded[:, 1] < 1.42) & (folded[:, 1] > 1.08)
    return np.where(beyond, SLEEVE * length - along, 0.3)


def trousers(surface: figure.Surface, arms: Bool) -> Garment:
    """Plain trousers, a little wide below the knee."""

    def inside(p: Float64) -> Float64:
        return np.minimum(WAIST - p[:, 1], p[:, 1] - ANKLE)

    y = surface.vertices[:, 1]
    thick = 0.0035 + 0.0085 * _smooth((0.75 - y) / 0.5) + 0.004 * _smooth((0.35 - y) / 0.25)
    return _made(surface, inside, ~arms, thick, 6, TROUSERS, 0.04, slack=np.full(len(y), 0.45))


def shoes(surface: figure.Surface, arms: Bool) -> Garment:
    """Low shoes: feet with the toes drawn together, on a flat sole."""

    def inside(p: Float64) -> Float64:
        return 0.098 - p[:, 1]

    y = surface.vertices[:, 1]
    thick = np.full(len(y), 0.0050)
    lasted = figure.Surface(_last(surface.vertices), surface.quads, surface.corners, surface.uvs)
    made = _made(lasted, inside, ~arms, thick, 10, SHOES, 0.30, slack=_smooth((0.085 - y) / 0.03) * 0.9)
    v = made.vertices.copy()
    low = _smooth((0.030 - v[:, 1]) / 0.022)
    v[:, 1] = v[:, 1] * (1 - low) + (-0.004) * low * (v[:, 1] < 0.016) + v[:, 1] * low * (v[:, 1] >= 0.016)
    colours = made.colours.copy()
    colours[:, :3] = np.where((v[:, 1] < 0.012)[:, None], SOLE, colours[:, :3])
    return Garment(v, made.triangles, colours, made.source, made.covered)


def _last(vertices: Float64) -> Float64:
    """Feet without single toes: their front swollen to its convex hull."""
    from scipy.spatial import ConvexHull

    vertices = vertices.copy()
    for side in (1.0, -1.0):
        foot = (vertices[:, 0] * side > 0) & (vertices[:, 1] < 0.06) & (vertices[:, 2] > -0.02)
        rows = np.flatnonzero(foot)
        places = vertices[rows]
        hull = ConvexHull(places)
        middle = np.array([places[:, 0].mean(), 0.024, 0.01])
        way = places - middle
        # How far the hull is in each direction: the nearest of its faces.
        facing = way @ hull.equations[:, :3].T
        room = -(hull.equations[:, :3] @ middle + hull.equations[:, 3])
        with np.errstate(divide="ignore"):
            reach = np.where(facing > 1e-9, room / np.maximum(facing, 1e-9), np.inf).min(axis=1)
        share = _smooth((places[:, 2] - 0.01) / 0.05)
        vertices[rows] = middle + way * (1 + (np.clip(reach, 1.0, 4.0) - 1) * share)[:, None]
    return vertices


def _made(
    surface: figure.Surface,
    inside: Callable[[Float64], Float64],
    allowed: Bool,
    thick: Float64,
    rounds: int,
    colour: Float64,
    gloss: float,
    slack: Float64,
) -> Garment:
    value = np.where(allowed, inside(surface.vertices), -1.0)
    faces = (value[surface.quads].mean(axis=1) > 0) & (value[surface.quads] > -0.03).all(axis=1)
    used = np.unique(surface.quads[faces])
    row = np.full(len(surface.vertices), -1)
    row[used] = np.arange(len(used))
    quads = row[surface.quads[faces]]
    vertices = surface.vertices[used].copy()
    outward = _normals(surface)[used]
    cut = figure.Surface(vertices, quads, quads, np.zeros((1, 2)))
    loop = _open_edges(quads)
    rim = np.unique(loop)
    vertices[rim] = _onto_line(vertices[rim], outward[rim], inside)
    edges = cut.edges
    for _ in range(5):
        vertices[rim] = _along(vertices, loop, rim)
        vertices[rim] = _onto_line(vertices[rim], outward[rim], inside)
    free = np.ones(len(vertices))
    free[rim] = 0
    weight = slack[used] * free
    body = vertices.copy()
    for _ in range(rounds):
        outward = _averaged(outward, edges)
        vertices = vertices + (_averaged(vertices, edges) - vertices) * weight[:, None]
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    # Smoothing draws hollows tight; it must not sink into the body.
    sunk = np.minimum(((vertices - body) * outward).sum(axis=1), 0.0)
    vertices = vertices + outward * (thick[used] - sunk)[:, None]
    inner = {vertex: len(vertices) + k for k, vertex in enumerate(rim.tolist())}
    fold = vertices[rim] - outward[rim] * (thick[used][rim] + 0.003)[:, None]
    strip = [[b, a, inner[a]] for a, b in loop.tolist()] + [[b, inner[a], inner[b]] for a, b in loop.tolist()]
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]], np.array(strip)])
    everything = np.concatenate([vertices, fold])
    colours = np.tile([*colour, gloss], (len(everything), 1))
    covered = np.zeros(len(surface.vertices), dtype=bool)
    covered[used] = True
    covered[surface.quads[~faces]] = False
    deep = value > 0.012
    return Garment(everything, triangles, colours, np.concatenate([used, used[rim]]), covered & deep)


def _onto_line(places: Float64, normals: Float64, inside: Callable[[Float64], Float64]) -> Float64:
    """Places moved within the surface to where the function is 0."""
    step = 1e-4
    for _ in range(4):
        value = inside(places)
        slope = np.stack([(inside(places + step * axis) - value) / step for axis in np.eye(3)], axis=1)
        slope -= normals * (slope * normals).sum(axis=1, keepdims=True)
        square = np.maximum((slope**2).sum(axis=1), 0.05)
        move = -(value / square)[:, None] * slope
        length = np.linalg.norm(move, axis=1, keepdims=True)
        places = places + move * np.minimum(1.0, 0.02 / np.maximum(length, 1e-9))
    return places


def _along(vertices: Float64, loop: Int64, rim: Int64) -> Float64:
    """The edge's places, each drawn to the middle of its neighbours on the edge."""
    total, count = np.zeros((len(vertices), 3)), np.zeros((len(vertices), 1))
    for a, b in (loop.T, loop[:, ::-1].T):
        np.add.at(total, a, vertices[b])
        np.add.at(count, a, 1)
    return vertices[rim] * 0.4 + 0.6 * total[rim] / count[rim]


def _open_edges(quads: Int64) -> Int64:
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    _, inverse, counts = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True, return_counts=True)
    return sides[counts[inverse.ravel()] == 1]


def _normals(surface: figure.Surface) -> Float64:
    triangles = np.concatenate([surface.quads[:, [0, 1, 2]], surface.quads[:, [0, 2, 3]]])
    v = surface.vertices
    faces = np.cross(v[triangles[:, 1]] - v[triangles[:, 0]], v[triangles[:, 2]] - v[triangles[:, 0]])
    total = np.zeros_like(v)
    for corner in range(3):
        np.add.at(total, triangles[:, corner], faces)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-20)


def _averaged(values: Float64, edges: Int64) -> Float64:
    total, count = values.copy(), np.ones((len(values), 1))
    for a, b in (edges.T, edges[:, ::-1].T):
        np.add.at(total, a, values[b])
        np.add.at(count, a, 1)
    return total / count


def _smooth(value: Float64) -> Float64:
    t = np.clip(value, 0.0, 1.0)
    return t * t * (3 - 2 * t)
