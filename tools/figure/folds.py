"""Folds, seams and shades of cloth: drawn on tubes unrolled about trunk, arms and legs.

The wide ones also move the garment's vertices; all of them are painted, as light from above shows them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from clothes import (
    ELBOW,
    HEM,
    SHOULDER,
    Garment,
    depth_below_collar,
    height_above_hem,
    length_inside_sleeve,
)
from hair import noise
from paint import encode_linear, make_chart
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

from fba.arrays import Float64, Int64
from fba.body import Skeleton
from fba.mesh import vertex_normals
from fba.rotations import unit
from fba.sampling import smoothstep

NAMES = list(Skeleton.default().names)
ARMHOLE = 0.163
"""Metres from the middle at which a sleeve is sewn on."""
SIZE = 1024
"""Texels of the picture along each side."""
DENSITY = 900
"""Of them for each metre."""
PAD = 0.035
"""Metres by which an unrolled tube is drawn beyond its ends and its seam."""
WHITE = 0.60
"""Linear light of flat cloth in the picture; the colours of vertices are divided by it."""
LIGHT = (0.22, 0.62, 0.75)
"""Towards the light by which folds are painted: sideways, up and outwards."""
STEEP = 0.62
"""Greatest slope of a painted fold."""
WIDER, HIGHER = 1.5e-3, 1.35e-3
"""Metres of a millimetre in the tables of folds."""
SHARPER = 0.6
"""Width of a fold below its crest, as a share of that above it."""
MOVED, MOST = 0.008, (-0.0016, 0.0075)
"""Metres over which folds are smoothed to move vertices, and bounds of that."""
JITTER, STRENGTHS = 0.009, (0.65, 1.25)
"""Metres by which points of folds differ from side to side, and factors of their heights."""
STITCH = 0.0011
"""Half the width of a line of stitches or of a seam, metres."""

Stroke = tuple[tuple[tuple[float, float], ...], float, float]
"""Points of a fold (around, along), metres; its half width and its height, millimetres."""
TRUNK_FOLDS: tuple[Stroke, ...] = (
    # from the armpit over the chest, then over the back
    (((0.205, 0.200), (0.150, 0.180), (0.090, 0.190)), 8, 2.2),
    (((0.205, 0.220), (0.150, 0.225), (0.080, 0.250)), 9, 2.4),
    (((0.210, 0.240), (0.165, 0.270), (0.105, 0.320)), 10, 2.4),
    (((0.220, 0.255), (0.190, 0.310), (0.150, 0.380)), 10, 2.2),
    (((0.170, 0.190), (0.150, 0.140), (0.120, 0.100)), 8, 1.6),
    (((0.265, 0.200), (0.320, 0.190), (0.385, 0.200)), 9, 2.2),
    (((0.260, 0.225), (0.320, 0.240), (0.395, 0.275)), 10, 2.4),
    (((0.255, 0.250), (0.300, 0.300), (0.365, 0.360)), 10, 2.2),
    (((0.290, 0.180), (0.330, 0.140), (0.400, 0.120)), 8, 1.4),
    # bunched at the waist
    (((0.110, 0.418), (0.190, 0.440), (0.260, 0.428), (0.330, 0.440)), 9, 3.2),
    (((0.060, 0.470), (0.130, 0.455), (0.210, 0.478), (0.290, 0.462)), 9, 3.4),
    (((0.200, 0.508), (0.260, 0.492), (0.340, 0.500), (0.430, 0.482)), 9, 3.4),
    (((0.080, 0.515), (0.140, 0.502), (0.200, 0.530), (0.260, 0.540)), 8, 2.8),
    (((0.285, 0.540), (0.350, 0.532), (0.430, 0.545)), 8, 2.6),
    (((0.360, 0.430), (0.410, 0.455), (0.465, 0.450)), 9, 2.4),
    (((0.000, 0.500), (0.040, 0.492), (0.085, 0.488)), 7, 1.4),
    # falling from chest and blades
    (((0.085, 0.270), (0.100, 0.370), (0.085, 0.470)), 15, 1.6),
    (((0.150, 0.390), (0.155, 0.470), (0.135, 0.570)), 13, 1.8),
    (((0.030, 0.330), (0.025, 0.430), (0.040, 0.560)), 14, 1.1),
    (((0.380, 0.270), (0.370, 0.360), (0.395, 0.440)), 15, 1.6),
    (((0.235, 0.300), (0.240, 0.360), (0.225, 0.420)), 12, 1.5),
    # between the collar and the shoulder
    (((0.060, 0.090), (0.085, 0.130), (0.100, 0.180)), 9, 1.0),
)  # fmt: skip
SLEEVE_FOLDS: tuple[Stroke, ...] = (
    (((-0.050, 0.055), (0.000, 0.085), (0.050, 0.085)), 8, 2.2),
    (((-0.055, 0.080), (-0.020, 0.115), (0.030, 0.130)), 8, 2.4),
    (((-0.100, 0.060), (-0.140, 0.090), (-0.175, 0.090)), 8, 2.2),
    (((-0.100, 0.090), (-0.130, 0.125), (-0.175, 0.135)), 8, 2.2),
    (((0.060, 0.030), (0.085, 0.080), (0.080, 0.130)), 11, 1.6),
    (((0.120, 0.040), (0.125, 0.090), (0.140, 0.130)), 11, 1.6),
    (((-0.075, 0.100), (-0.070, 0.140), (-0.080, 0.175)), 9, 1.8),
)  # fmt: skip
LEG_FOLDS: tuple[Stroke, ...] = (
    # from the crotch towards the hip, and below the seat
    (((-0.105, 0.122), (-0.050, 0.100), (0.020, 0.060)), 7, 1.8),
    (((-0.110, 0.140), (-0.050, 0.130), (0.040, 0.100)), 8, 2.4),
    (((-0.112, 0.158), (-0.060, 0.165), (0.010, 0.150)), 8, 2.4),
    (((-0.115, 0.180), (-0.070, 0.205), (-0.020, 0.215)), 9, 2.2),
    (((0.040, 0.140), (0.090, 0.118), (0.130, 0.110)), 9, 1.6),
    (((-0.185, 0.170), (-0.215, 0.182), (-0.270, 0.176), (-0.320, 0.160)), 9, 2.6),
    (((-0.175, 0.200), (-0.205, 0.220), (-0.260, 0.226)), 9, 2.0),
    (((-0.170, 0.235), (-0.190, 0.280), (-0.195, 0.330)), 11, 1.6),
    # falling along the thigh
    (((-0.020, 0.230), (0.005, 0.310), (-0.010, 0.390)), 15, 1.6),
    (((0.120, 0.200), (0.105, 0.290), (0.115, 0.380)), 15, 1.4),
    (((0.200, 0.250), (0.215, 0.330), (0.225, 0.400)), 14, 1.4),
    # behind and above the knee
    (((0.155, 0.440), (0.215, 0.452), (0.290, 0.440)), 7, 3.0),
    (((0.175, 0.470), (0.235, 0.462), (0.310, 0.478)), 7, 3.4),
    (((0.160, 0.495), (0.225, 0.505), (0.300, 0.495)), 7, 3.2),
    (((0.190, 0.525), (0.245, 0.520), (0.300, 0.532)), 7, 2.4),
    (((-0.105, 0.430), (-0.055, 0.445), (0.000, 0.432)), 9, 1.6),
    (((0.110, 0.435), (0.060, 0.455), (0.015, 0.455)), 9, 1.6),
    (((-0.100, 0.505), (-0.055, 0.530), (-0.010, 0.545)), 9, 1.6),
    (((0.105, 0.510), (0.065, 0.540), (0.020, 0.560)), 9, 1.6),
    # falling to the ankle, and bunched on it
    (((0.015, 0.570), (0.000, 0.650), (0.020, 0.740)), 14, 1.6),
    (((0.130, 0.560), (0.150, 0.660), (0.130, 0.750)), 14, 1.6),
    (((-0.120, 0.580), (-0.130, 0.670), (-0.105, 0.750)), 14, 1.6),
    (((0.240, 0.570), (0.255, 0.670), (0.240, 0.760)), 13, 1.6),
    (((-0.150, 0.775), (-0.080, 0.755), (0.000, 0.778), (0.060, 0.762)), 9, 3.0),
    (((-0.060, 0.812), (0.010, 0.798), (0.090, 0.815), (0.150, 0.800)), 9, 3.6),
    (((0.080, 0.770), (0.150, 0.752), (0.215, 0.765), (0.270, 0.752)), 9, 3.0),
    (((-0.170, 0.830), (-0.100, 0.815), (-0.040, 0.842)), 9, 3.2),
    (((0.020, 0.850), (0.080, 0.842), (0.150, 0.855)), 8, 2.8),
    (((0.160, 0.810), (0.230, 0.822), (0.300, 0.805), (0.350, 0.815)), 9, 3.0),
    (((-0.240, 0.790), (-0.190, 0.802), (-0.140, 0.795)), 9, 2.4),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Tube:
    """Cloth around a limb, unrolled: from `start` to `end`, points (3,), of a radius in metres.

    place: of its middle above, in texels of the picture. side: 1 left or in the middle, -1 mirrored. bow:
    metres by which its middle is before the line between both ends. higher: factor of the heights of its
    folds. whole: that they lie on both sides.
    """

    start: Float64
    end: Float64
    radius: float
    length: float
    folds: tuple[Stroke, ...]
    place: tuple[float, float]
    side: float = 1.0
    bow: float = 0.0
    higher: float = 1.0
    whole: bool = False

    @property
    def turn(self) -> float:
        """Metres around it."""
        return 2 * np.pi * self.radius

    def unroll(self, p: Float64) -> Float64:
        """Return (..., 2) metres around, from the front outwards, and along, for points (..., 3)."""
        axis = unit(self.end - self.start)
        front = unit(np.array([0.0, 0.0, 1.0]) - axis[2] * axis)
        away = p * (self.side, 1.0, 1.0) - self.start
        across = np.cross(front, axis)
        across *= np.sign(across[0])
        share = np.clip(away @ axis / self.length, 0, 1)
        away = away - (4 * self.bow * share * (1 - share))[..., None] * front
        return np.stack([np.arctan2(away @ across, away @ front) * self.radius, away @ axis], axis=-1)

    def corners(self, corners: Float64) -> Float64:
        """Return (F, 3, 2) as `unroll`, for the corners of triangles (F, 3, 3), unbroken."""
        flat = self.unroll(corners)
        flat[:, 1:, 0] -= self.turn * np.rint((flat[:, 1:, 0] - flat[:, :1, 0]) / self.turn)
        flat[..., 0] -= self.turn * np.rint(flat[..., 0].mean(axis=1, keepdims=True) / self.turn)
        return flat

    def texels(self, flat: Float64) -> Float64:
        """Return places (..., 2) in the picture, of places (..., 2) on the tube."""
        return flat * (self.side * DENSITY, DENSITY) + self.place

    def heights(self, random: np.random.Generator | None) -> Float64:
        """Return (H, W) metres by which folds raise the cloth. random: None for the same on both sides."""
        around, along = self._grid()
        raised = np.zeros(around.shape)
        for sign in (1, -1) if self.whole else (1,):
            for points, width, height in self.folds:
                knots = np.array(points) * (sign, 1.0)
                strength = 1.0
                if random is not None:
                    knots = knots + random.uniform(-JITTER, JITTER, knots.shape)
                    strength = random.uniform(*STRENGTHS)
                for shift in (-self.turn, 0.0, self.turn):
                    _raise(
                        raised,
                        around,
                        along,
                        knots + np.array([shift, 0.0]),
                        WIDER * width,
                        strength * self.higher * HIGHER * height,
                    )
        return raised

    def _grid(self) -> tuple[Float64, Float64]:
        wide = np.arange(-self.turn / 2 - PAD, self.turn / 2 + PAD, 1 / DENSITY)
        return np.meshgrid(wide, np.arange(-PAD, self.length + PAD, 1 / DENSITY))

    def sample(self, field: Float64, flat: Float64) -> Float64:
        """Return (N,) a field of `heights` at places (N, 2) on the tube."""
        row, column = (flat[:, 1] + PAD) * DENSITY, (flat[:, 0] + self.turn / 2 + PAD) * DENSITY
        return map_coordinates(field, [row, column], order=1, mode="nearest")


def _raise(
    raised: Float64, around: Float64, along: Float64, knots: Float64, width: float, height: float
) -> None:
    """Add a fold along points (N, 2), in place: gentle above its crest, steep below, pointed at its ends."""
    share = np.linspace(0, 1, 160)
    at = share * (len(knots) - 1)
    first = np.minimum(at.astype(int), len(knots) - 2)
    path = knots[first] + (at - first)[:, None] * (knots[first + 1] - knots[first])
    path = gaussian_filter(path, (14, 0), mode="nearest")
    near = (np.abs(around - path[:, 0].mean()) < np.ptp(path[:, 0]) / 2 + 4 * width) & (
        np.abs(along - path[:, 1].mean()) < np.ptp(path[:, 1]) / 2 + 4 * width
    )
    if not near.any():
        return
    places = np.stack([around[near], along[near]], axis=1)
    away, row = cKDTree(path).query(places)
    below = places[:, 1] > path[row, 1]
    level = np.ptp(path[:, 0]) > np.ptp(path[:, 1])  # upright folds are the same on both sides
    wide = width * np.where(below & level, SHARPER, 1.0)
    raised[near] += (
        height * np.sin(np.pi * np.clip(share[row], 0.02, 0.98)) ** 0.8 * np.exp(-((away / wide) ** 2))
    )


def trunk_and_sleeves() -> tuple[Tube, ...]:
    """Return the tubes of the shirt: the trunk, the left and the right sleeve."""
    above = np.array([0, 1.53, -0.035])
    return (
        Tube(above, above - (0, 0.63, 0), 0.15, 0.62, TRUNK_FOLDS, (512, 40), whole=True),
        Tube(SHOULDER, ELBOW, 0.056, 0.20, SLEEVE_FOLDS, (230, 740)),
        Tube(SHOULDER, ELBOW, 0.056, 0.20, SLEEVE_FOLDS, (794, 740), -1.0),
    )  # fmt: skip


def legs() -> tuple[Tube, ...]:
    """Return the tubes of the trousers: the left and the right leg."""
    hip, ankle = np.array([0.072, 0.99, -0.045]), np.array([0.155, 0.08, -0.100])
    return (
        Tube(hip, ankle, 0.080, 0.93, LEG_FOLDS, (256, 45), bow=0.055, higher=1.6),
        Tube(hip, ankle, 0.080, 0.93, LEG_FOLDS, (768, 45), -1.0, 0.055, 1.6),
    )


def sew(name: str, garment: Garment) -> Garment:
    """Return a garment with its folds and its picture; shoes as they are."""
    if name == "shoes":
        return garment
    middle = garment.vertices[garment.triangles].mean(axis=1)
    left = middle[:, 0] > 0
    if name == "trousers":
        return fold(garment, legs(), np.where(left, 0, 1), _trouser_seams)
    arm = garment.weights[
        :, [NAMES.index(f"{side}_{joint}") for side in "lr" for joint in ("shoulder", "elbow")]
    ]
    sleeve = arm.sum(axis=1)[garment.triangles].mean(axis=1) > 0.5
    return fold(garment, trunk_and_sleeves(), np.where(sleeve, np.where(left, 1, 2), 0), _shirt_seams)


def _shirt_seams(p: Float64, tube: int) -> Float64:
    """Return (N,) metres from points (N, 3) to the nearest stitches of the shirt."""
    if tube:
        return np.minimum(np.abs(length_inside_sleeve(p) - 0.018), np.abs(_beyond_armhole(p) - ARMHOLE))
    lines = (
        np.abs(depth_below_collar(p) - 0.016),
        np.abs(p[:, 1] - HEM - 0.020),
        np.abs(_beyond_armhole(p) - ARMHOLE),
    )
    return np.min(lines, axis=0)


def _beyond_armhole(p: Float64) -> Float64:
    """Return (N,) metres from the armhole outwards; far where points (N, 3) are below it."""
    return np.where(p[:, 1] > 1.29, np.abs(p[:, 0]) - ARMHOLE, 1.0)


def _trouser_seams(p: Float64, tube: int) -> Float64:
    """Return (N,) metres from points (N, 3) to the nearest seams and stitches of the trousers."""
    around, along = legs()[tube].unroll(p).T
    sides = np.abs(around - legs()[tube].turn / 4)
    inner = np.where(along > 0.16, np.abs(around + legs()[tube].turn / 4), 1.0)
    pocket = np.where((along < 0.16) & (along > 0.01), np.abs(around - 0.055 - 0.42 * along), 1.0)
    fly = np.where((p[:, 2] > 0) & (along < 0.15), np.abs(p[:, 0]), 1.0)
    return np.min([sides, inner, pocket, fly, np.abs(height_above_hem(p) - 0.022)], axis=0)


def fold(
    garment: Garment, tubes: tuple[Tube, ...], own: Int64, edges: Callable[[Float64, int], Float64]
) -> Garment:
    """Return the garment with folds and its picture.

    own (F,): the tube that each triangle is on. edges(points, tube): metres (N,) from seams and stitches.
    """
    flat = np.zeros((len(garment.triangles), 3, 2))
    moved = np.zeros(len(garment.vertices))
    for number, tube in enumerate(tubes):
        mine = own == number
        flat[mine] = tube.corners(garment.vertices[garment.triangles[mine]])
        wide = gaussian_filter(tube.heights(None), MOVED * DENSITY)
        corners = garment.triangles[mine].ravel()
        moved[corners] = np.clip(tube.sample(wide, flat[mine].reshape(-1, 2)), *MOST)
    normals = vertex_normals(garment.vertices, garment.triangles).astype(np.float64)
    moved *= smoothstep((garment.within - 0.004) / 0.03)
    folded = replace(garment, vertices=garment.vertices + normals * moved[:, None])
    texels = np.zeros_like(flat)
    for number, tube in enumerate(tubes):
        texels[own == number] = tube.texels(flat[own == number])
    places = texels / SIZE
    picture = _paint(garment, tubes, own, places, edges)
    keys = np.concatenate(
        [garment.triangles.reshape(-1, 1), np.rint(places.reshape(-1, 2) * SIZE * 64)], axis=1
    )
    unique, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    rows = unique[:, 0].astype(int)
    folded.colours[:, :3] /= WHITE
    return replace(
        folded,
        vertices=folded.vertices[rows],
        triangles=number.reshape(-1, 3),
        colours=folded.colours[rows],
        weights=folded.weights[rows],
        inside=folded.inside[rows],
        within=folded.within[rows],
        facing=folded.facing[rows],
        places=places.reshape(-1, 2)[first],
        picture=picture,
    )


def _paint(
    garment: Garment,
    tubes: tuple[Tube, ...],
    own: Int64,
    places: Float64,
    edges: Callable[[Float64, int], Float64],
) -> bytes:
    """Return the picture: cloth as light from above shows its folds, darker along seams."""
    image = np.full((SIZE, SIZE), WHITE)
    random = np.random.default_rng(5)
    for number, tube in enumerate(tubes):
        shown = (own == number) & ~garment.inside[garment.triangles].all(axis=1)
        corners = garment.triangles[shown]
        uvs = np.stack([places[shown][..., 0], 1 - places[shown][..., 1]], axis=-1)
        chart = make_chart(garment.vertices, np.zeros((len(garment.vertices), 0)), corners, uvs, SIZE)
        p = chart.positions_at[chart.known]
        row, column = np.nonzero(chart.known)
        flat = (np.stack([column, row], axis=1) - tube.place) / DENSITY * (tube.side, 1.0)
        raised = gaussian_filter(tube.heights(random), 1.0)
        steep_along, steep_around = np.gradient(raised, 1 / DENSITY)
        slope = np.hypot(steep_along, steep_around)
        less = STEEP * np.tanh(slope / STEEP) / np.maximum(slope, 1e-6)
        towards = LIGHT[2] + LIGHT[1] * steep_along * less - LIGHT[0] * tube.side * steep_around * less
        shown = towards / np.hypot(1.0, slope * less) / LIGHT[2]
        hollow = np.clip((raised - gaussian_filter(raised, 0.012 * DENSITY)) / 0.0015, -1, 1)
        shade = tube.sample(np.clip(shown, 0.35, 1.5) * (1 + 0.10 * hollow), flat)
        shade *= 1 + 0.035 * noise(p, 0.035, 3) + 0.025 * noise(p, 0.006, 4)
        away = edges(p, number)
        shade *= 1 - 0.38 * np.exp(-((away / STITCH) ** 2)) + 0.10 * np.exp(-(((away - 0.004) / 0.002) ** 2))
        image[chart.known] = WHITE * shade
    return encode_linear(image)
