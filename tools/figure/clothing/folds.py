"""Folds, seams and shades of cloth: drawn on tubes unrolled about trunk, arms and legs.

The wide ones also move the garment's vertices; all of them are painted, as light from above shows them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates
from scipy.spatial import cKDTree

from fba.arrays import Float64, Int64
from fba.body import Skeleton
from fba.mesh import vertex_normals
from fba.rotations import unit
from fba.sampling import smoothstep
from tools.figure.clothing.clothes import (
    ELBOW,
    SHOULDER,
    Garment,
    depth_below_collar,
    height_above_hem,
    height_above_shirt_hem,
    length_inside_sleeve,
)
from tools.figure.head.hair import noise
from tools.figure.paint import encode_linear, make_chart

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
STEEP = 0.74
"""Greatest slope of a painted fold."""
WIDER, HIGHER = 1.5e-3, 2.7e-3
"""Metres of a millimetre in the tables of folds."""
SHARPER = 0.6
"""Width of a fold below its crest, as a share of that above it."""
MOVED, MOST = 0.008, (-0.0016, 0.0075)
"""Metres over which folds are smoothed to move vertices, and bounds of that."""
JITTER, STRENGTHS = 0.012, (0.45, 1.35)
"""Metres by which points of folds differ from side to side, and factors of their heights."""
RUMPLES = ((0.080, 0.034, 3.0), (0.040, 0.017, 1.0))
"""Creases all over the cloth: how long and how far apart they are, metres; their height, millimetres."""
SAG = 0.7
"""Their greatest slope across the cloth."""
WORN = (0.02, 0.062)
"""Where cloth is worn most, metres from its front outwards, and how far from there it is."""
POCKET = (0.084, 0.870, 0.052, 0.064)
"""Middle (x, y) of a pocket behind, half its width and half its height, metres."""
STITCH = 0.0011
"""Half the width of a line of stitches or of a seam, metres."""

Stroke = tuple[tuple[tuple[float, float], ...], float, float]
"""Points of a fold (around, along), metres; its half width and its height, millimetres."""
TRUNK_FOLDS: tuple[Stroke, ...] = (
    # from the armpit up to the shoulder, over the chest and down, then over the back
    (((0.198, 0.220), (0.180, 0.170), (0.165, 0.110)), 6, 1.5),
    (((0.200, 0.222), (0.150, 0.244), (0.085, 0.310)), 6, 1.5),
    (((0.207, 0.235), (0.165, 0.300), (0.085, 0.410)), 7, 2.0),
    (((0.222, 0.250), (0.205, 0.340), (0.160, 0.440)), 7, 2.0),
    (((0.270, 0.220), (0.298, 0.165), (0.312, 0.105)), 6, 1.7),
    (((0.268, 0.225), (0.330, 0.240), (0.430, 0.310)), 6, 2.0),
    (((0.262, 0.240), (0.300, 0.320), (0.390, 0.430)), 7, 2.2),
    (((0.250, 0.255), (0.262, 0.340), (0.310, 0.440)), 7, 2.0),
    (((0.130, 0.100), (0.090, 0.190), (0.030, 0.290)), 8, 1.3),
    (((0.150, 0.150), (0.130, 0.240), (0.080, 0.350)), 8, 1.2),
    (((0.350, 0.120), (0.390, 0.220), (0.450, 0.330)), 8, 1.4),
    # bunched at the sides of the waist and in the small of the back
    (((0.275, 0.422), (0.210, 0.448), (0.115, 0.428)), 6, 2.8),
    (((0.180, 0.472), (0.245, 0.488), (0.310, 0.468)), 6, 2.6),
    (((0.270, 0.524), (0.190, 0.505), (0.050, 0.538)), 7, 2.6),
    (((0.215, 0.548), (0.150, 0.562), (0.070, 0.596)), 7, 2.0),
    (((0.258, 0.436), (0.330, 0.462), (0.450, 0.440)), 6, 2.8),
    (((0.300, 0.492), (0.380, 0.478), (0.468, 0.502)), 7, 2.8),
    (((0.270, 0.535), (0.350, 0.526), (0.440, 0.556)), 7, 2.2),
    # falling to the hem
    (((0.105, 0.600), (0.098, 0.500), (0.115, 0.360)), 10, 1.3),
    (((0.385, 0.600), (0.392, 0.500), (0.365, 0.370)), 10, 1.5),
)  # fmt: skip
SLEEVE_FOLDS: tuple[Stroke, ...] = (
    (((-0.062, 0.118), (0.000, 0.100), (0.075, 0.070)), 6, 2.2),
    (((-0.116, 0.118), (-0.170, 0.100), (-0.235, 0.072)), 6, 2.2),
    (((0.085, 0.040), (0.074, 0.105), (0.055, 0.170)), 8, 1.6),
    (((0.010, 0.175), (0.026, 0.135), (0.065, 0.105)), 6, 1.8),
    (((0.165, 0.172), (0.150, 0.130), (0.115, 0.100)), 6, 1.8),
    (((0.100, 0.110), (0.040, 0.128), (-0.020, 0.150)), 6, 1.6),
    (((-0.050, 0.150), (-0.085, 0.138), (-0.130, 0.155)), 6, 2.0),
)  # fmt: skip
LEG_FOLDS: tuple[Stroke, ...] = (
    # from the crotch towards the hip, and below the seat
    (((-0.108, 0.128), (-0.040, 0.118), (0.060, 0.075)), 6, 2.0),
    (((-0.112, 0.152), (-0.050, 0.160), (0.060, 0.140)), 6, 2.2),
    (((-0.115, 0.180), (-0.070, 0.225), (0.000, 0.290)), 7, 1.8),
    (((-0.180, 0.180), (-0.215, 0.190), (-0.310, 0.172)), 6, 2.6),
    (((-0.175, 0.205), (-0.205, 0.235), (-0.260, 0.270)), 7, 2.0),
    # from behind the knee to both sides of it
    (((0.245, 0.462), (0.180, 0.450), (0.085, 0.400)), 6, 2.8),
    (((0.235, 0.490), (0.160, 0.496), (0.050, 0.470)), 6, 2.6),
    (((0.240, 0.520), (0.170, 0.535), (0.070, 0.590)), 7, 2.2),
    (((0.245, 0.470), (0.300, 0.462), (0.390, 0.420)), 6, 2.8),
    (((0.250, 0.506), (0.320, 0.512), (0.410, 0.560)), 6, 2.4),
    # bunched on the shoe
    (((-0.150, 0.800), (-0.070, 0.784), (0.030, 0.806)), 6, 2.4),
    (((0.140, 0.826), (0.060, 0.816), (-0.040, 0.846)), 6, 2.8),
    (((0.240, 0.790), (0.160, 0.774), (0.060, 0.786)), 6, 2.2),
    (((0.190, 0.836), (0.270, 0.840), (0.350, 0.818)), 6, 2.4),
    (((-0.040, 0.742), (0.010, 0.730), (0.080, 0.748)), 6, 1.6),
    (((-0.120, 0.772), (-0.030, 0.757), (0.090, 0.776)), 6, 2.2),
    (((0.110, 0.858), (0.020, 0.848), (-0.090, 0.868)), 5, 2.4),
    (((0.330, 0.860), (0.250, 0.862), (0.170, 0.870)), 5, 2.2),
    # across the front of the hip
    (((-0.090, 0.098), (0.000, 0.084), (0.090, 0.050)), 5, 1.3),
    (((-0.080, 0.205), (0.010, 0.196), (0.110, 0.150)), 6, 1.2),
    # along the thigh, over the knee, down the shin
    (((0.150, 0.190), (0.130, 0.300), (0.070, 0.410)), 9, 1.2),
    (((0.000, 0.220), (-0.010, 0.300), (-0.050, 0.390)), 9, 1.0),
    (((-0.090, 0.432), (-0.020, 0.456), (0.060, 0.440)), 7, 1.3),
    (((0.090, 0.508), (0.020, 0.522), (-0.070, 0.500)), 7, 1.3),
    (((-0.080, 0.560), (-0.020, 0.630), (0.050, 0.690)), 8, 1.3),
    (((0.160, 0.600), (0.100, 0.665), (0.020, 0.715)), 8, 1.4),
    (((0.260, 0.580), (0.210, 0.650), (0.120, 0.710)), 8, 1.6),
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Tube:
    """Cloth around a limb, unrolled: from `start` to `end`, points (3,), of a radius in metres.

    place: of its middle above, in texels of the picture. side: 1 left or in the middle, -1 mirrored. bow:
    metres by which its middle is before the line between both ends. higher: factor of the heights of its
    folds. whole: that they lie on both sides. worn: how much paler it is in front.
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
    worn: float = 0.0

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
        if random is not None:
            for wide, narrow, height in RUMPLES:
                creases = _rumpled(along.shape, wide, narrow, random)
                raised += 0.001 * height * creases * smoothstep((along - 0.03) / 0.15)
        return raised

    def _grid(self) -> tuple[Float64, Float64]:
        wide = np.arange(-self.turn / 2 - PAD, self.turn / 2 + PAD, 1 / DENSITY)
        return np.meshgrid(wide, np.arange(-PAD, self.length + PAD, 1 / DENSITY))

    def sample(self, field: Float64, flat: Float64) -> Float64:
        """Return (N,) a field of `heights` at places (N, 2) on the tube."""
        row, column = (flat[:, 1] + PAD) * DENSITY, (flat[:, 0] + self.turn / 2 + PAD) * DENSITY
        return map_coordinates(field, [row, column], order=1, mode="nearest")


