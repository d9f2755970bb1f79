"""Default materials for parts without colours of their own: skin, teeth, tongue, eyes with an iris."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fba.arrays import Float64
from fba.face.eyeball import LID_POINTS, PUPIL_POINT, sphere
from fba.face.feature_points import row_of
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.model import Material, Part

LOOKS = {
    "skin": Material("skin", (0.71, 0.47, 0.36), 0.55),
    "mouth": Material("mouth", (0.35, 0.10, 0.09), 0.4),
    "teeth": Material("teeth", (0.83, 0.80, 0.72), 0.25),
    "tongue": Material("tongue", (0.55, 0.16, 0.15), 0.4),
    "brow": Material("brow", (0.06, 0.04, 0.03), 0.8),
    "lash": Material("lashes", (0.02, 0.015, 0.01), 0.8),
    "hair": Material("hair", (0.06, 0.04, 0.03), 0.6),
    "eye": Material("eye", (0.80, 0.78, 0.75), 0.1),
}
"""Materials by kind of part."""
WHITE = (0.80, 0.78, 0.75)
IRIS = (0.16, 0.09, 0.05)
PUPIL = (0.004, 0.004, 0.004)
MAX_GREY_DIFFERENCE = 0.03
"""Light colours whose channels differ by less are programs' defaults, and are replaced."""


def apply_default_materials(pieces: Sequence[Piece], points: Float64) -> list[Piece]:
    """Return the pieces, with default materials for those without texture and colours, and irises on white
    eyes.

    points: (84, 3), in the same frame.
    """
    result = []
    for piece in pieces:
        part = piece.part
        if part.material.texture is None and part.colours is None and _is_grey(part.material):
            material = LOOKS.get(part.kind, part.material)
            part = replace(part, material=material)
            if part.kind == "eye":
                part = _with_iris(part, points)
        result.append(replace(piece, part=part))
    return result


def _is_grey(material: Material) -> bool:
    return max(material.colour) - min(material.colour) < MAX_GREY_DIFFERENCE and min(material.colour) > 0.5


def _with_iris(part: Part, points: Float64) -> Part:
    """Return the eye with the standard's neutral iris: as wide as the lids are apart, its pupil a third of
    it."""
    side = "left" if "left" in part.name else "right"
    pupil = points[row_of()[PUPIL_POINT[side]]]
    upper, lower = (float(points[row_of()[name], 1]) for name in LID_POINTS[side])
    wide = upper - lower
    ball = sphere(part)
    if ball is None or not np.isfinite(pupil).all() or not wide > 0:
        return part
    arm = pupil - ball[0]
    way = arm / max(float(np.linalg.norm(arm)), 1e-9)
    away = part.vertices - ball[0]
    along = away @ way
    off = np.linalg.norm(away - np.outer(along, way), axis=1)
    colours = np.tile(np.array([*WHITE, 0.9], dtype=np.float32), (len(part.vertices), 1))
    front = along > 0
    colours[front & (off < wide / 2), :3] = IRIS
    colours[front & (off < wide / 6), :3] = PUPIL
    return replace(part, colours=colours)
