"""What a scene hands to a renderer: meshes, capsules and eyes in the world, at one moment.

The seam between "what is shown" (`Scene`) and "how" (`Renderer`): a face mesh or a skinned body is one
more `Mesh` here. World frame: +x the subject's left, +y up, +z forward, metres; the ground is y = 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Int32

if TYPE_CHECKING:
    from fba_player.mesh.simplify import Coarser
    from fba_player.mesh.textures import FacePicture


Colour = tuple[float, float, float, float]
"""Of annotations: red, green, blue as displayed (sRGB, 0..1), and opacity."""

CAPSULE_FLOATS = 16
"""A capsule: start (3), radius there, end (3), radius there, front (3), depth, colour (3), gloss."""


@dataclass(frozen=True, eq=False)
class MeshShape:
    """What does not change from frame to frame; keep the object, renderers remember it.

    triangles: int32 (F, 3), counter-clockwise from outside. colours: float32 (V, 4), linear light 0..1,
    the fourth how glossy. two_sided: False where the inside is to look dark, as that of a mouth. raised:
    above 0 for thin lines on another mesh: they are drawn over what hides them by less (m), and never
    thinner than about a pixel.
    """

    triangles: Int32
    colours: Float32
    two_sided: bool = False
    raised: float = 0.0


@dataclass(frozen=True, eq=False)
class Mesh:
    """A mesh in one pose: positions and normals float32 (V, 3), matrix (4, 4) into the world."""

    shape: MeshShape
    positions: Float32
    normals: Float32
    matrix: Float64


@dataclass(frozen=True, eq=False)
class FaceShape:
    """What does not change in a part of a face; keep the object, renderers remember it.

    triangles: int32 (F, 3), counter-clockwise from outside. colours: float32 (V, 4), linear light, the
    fourth how glossy. sway: float32 (V,), 1 where it goes with the head, 0 where it stands, as shoulders
    do. texcoords: float32 (V, 2), origin at the picture's top left. picture: what
    the colours are multiplied with. scatter: how far light wanders below the surface: 1 skin, 0 cloth.
    fine: strength of the skin's relief, and how often it repeats over the picture. two_sided: False where
    the inside is to look dark. across: float32 (V, 8), of single hairs: from the vertex opposite to each,
    half the hair's width there (m), direction to the tip, and 1 or -1 on its two sides; hairs are never
    drawn thinner than a pixel, but fainter. closed: nobody sees into it, so its inside is not drawn.
    name, kind: of the part that it was made from, "" where there is none. coarser: the same with fewer
    triangles, for when it is small on the screen; None where it is always drawn as it is. smooth: False where
    its triangles are so large that their light changes visibly within them.
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
    coarser: Coarser | None = None
    smooth: bool = True

    @property
    def see_through(self) -> bool:
        """Whether it is to be drawn over what is behind: its picture is not everywhere, or it is of hairs."""
        return (self.picture is not None and not self.picture.opaque) or self.across is not None


@dataclass(frozen=True, eq=False)
class FaceMesh:
    """A part of a face in one pose.

    positions, normals: float32 (V, 3), without the head's rotation. light: float32 (V, 4), 0..1, the share of
    light that reaches each vertex past the rest of the figure: key light, open sky, light through the skin
    from behind, rim light. matrix: (4, 4), into the world. turn: (3,), the axis of the head's rotation times
    its angle, about `centre` (3,), in the frame of the positions. away: distance from the camera that the
    mesh is drawn for, in the mesh's own unit; None if not known. Do not write to the arrays: renderers
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


@dataclass(frozen=True, eq=False)
class Eye:
    """An eyeball. matrix (4, 4): its frame (looking along +z, radius 1) into the world.

    iris, pupil: their radii as fractions of the eyeball's. lids: (4, 3), middles of the upper and the
    lower lid's margin, outer and inner corner, from the eyeball's centre in the axes of the head, as
    fractions of its radius: they shade it. axes: (3, 3), the head's in the world, in columns. tint: of
    the iris, linear light.
    """

    matrix: Float64
    iris: float
    pupil: float
    lids: Float64
    axes: Float64
    tint: tuple[float, float, float] = (0.075, 0.105, 0.10)


@dataclass(frozen=True, eq=False)
class Lines:
    """Straight lines, equally wide near and far.

    ends: float32 (N, 2, 3). colours: one for all, or float32 (N, 2, 4), one an end. width: pixels of a
    picture 720 high. lift: they are drawn over what hides them by less than this (m).
    """

    ends: Float32
    colours: Colour | Float32
    width: float = 1.0
    lift: float = 0.0


@dataclass(frozen=True, eq=False)
class Dots:
    """Round dots, equally large near and far, with names.

    places: float32 (N, 3). colour: of all. radius: pixels of a picture 720 high; 0 for names alone. lift:
    as of lines; hidden further, a dot shines through faintly. names: one a dot, shown where few are in
    view. facing: float32 (N, 3), the way in which a dot can be seen; zeros: from everywhere. most: no dot
    has a larger radius than this (m), so that from afar they stay apart.
    """

    places: Float32
    colour: Colour
    radius: float
    lift: float
    names: tuple[str, ...]
    facing: Float32
    most: float = math.inf


@dataclass(frozen=True)
class Grid:
    """Lines on a level plane. height: y. step: metres between the bold ones, ten fine ones in each. centre:
    x and z around which they are seen. reach: how far they fade out, metres."""

    height: float
    step: float
    centre: tuple[float, float]
    reach: float


@dataclass(frozen=True)
class Legend:
    """What colours mean. title, unit: words. most: the value of the last colour; the first is 0.
    stops: colours at equal steps."""

    title: str
    unit: str
    most: float
    stops: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, eq=False)
class Extras:
    """All of it; shells are meshes drawn as if of glass."""

    lines: tuple[Lines, ...] = ()
    dots: tuple[Dots, ...] = ()
    shells: tuple[FaceMesh, ...] = field(default=())
    grid: Grid | None = None
    legend: Legend | None = None


@dataclass(frozen=True, eq=False)
class View:
    """Everything to be drawn at one moment.

    capsules: float32 (N, 16), see `CAPSULE_FLOATS`. marks: the same, but what hides them lets them shine
    through a little. blobs: float32 (K, 4), soft shadows on the ground:
    x, z, radius, darkness. ground: whether there is a ground. background: colour behind everything (sRGB,
    0..1, as shown) instead of the studio. extras: what is drawn over the figure, see
    `Extras`.
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


def spheres(places: npt.ArrayLike, radii: npt.ArrayLike, colour: tuple[float, ...]) -> Float32:
    """(N, 16) capsules that are spheres: places (N, 3) and radii (N,), metres; colour and gloss."""
    centres = np.asarray(places, dtype=np.float32)
    found = np.zeros((len(centres), CAPSULE_FLOATS), dtype=np.float32)
    found[:, 0:3] = centres
    found[:, 4:7] = centres + np.array([0.0, 2e-5, 0.0], dtype=np.float32)  # an axis needs some length
    found[:, 3] = found[:, 7] = radii
    found[:, 8:12] = (0.0, 0.0, 1.0, 1.0)
    found[:, 12:16] = colour
    return found


def srgb(text: str) -> tuple[float, float, float]:
    """A colour written "#rrggbb" in sRGB, as linear light."""
    values = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
    red, green, blue = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in values)
    return red, green, blue
