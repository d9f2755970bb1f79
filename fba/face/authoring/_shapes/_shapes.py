"""Shapes (morph targets) of a face, measured at its feature points and cut into left and right halves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Floating
from fba.errors import ModelError
from fba.face.authoring.surface.landmarks import weld_skin
from fba.face.authoring.surface.surface import Surface
from fba.face.model import FaceModel, Part
from fba.sampling import smoothstep

BLEND = 0.12
"""Half the width over which a shape fades from one side to the other, as a share of ES0."""
MIN_HALF_MOTION = 1e-3
"""Share of its shape's motion below which a half is left out."""

Morphs = Mapping[str, Mapping[str, Floating]]


@dataclass(frozen=True, slots=True)
class Half:
    """One side of a shape: side +1 left, -1 right."""

    shape: str
    side: int


@dataclass(frozen=True, eq=False)
class Shapes:
    """Shapes of a face model; `check_shapes` makes them from unchecked ones.

    morphs: displacements (V, 3) at weight 1, in metres, by shape and part.
    """

    model: FaceModel
    morphs: Mapping[str, Mapping[str, Float32]]

    @cached_property
    def _left(self) -> Float64:
        """(V,) share of the left half at each vertex of the model."""
        middle = float(np.nanmean(self.model.points[:, 0]))
        width = max(2 * BLEND * self.model.fapu.ES * 1024, 1e-9)
        return smoothstep((self.model.vertices[:, 0].astype(np.float64) - middle) / width + 0.5)

    @cached_property
    def surface(self) -> Surface:
        """Skin and inner mouth of the model as one surface; lips on each other stay apart."""
        return weld_skin(self.model.parts, self.model.bound)

    def _side(self, side: int) -> Float64:
        return self._left if side > 0 else 1.0 - self._left

    @cached_property
    def halves(self) -> list[Half]:
        """Return the halves that move at least `MIN_HALF_MOTION` of what their shape moves."""
        halves = []
        for shape in self.morphs:
            sizes = np.linalg.norm(self.displacements(shape), axis=1)
            least = MIN_HALF_MOTION * float(sizes.max(initial=0.0))
            halves += [Half(shape, side) for side in (1, -1) if (sizes * self._side(side)).max() > least]
        return halves

    def field(self, half: Half) -> Float64:
        """Return (V, 3) displacements of all vertices of the model by half a shape, metres."""
        return self.displacements(half.shape) * self._side(half.side)[:, None]

    def displacements(self, shape: str) -> Float64:
        """Return (V, 3) displacements of all vertices of the model by a shape, metres."""
        field = np.zeros((len(self.model.vertices), 3))
        for part, moved in self.morphs[shape].items():
            start = self.model.starts[part]
            field[start : start + len(moved)] = moved
        return field

    def mix(self, weights: npt.ArrayLike) -> Float64:
        """Return (V, 3) sum of all halves, each times its weight, metres."""
        field = np.zeros((len(self.model.vertices), 3))
        for half, weight in zip(self.halves, np.asarray(weights, dtype=np.float64), strict=True):
            if weight:
                field += weight * self.field(half)
        return field

    def displacements_at(self, vertices: npt.ArrayLike) -> Float64:
        """Return (H, N, 3): displacements of the given vertices by each half."""
        rows = np.asarray(vertices, dtype=np.intp)
        fields = [self.field(half)[rows] for half in self.halves]
        return np.array(fields).reshape(len(fields), len(rows), 3)


def check_shapes(model: FaceModel, morphs: Morphs) -> Shapes:
    """Return the shapes of a model: displacements (V, 3) at weight 1, metres, by shape and part.

    Raises ModelError where a part does not exist, has another number of vertices, or moves by numbers that
    are not finite.
    """
    return Shapes(model, {shape: _check_shape(model.parts, shape, moved) for shape, moved in morphs.items()})


def _check_shape(parts: Sequence[Part], shape: str, moved: Mapping[str, Floating]) -> dict[str, Float32]:
    """Return the displacements of one shape, checked against the parts."""
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
