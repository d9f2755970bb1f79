"""A view: the meshes, capsules, eyes and annotations that a scene hands to a renderer for one moment.

World frame: +x the subject's left, +y up, +z forward, metres; the ground is y = 0. Annotations (lines, dots,
shells, grid, legend) have colours as displayed instead of colours under light.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Int32, Intp
from fba.mesh import Alpha
from fba_player._mesh.textures import linear_light

if TYPE_CHECKING:
    from fba.mesh.simplify import DetailLevels
    from fba_player._mesh.textures import FacePicture


Colour = tuple[float, float, float, float]
"""Of annotations: red, green, blue as displayed (sRGB, 0..1), and opacity."""

IRIS = (0.075, 0.105, 0.10)
"""Colour of an iris of which none is known, linear light."""
MOST_LIMBS = 12
"""Most limbs that keep the sky from a part; as in shaders/face.vert."""
CAPSULE_FLOATS = 16
"""Of a capsule: start (3), radius there, end (3), radius there, front (3), depth, colour (3), gloss."""


@dataclass(frozen=True, eq=False)
class MeshShape:
    """The constant data of a mesh. Reuse the object from frame to frame: renderers cache by its identity.

    triangles: int32 (F, 3), counter-clockwise from outside. colours: float32 (V, 4), linear light 0..1 and
    gloss. two_sided: False if the inside should look dark, as in a mouth. raised: above 0 for thin lines on
    another mesh: they are drawn over surfaces that hide them by less than this (m), and at least about a
    pixel wide.
    """

    triangles: Int32
    colours: Float32
    two_sided: bool = False
    raised: float = 0.0


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh in one pose: positions and normals, float32 (V, 3); matrix, (4, 4), into the world."""

    shape: MeshShape
    positions: Float32
    normals: Float32
    matrix: Float64


@dataclass(frozen=True, eq=False)
class FaceShape:
    """The constant data of a part of a face or body. Reuse the object: renderers cache by its identity.

    triangles: int32 (F, 3), counter-clockwise from outside. colours: float32 (V, 4), linear light and gloss.
    sway: float32 (V,), 1 where the part turns with the head, 0 where it stays, as shoulders do. texcoords:
    float32 (V, 2), origin at the picture's top left. picture: texture that multiplies the colours. scatter:
    how much light scatters below the surface, 1 for skin, 0 for cloth. fine: strength of the skin's relief,
    and its repetitions over the picture. two_sided: False if the inside should look dark. across: float32
    (V, 8) for single hairs: direction from the opposite vertex, half the hair's width (m), direction to the
    tip, and 1 or -1 for its side; hairs narrower than a pixel are drawn a pixel wide and fainter. closed:
    whether the inside is never visible and not drawn. name, kind: of the model's part, "" if none begins.
    coarser: levels of detail of a body's part, None without any; levels: those of a face's, from fine to
    coarse. casts: whether it casts a shadow on the ground. outer: int32 (F, 3), fewer triangles that cast the
    same shadow; None for all. points: float32 (V, 3), the vertices as modelled, by which `outer` is
    simplified further for the shadow of one of several bodies; None to leave it as it is. smooth: False if
    triangles are so large that light changes visibly within them. wrinkle_places: float32 (V, 2), where each
    vertex lies in `fba_player._mesh.wrinkle_map`, None for a part without wrinkles. alpha, opacity, cutoff:
    as of `fba.mesh._meshes.Material`. folds: whether folds in its picture grow where joints of a body bend.
    """

    triangles: Int32
    colours: Float32
    sway: Float32
    texcoords: Float32 | None = None
    picture: FacePicture | None = None
    scatter: float = 0.0
    fine: tuple[float, float] = (0.0, 1.0)
    two_sided: bool = False
    across: Float32 | None = None
    closed: bool = False
    name: str = ""
    kind: str = ""
    coarser: DetailLevels | None = None
    levels: tuple[CoarseShape, ...] = ()
    casts: bool = False
    outer: Int32 | None = None
    points: Float32 | None = None
    smooth: bool = True
    wrinkle_places: Float32 | None = None
    alpha: Alpha = "auto"
    opacity: float = 1.0
    cutoff: float = 0.5
    folds: bool = False

    @property
    def looks(self) -> Float32:
        """float32 (V, 7): colours, texture coordinates and sway."""
        texcoords = np.zeros((len(self.sway), 2)) if self.texcoords is None else self.texcoords
        return np.concatenate([self.colours, texcoords, self.sway[:, None]], axis=1).astype(np.float32)

    @cached_property
    def hair_width(self) -> float:
        """Half the width (m) of the widest single hair; 0 without any."""
        return 0.0 if self.across is None else float(self.across[:, 3].max(initial=0.0))

    @property
    def see_through(self) -> bool:
        """Whether parts of it are transparent: its picture has alpha, or it consists of hairs."""
        if self.across is not None:
            return True
        pictured = self.picture is not None and not self.picture.opaque
        return pictured if self.alpha == "auto" else self.alpha == "blend" and (pictured or self.opacity < 1)


