"""Shapes that move both sides of a face, cut into ARKit's shapes of the left and of the right side."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fba.arrays import Float32
from fba.easing import smoothstep
from fba.face.importers.assembly._polygon_parts import Piece
from fba.face.shape_names import canonical_names

BOTH = {
    "eyesclosed": "eyeBlink",
    "eyeblink": "eyeBlink",
    "eyesblink": "eyeBlink",
    "blink": "eyeBlink",
    "vrcblink": "eyeBlink",
    "fcleyeclose": "eyeBlink",
    "mouthsmile": "mouthSmile",
    "smile": "mouthSmile",
}
"""ARKit's names, without the side, of shapes of both sides (in small letters only)."""
MOVED_SHARE = 0.2
"""Share of a shape's largest motion above which a vertex shows where the shape is."""
BLEND_WIDTH = 0.1
"""Width over which one side goes over into the other, as a share of the width of what moves."""


def split_sides(pieces: Sequence[Piece]) -> list[Piece]:
    """Return the pieces, with shapes of both sides also cut into shapes of each side that the file lacks."""
    result = list(pieces)
    known = canonical_names(sorted({name for piece in pieces for name in piece.morphs}))
    for name in sorted({name for piece in pieces for name in piece.morphs}):
        shape = BOTH.get(re.sub("[^a-z]", "", re.split(r"[.:|/]", name)[-1].lower()))
        shape = shape or BOTH.get(re.sub("[^a-z]", "", name.lower()))
        sides = (f"{shape}Left", f"{shape}Right")
        if shape is None or any(side in known for side in sides):
            continue
        ends = _ends(result, name)
        if ends is None:
            continue
        known |= dict.fromkeys(sides, name)
        middle, width = sum(ends) / 2, BLEND_WIDTH * (ends[1] - ends[0])
        for k, piece in enumerate(result):
            if name in piece.morphs:
                x = piece.part.vertices[:, 0].astype(np.float64)
                left = smoothstep((x - middle) / max(width, 1e-12) + 0.5)[:, None].astype(np.float32)
                morph = piece.morphs[name]
                both = {sides[0]: morph * left, sides[1]: morph * (1 - left)}
                result[k] = replace(piece, morphs={**piece.morphs, **both})
    return result


def _ends(pieces: Sequence[Piece], name: str) -> tuple[float, float] | None:
    """Return the least and the largest x of what a shape moves; None where it moves nothing."""
    moving = [(piece.part.vertices, _sizes(piece.morphs[name])) for piece in pieces if name in piece.morphs]
    most = max((float(size.max(initial=0.0)) for _, size in moving), default=0.0)
    if not most > 0:
        return None
    x = np.concatenate([vertices[size > MOVED_SHARE * most, 0] for vertices, size in moving])
    return float(x.min()), float(x.max())


def _sizes(morph: Float32) -> Float32:
    return np.asarray(np.linalg.norm(morph, axis=1), dtype=np.float32)
