"""How the built-in figures look: colours, hair and lines of the skin. Shapes are in `shapes.csv`."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fba.arrays import Float64
from tools.figure.build import Build

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Hair:
    """Hair of the head: a layer over the scalp, painted with strands, and locks that stand out from it.

    sides, top: thickness of the layer at the sides and what the top adds, metres. volumes: what each place of
    `hair.VOLUMES` adds, metres. rise: metres from the hairline over which it reaches that. lumps: how far it
    is uneven, metres. loose: how far locks stand out, relative to the first figure's. curly: whether strands
    coil, else they are combed from a parting. colours: of strands from dark to bright, sRGB, 0..255.
    """

    sides: float
    top: float
    volumes: tuple[float, float]
    rise: float
    lumps: float
    loose: float
    curly: bool
    colours: tuple[Colour, ...]


@dataclass(frozen=True)
class Looks:
    """One figure. Colours of the skin are sRGB, 0..255; of eyes and clothes, linear light.

    brow_height: of the brows, relative to the first figure's. beard: how far its shade
    shows, 0..1. lines: depth of the lines of an old skin, 0..1.
    gloss: of the skin, relative to the first figure's. girth, muscles: of the arms, likewise.
    iris: inner and outer colour. shirt, trousers, shoes: factors of the first figure's colours. build: of the
    body, where it differs.
    """

    name: str
    hair: Hair
    skin: Colour
    blush: Colour
    socket: Colour
    neck: Colour
    waterline: Colour
    caruncle: Colour
    lip: Colour
    lip_line: Colour
    freckle: Colour
    scalp: Colour
    brow: Colour
    brow_height: float = 1.0
    beard: float = 0.0
    lines: float = 0.0
    gloss: float = 1.0
    girth: float = 1.0
    muscles: float = 1.0
    iris: tuple[Colour, Colour] = ((0.30, 0.17, 0.065), (0.075, 0.105, 0.100))
    shirt: Colour = (1.0, 1.0, 1.0)
    trousers: Colour = (1.0, 1.0, 1.0)
    shoes: Colour = (1.0, 1.0, 1.0)
    build: Build | None = None


ALEX = Looks(
    name="alex",
    hair=Hair(
        0.0050, 0.0113, (0.0066, 0.001), 0.030, 0.0024, 1.0, curly=False,
        colours=((30, 21, 17), (54, 38, 29), (84, 60, 44), (122, 90, 66)),
    ),
    skin=(217, 168, 142), blush=(214, 138, 118), socket=(186, 128, 112), neck=(206, 158, 131),
    waterline=(203, 138, 126), caruncle=(216, 158, 142), lip=(191, 114, 103), lip_line=(146, 78, 71),
    freckle=(178, 118, 92), scalp=(96, 72, 60), brow=(60, 44, 34), beard=0.35,
)  # fmt: skip
"""The built-in person: a young man with brown hair."""
RUTH = Looks(
    name="ruth",
    hair=Hair(
        0.012, 0.010, (0.002, 0.000), 0.055, 0.0022, 1.3, curly=True,
        colours=((52, 48, 47), (88, 84, 82), (136, 133, 131), (184, 182, 180)),
    ),
    skin=(128, 86, 66), blush=(132, 76, 62), socket=(94, 60, 48), neck=(120, 80, 61),
    waterline=(150, 98, 86), caruncle=(172, 110, 94), lip=(132, 78, 69), lip_line=(84, 45, 40),
    freckle=(92, 58, 42), scalp=(84, 66, 58), brow=(66, 56, 52), brow_height=0.72, lines=1.0, gloss=0.75,
    girth=0.86, muscles=0.50,
    iris=((0.080, 0.040, 0.018), (0.038, 0.021, 0.012)),
    shirt=(3.0, 0.62, 0.45), trousers=(1.1, 0.75, 0.60), shoes=(0.8, 0.55, 0.45),
    build=Build(
        trunk=(
            (0.45, 0.000, 0.000, 0.000), (0.68, 0.008, 0.003, 0.006), (0.82, 0.016, 0.004, 0.018),
            (0.92, 0.015, 0.010, 0.018), (1.02, -0.004, 0.010, 0.000), (1.10, -0.023, 0.002, -0.008),
            (1.18, -0.024, -0.002, -0.012), (1.30, -0.024, -0.002, -0.016), (1.42, -0.024, 0.000, -0.012),
            (1.50, 0.000, 0.000, 0.000),
        ),
        bust=0.041, bust_at=(0.068, 1.235), bust_size=(0.086, 0.088, 0.062),
        shoulders=0.023, slope=0.010, shorter=0.020, arms=0.955, carried=(2.5, 5.0),
    ),
)  # fmt: skip
"""A woman of about sixty-five with brown skin and grey curls."""
FIGURES = (ALEX, RUTH)
EYES = np.array([[0.0310, 0.0, -0.0123], [-0.0310, 0.0, -0.0123]])
"""About the centres of the eyeballs, in the finished head's frame: nothing moves there."""
STILL, MOVING = 0.014, 0.022
"""Distances from these (m): up to the first nothing moves, beyond the second everything may."""


def reshape(looks: Looks, positions: Float64) -> Float64:
    """Return points (N, 3), in the finished head's frame, in the shape of another figure.

    Each row of `shapes.csv` moves what is near a place, and stretches it about that place, on both sides.
    """
    from fba.sampling import smoothstep

    moved = positions.copy()
    away = np.linalg.norm(positions[:, None] - EYES, axis=2).min(axis=1)
    free = smoothstep((away - STILL) / (MOVING - STILL))[:, None]
    with (Path(__file__).parent / "data" / "shapes.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["figure"] == looks.name]
    for row in rows:
        place, shift, stretch = (np.array([float(row[c]) for c in names]) for names in COLUMNS)
        for side in (1.0, -1.0) if place[0] else (1.0,):
            mirror = np.array([side, 1.0, 1.0])
            offset = positions - mirror * place / 1000
            weight = np.exp(-((offset / (float(row["reach"]) / 1000)) ** 2).sum(axis=1))[:, None]
            moved += free * weight * (mirror * shift / 1000 + offset * stretch)
    return moved


COLUMNS = (("x", "y", "z"), ("dx", "dy", "dz"), ("sx", "sy", "sz"))