@dataclass(frozen=True, eq=False)
class CoarseShape:
    """A part of a face at a level of detail: a coarser shape, moved by the vertices of the full one.

    rows: int32 (M, 3), and weights: float32 (M, 3): vertices of the full part between which each of the M
    lies; heights: float32 (M,), how far above them along the normal (m). parents: int32 (V,), the vertex that
    stands for each of the full part's. error: that of the whole face (m). whole: the level of the whole face,
    which its parts share.
    """

    shape: FaceShape
    rows: Int32
    weights: Float32
    heights: Float32
    parents: Int32
    error: float
    whole: object

    @cached_property
    def first(self) -> Intp:
        """(M,): a vertex of the full part that each of the M stands for."""
        first = np.zeros(len(self.heights), dtype=np.intp)
        first[self.parents[::-1]] = np.arange(len(self.parents))[::-1]
        return first


class FaceMesh(NamedTuple):
    """A part of a face in one pose.

    positions, normals: float32 (V, 3), without the head's rotation. light: float32 (V, 4), 0..1, the share of
    light that reaches each vertex past the rest of the figure: key light, open sky, light through the skin
    from behind, rim light. matrix: (4, 4), into the world. turn: (3,), the axis of the head's rotation times
    its angle, about `centre` (3,), in the frame of the positions. away: distance from the camera that the
    mesh is drawn for, in the mesh's own unit; None if not known. wrinkles: float32 (2, 4), 0..1, strength of
    each wrinkle on the left and the right side; None for none. looks: `FaceShape.looks` in place of the
    shape's own, while one level of detail becomes another. limbs: float32 (2 K, 4), for at most `MOST_LIMBS`
    limbs that keep the sky from the part: both ends of each, in the frame of the positions, each with the
    radius (m); None for none. finest: number of the first level of detail for which the arrays are complete;
    vertices that only finer ones have may be missing, see `Seen`. Do not write to the arrays: renderers
    recognise by their identity what they have uploaded.
    """

    shape: FaceShape
    positions: Float32
    normals: Float32
    light: Float32
    matrix: Float64
    turn: Float64
    centre: Float64
    away: float | None = None
    wrinkles: Float32 | None = None
    looks: Float32 | None = None
    limbs: Float32 | None = None
    finest: int = 0


class Seen(NamedTuple):
    """Where a view is seen from: what is far away need not be moved in all its detail.

    eye: (3,), of the camera. pixel: the width of a pixel at distance 1.
    """

    eye: Float64
    pixel: float

    def move(self, offset: Float64) -> Seen:
        """Return the same as seen by what is moved by offset (3,), metres, afterwards."""
        return Seen(self.eye - offset, self.pixel)


class Eye(NamedTuple):
    """An eyeball. matrix: (4, 4), from its own frame (looking along +z, radius 1) into the world.

    iris, pupil: radii as fractions of the eyeball's. lids: (4, 3), the middles of the upper and lower lid
    margins and the outer and inner corners, which shade the eye: relative to its centre, in the head's axes,
    as fractions of its radius. axes: (3, 3), the head's axes in the world, as columns. tint: colour of the
    iris, linear light.
    """

    matrix: Float64
    iris: float
    pupil: float
    lids: Float64
    axes: Float64
    tint: tuple[float, float, float] = IRIS


@dataclass(frozen=True, eq=False)
class Lines:
    """Straight lines of the same width near and far.

    ends: float32 (N, 2, 3). colours: one for all, or float32 (N, 2, 4), one for each end. width: pixels in a
    picture 720 high. lift: lines are drawn over surfaces that hide them by less than this (m).
    """

    ends: Float32
    colours: Colour | Float32
    width: float = 1.0
    lift: float = 0.0


