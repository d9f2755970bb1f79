"""Makes what differs in the other figures from the built-in person: `fba/figures/NAME.npz`.

    python tools/figure/make_figures.py

To be run after each change of `head.glb` (`make_head.py` does) or `body.glb` (`make_body.py` does).
"""

from __future__ import annotations

from pathlib import Path

import make_head
import numpy as np
from looks import ALEX, FIGURES, Looks, reshape
from sculpt import ORIGIN

import figure
from fba.arrays import Float64
from fba.body import BodyModel
from fba.face import FaceModel
from fba.face.model import shape_key
from fba.figures import STEP

BUILTIN = Path(__file__).parents[2] / "fba"


def make_figure(looks: Looks) -> dict[str, np.ndarray]:
    """Return the arrays of a figure's file, by name: see `fba.figures`."""
    head = FaceModel.load(BUILTIN / "face" / "builtin" / "head.glb")
    body = BodyModel.load(BUILTIN / "body" / "builtin" / "body.glb")
    parts, points, _ = make_head.parts_and_points(looks)
    skin = next(part for part in parts if part.kind == "skin")
    eye = next(part for part in parts if part.kind == "eye")
    assert skin.material.texture is not None
    assert eye.colours is not None
    offset = ORIGIN + (0.0, figure.EYE_LEVEL, 0.0)
    moved = reshape(looks, body.vertices - offset) + offset
    skin_tint = linear(looks.neck) / linear(ALEX.neck)
    tints = {"shirt": looks.shirt, "trousers": looks.trousers, "shoes": looks.shoes}
    tints |= {"skin": skin_tint, "neck": skin_tint}
    plain = np.ones(3)
    return {
        "face": np.array(shape_key(head.parts)),
        "face_moves": steps(np.concatenate([part.vertices for part in parts]) - head.vertices),
        "face_tints": np.array(
            [plain if part.kind == "skin" else tints.get(part.name, plain) for part in head.parts], np.float32
        ),
        "points": points.astype(np.float32),
        "eye": eye.colours.astype(np.float16),
        "picture": np.frombuffer(skin.material.texture, np.uint8),
        "body": np.array(shape_key(body.parts)),
        "body_moves": steps(moved - body.vertices),
        "body_tints": np.array([tints[part.name] for part in body.parts], np.float32),
    }


def steps(moves: Float64) -> np.ndarray:
    """Return moves (V, 3) in metres as whole steps."""
    return np.rint(moves / STEP).astype(np.int16)


def linear(colour: tuple[float, float, float]) -> Float64:
    """Return (3,) linear light of an sRGB colour, 0..255."""
    shown = np.array(colour) / 255
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)


def main() -> None:
    """Write the files and say how large they are."""
    for looks in FIGURES:
        if looks is not ALEX:
            path = BUILTIN / "figures" / f"{looks.name}.npz"
            np.savez_compressed(path, **make_figure(looks))
            print(f"{path}: {path.stat().st_size} bytes")


if __name__ == "__main__":
    main()
