"""What a view may carry beside the figure itself: lines, dots, shells, a grid, a legend.

Colours here are those of a drawing, not of a thing in the light: red, green, blue as they are shown (sRGB,
0..1), and how opaque. World frame and metres as everywhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from fba.arrays import Float32
from fba_player.view.view import FaceMesh

Colour = tuple[float, float, float, float]


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
