"""Makes the built-in body: `fba/body/builtin/body.glb`.

    python examples/figure/make_body.py

The figure without its head (which the built-in face replaces, on the same neck), dressed; joints and
weights in the standard's terms (`rig.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

import clothes
import figure
import numpy as np
import numpy.typing as npt
import rig

Float64 = npt.NDArray[np.float64]
Int64 = npt.NDArray[np.int64]
SKIN = np.array([0.605, 0.352, 0.245])
"""Linear light: the complexion of the built-in head's neck."""
NAIL = np.array([0.66, 0.40, 0.33])


@dataclass(frozen=True, eq=False)
class Piece:
    """One mesh of the body, as modelled: vertices (V, 3), triangles (F, 3), colours (V, 4), weights (V, J)."""

    kind: str
    vertices: Float64
    triangles: Int64
    colours: Float64
    weights: Float64


def pieces() -> tuple[dict[str, Piece], rig.Rig]:
    """Skin and garments of the body, and its rig."""
    surface, _ = figure.load()
    bones = rig.rig()
    arm = [n for n, name in enumerate(bones.names) if name[2:].startswith(("shoulder", "elbow", "wrist", "thumb"))]
    arm += [n for n, name in enumerate(bones.names) if any(f in name for f in rig.FINGERS)]
    arms = bones.weights[:, arm].sum(axis=1) > 0.5
    made = {
        "shirt": clothes.shirt(surface, arms),
        "trousers": clothes.trousers(surface, arms),
        "shoes": clothes.shoes(surface, arms),
    }
    hidden = np.any([garment.covered for garment in made.values()], axis=0)
    high = (surface.vertices[surface.quads][:, :, 1] > figure.EYE_LEVEL - 0.12).all(axis=1)
    body = (surface.tile != 0) & ~high  # what `figure.head` leaves
    kept = body & ~hidden[surface.quads].all(axis=1)
    used = np.unique(surface.quads[kept])
    row = np.full(len(surface.vertices), -1)
    row[used] = np.arange(len(used))
    quads = row[surface.quads[kept]]
    triangles = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    colours = np.tile([*SKIN, 0.38], (len(used), 1))
    found = {"skin": Piece("skin", surface.vertices[used], triangles, colours, bones.weights[used])}
    for name, garment in made.items():
        found[name] = Piece(
            "cloth", garment.vertices, garment.triangles, garment.colours, bones.weights[garment.source]
        )
    return found, bones