def _rumpled(shape: tuple[int, ...], wide: float, narrow: float, random: np.random.Generator) -> Float64:
    """Return (H, W) creases, 0..1, that fade: ridges where smooth noise is 0.

    They sag in front and behind, and go on around the tube.
    """
    rows, columns = np.indices(shape).astype(np.float64)
    turn = round(shape[1] - 2 * PAD * DENSITY)
    rows -= SAG * turn / (4 * np.pi) * np.cos(4 * np.pi * (columns - shape[1] / 2) / turn)
    noise, patches = (
        map_coordinates(
            gaussian_filter(
                random.standard_normal((shape[0], turn)), np.array(sizes) * DENSITY / 2, mode="wrap"
            ),
            [rows, columns],
            order=1,
            mode="grid-wrap",
        )
        for sizes in ((narrow, wide), (wide, wide))
    )
    return np.exp(-((noise / (0.6 * noise.std())) ** 2)) * smoothstep(patches / patches.std() + 0.2)


def _raise(
    raised: Float64, around: Float64, along: Float64, knots: Float64, width: float, height: float
) -> None:
    """Add a fold along points (N, 2), in place: sharp where it begins, wider and fading towards its end.

    It is gentle above its crest and steep below.
    """
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
    wide = width * np.where(below & level, SHARPER, 1.0) * (0.7 + 0.7 * share[row])
    fading = np.sin(np.pi * np.clip(share[row], 0.01, 0.99) ** 0.7)
    raised[near] += height * fading * np.exp(-((away / wide) ** 2))