@dataclass(frozen=True, eq=False)
class Dots:
    """Round dots with names, of the same size near and far.

    positions: float32 (N, 3). colour: of all dots. radius: pixels in a picture 720 high; 0 for names
    alone. lift: as for lines; a dot hidden further shows through faintly. names: one for each dot, drawn if
    few are in view; all "" for none. facing: float32 (N, 3), the direction from which a dot is visible; zeros
    for all. most: largest radius of a dot (m), so that dots stay apart from afar.
    """

    positions: Float32
    colour: Colour
    radius: float
    lift: float
    names: tuple[str, ...]
    facing: Float32
    most: float = math.inf


@dataclass(frozen=True)
class Grid:
    """A grid on a horizontal plane at y = height.

    step: metres between bold lines, with ten fine steps between them. centre: x and z of its middle. reach:
    metres from there at which it has faded out.
    """

    height: float
    step: float
    centre: tuple[float, float]
    reach: float


@dataclass(frozen=True)
class Legend:
    """Explains colours.

    title, unit: text. most: value of the last colour; the first is 0. stops: colours (3,) at equal steps.
    """

    title: str
    unit: str
    most: float
    stops: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, eq=False)
class Extras:
    """The annotations of a view; shells are meshes drawn as if made of glass."""

    lines: tuple[Lines, ...] = ()
    dots: tuple[Dots, ...] = ()
    shells: tuple[FaceMesh, ...] = field(default=())
    grid: Grid | None = None
    legend: Legend | None = None


@dataclass(frozen=True, eq=False)
class View:
    """Everything to be drawn at one moment.

    capsules: float32 (N, 16), see `CAPSULE_FLOATS`. marks: likewise, but they show faintly through surfaces
    that hide them. blobs: float32 (K, 4), soft shadows on the ground: x, z, radius, darkness. ground: whether
    there is a ground. background: colour behind everything (sRGB, 0..1) instead of the studio. extras:
    annotations drawn over the figure. lod: the level of detail of faces, "auto" by size, or a number, 0 for
    all triangles, also of bodies. wipe: what is drawn in the right part of the picture.
    """

    meshes: list[Mesh] = field(default_factory=list)
    capsules: Float32 = field(default_factory=lambda: np.zeros((0, CAPSULE_FLOATS), dtype=np.float32))
    marks: Float32 = field(default_factory=lambda: np.zeros((0, CAPSULE_FLOATS), dtype=np.float32))
    eyes: list[Eye] = field(default_factory=list)
    faces: list[FaceMesh] = field(default_factory=list)
    blobs: Float32 = field(default_factory=lambda: np.zeros((0, 4), dtype=np.float32))
    ground: bool = False
    background: tuple[float, float, float] | None = None
    extras: Extras | None = None
    lod: str = "auto"
    wipe: Wipe | None = None


@dataclass(frozen=True, eq=False)
class Wipe:
    """Another view, drawn in place of the first to the right of a line.

    at: where the line is, 0..1 of the picture's width.
    """

    view: View
    at: float


def spheres(centres: npt.ArrayLike, radii: npt.ArrayLike, colour: tuple[float, ...]) -> Float32:
    """Return float32 (N, 16): spheres as capsules. centres (N, 3), radii (N,): metres. colour: with gloss."""
    starts = np.asarray(centres, dtype=np.float32)
    capsules = np.zeros((len(starts), CAPSULE_FLOATS), dtype=np.float32)
    capsules[:, 0:3] = starts
    capsules[:, 4:7] = starts + np.array([0.0, 2e-5, 0.0], dtype=np.float32)  # an axis must have a length
    capsules[:, 3] = capsules[:, 7] = radii
    capsules[:, 8:12] = (0.0, 0.0, 1.0, 1.0)
    capsules[:, 12:16] = colour
    return capsules


def srgb(text: str) -> tuple[float, float, float]:
    """Return linear light (3 values, 0..1) of a colour "#rrggbb" in sRGB."""
    red, green, blue = linear_light(np.array([*bytes.fromhex(text[1:])]) / 255).tolist()
    return red, green, blue
