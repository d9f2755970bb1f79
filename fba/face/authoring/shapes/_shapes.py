"""Shapes (morph targets) of a face, measured at its feature points and cut into left and right halves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Floating
from fba.easing import smoothstep
from fba.errors import ModelError
from fba.face.model import FaceModel, Part

BLEND = 0.12
"""Half the width over which a shape fades from one side to the other, as a share of ES0."""
STILL = 1e-3
"""A half that moves less than this share of its shape is left out."""

Morphs = Mapping[str, Mapping[str, Floating]]


@dataclass(frozen=True, slots=True)
class Half:
    """One side of a shape: side +1 left, -1 right."""

    shape: str
    side: int


class Shapes:
    """Shapes of a face model.

    morphs: displacements (V, 3) at weight 1, in metres, by shape and part. Raises ModelError where a part
    does not exist, has another number of vertices, or moves by numbers that are not finite.
    """

    def __init__(self, model: FaceModel, morphs: Morphs) -> None:
        self.model = model
        self.morphs = {
            shape: check_displacements(model.parts, shape, moved) for shape, moved in morphs.items()
        }
        middle = float(np.nanmean(model.points[:, 0]))
        width = max(2 * BLEND * model.fapu.ES * 1024, 1e-9)
        self._left = smoothstep((model.vertices[:, 0].astype(np.float64) - middle) / width + 0.5)
        self.halves = [half for shape in self.morphs for half in self._halves(shape)]

    def field(self, half: Half) -> Float64:
        """(V, 3) displacements of all vertices of the model by half a shape, metres."""
        field = self.displacements(half.shape)
        field *= (self._left if half.side > 0 else 1.0 - self._left)[:, None]
        return field

    def displacements(self, shape: str) -> Float64:
        """(V, 3) displacements of all vertices of the model by a shape, metres."""
        field = np.zeros((len(self.model.vertices), 3))
        for part, moved in self.morphs[shape].items():
            start = self.model.starts[part]
            field[start : start + len(moved)] = moved
        return field

    def mix(self, weights: npt.ArrayLike) -> Float64:
        """(V, 3) sum of all halves, each times its weight, metres."""
        field = np.zeros((len(self.model.vertices), 3))
        for half, weight in zip(self.halves, np.asarray(weights, dtype=np.float64), strict=True):
            if weight:
                field += weight * self.field(half)
        return field

    def displacements_at(self, vertices: npt.ArrayLike) -> Float64:
        """(H, N, 3): displacements of the given vertices by each half."""
        chosen = np.asarray(vertices, dtype=np.intp)
        found = np.zeros((len(self.halves), len(chosen), 3))
        for number, half in enumerate(self.halves):
            found[number] = self.field(half)[chosen]
        return found

    def _halves(self, shape: str) -> list[Half]:
        sizes = np.linalg.norm(self.displacements(shape), axis=1)
        most = float(sizes.max(initial=0.0))
        if not most > 0:
            return []
        return [
            Half(shape, side)
            for side, share in ((1, self._left), (-1, 1.0 - self._left))
            if float((sizes * share).max()) > STILL * most
        ]


def check_displacements(
    parts: Sequence[Part], shape: str, moved: Mapping[str, Floating]
) -> dict[str, Float32]:
    """The displacements of one shape, checked against the parts."""
    counts = {part.name: len(part.vertices) for part in parts}
    result = {}
    for name, array in moved.items():
        where = f"shape {shape!r}, part {name!r}"
        if name not in counts:
            raise ModelError(f"{where}: there is no such part; there are {', '.join(counts)}")
        displacements = np.array(array, dtype=np.float32)
        if displacements.shape != (counts[name], 3):
            raise ModelError(f"{where}: displacements must be ({counts[name]}, 3), not {displacements.shape}")
        if not np.isfinite(displacements).all():
            bad = int(np.argwhere(~np.isfinite(displacements))[0, 0])
            raise ModelError(f"{where}: the displacement of vertex {bad} is not finite")
        result[name] = displacements
    return result