def trunk_and_sleeves() -> tuple[Tube, ...]:
    """Return the tubes of the shirt: the trunk, the left and the right sleeve."""
    above = np.array([0, 1.53, -0.035])
    return (
        Tube(above, above - (0, 0.63, 0), 0.15, 0.62, TRUNK_FOLDS, (512, 40), higher=1.25, whole=True),
        Tube(SHOULDER, ELBOW, 0.056, 0.20, SLEEVE_FOLDS, (230, 740), higher=1.3),
        Tube(SHOULDER, ELBOW, 0.056, 0.20, SLEEVE_FOLDS, (794, 740), -1.0, higher=1.3),
    )  # fmt: skip


def legs() -> tuple[Tube, ...]:
    """Return the tubes of the trousers: the left and the right leg."""
    hip, ankle = np.array([0.072, 0.99, -0.045]), np.array([0.155, 0.08, -0.100])
    return (
        Tube(hip, ankle, 0.080, 0.93, LEG_FOLDS, (256, 45), 1.0, 0.055, 1.3, worn=0.55),
        Tube(hip, ankle, 0.080, 0.93, LEG_FOLDS, (768, 45), -1.0, 0.055, 1.3, worn=0.55),
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
        return np.minimum(np.abs(length_inside_sleeve(p) - 0.018), _from_armhole(p))
    lines = (
        np.abs(depth_below_collar(p) - 0.016),
        np.abs(height_above_shirt_hem(p) - 0.020),
        _from_armhole(p),
    )
    return np.min(lines, axis=0)


def _from_pocket(p: Float64) -> Float64:
    """Return (N,) metres from points (N, 3) to the outline of a pocket behind, which ends in a point."""
    x, y, wide, high = POCKET
    across = np.abs(np.abs(p[:, 0]) - x)
    down = np.maximum(p[:, 1] - y, y - p[:, 1] + 0.15 * across - 0.006)
    return np.where(p[:, 2] < -0.03, np.abs(np.maximum(across - wide, down - high)), 1.0)


def _from_armhole(p: Float64) -> Float64:
    """Return (N,) metres from the armhole; far where points (N, 3) are below or above its seam.

    The seam fades towards the shoulder, where the picture is stretched.
    """
    faded = 0.01 * smoothstep((p[:, 1] - 1.335) / 0.03)
    return np.where((p[:, 1] > 1.29) & (p[:, 1] < 1.405), np.abs(np.abs(p[:, 0]) - ARMHOLE) + faded, 1.0)


def _trouser_seams(p: Float64, tube: int) -> Float64:
    """Return (N,) metres from points (N, 3) to the nearest seams and stitches of the trousers."""
    around, along = legs()[tube].unroll(p).T
    sides = np.abs(around - legs()[tube].turn / 4)
    inner = np.where(along > 0.16, np.abs(around + legs()[tube].turn / 4), 1.0)
    pocket = np.where((along < 0.16) & (along > 0.01), np.abs(around - 0.055 - 0.42 * along), 1.0)
    fly = np.where((p[:, 2] > 0) & (along < 0.15), np.abs(p[:, 0]), 1.0)
    return np.min([sides, inner, pocket, fly, _from_pocket(p), np.abs(height_above_hem(p) - 0.022)], axis=0)


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
        front = np.exp(-(((flat[:, 0] - WORN[0]) / WORN[1]) ** 2)) - 0.4
        shade *= 1 + tube.worn * front * smoothstep((flat[:, 1] - 0.06) / 0.2) * smoothstep(
            (0.68 - flat[:, 1]) / 0.25
        )
        away = edges(p, number)
        shade *= 1 - 0.38 * np.exp(-((away / STITCH) ** 2)) + 0.10 * np.exp(-(((away - 0.004) / 0.002) ** 2))
        image[chart.known] = WHITE * shade
    return encode_linear(image)
