"""FaceDefTables: the effect of each FAP on the vertices and the parts of a face model.

ISO/IEC 14496-1, nodes FaceDefTables, FaceDefMesh and FaceDefTransform. One FAP moves vertices along
piecewise linear paths (`FaceDefMesh`) and rotates, scales or shifts whole parts (`FaceDefTransform`).
Shifts of a vertex by several FAPs add up; transforms are applied afterwards, a part's own before the head's.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Int32
from fba.errors import ModelError
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP

HEAD = "head"
"""The part name that stands for all parts together."""
KINDS = ("rotation", "scale", "translation")
"""Kinds of transforms; the index in the tuple + 1 is the standard's fieldId."""


@dataclass(frozen=True, eq=False)
class FaceDefMesh:
    """Vertices of one part that a FAP moves, and their displacements.

    part: its name. borders: int32 (K,), K >= 2, FAP values in ascending order, exactly one of them 0.
    vertices: int32 (N,), indices into the part's vertices, each once. displacements: float32
    (N, K - 1, 3): on interval j (from borders[j] to borders[j + 1]) one step of the FAP moves vertex i
    by displacements[i, j] x FAPU. The outermost intervals extend beyond the outermost borders.

    Arrays are copied and read-only. Raises ModelError where one is not as described.
    """

    part: str
    borders: Int32
    vertices: Int32
    displacements: Float32

    def __post_init__(self) -> None:
        borders = _integers(self.borders, "interval borders", self.part)
        vertices = _integers(self.vertices, "vertex indices", self.part)
        moves = np.array(self.displacements, dtype=np.float32)
        if len(borders) < 2 or (np.diff(borders.astype(np.int64)) <= 0).any():
            raise ModelError(
                f"FaceDefMesh of {self.part!r}: at least two rising interval borders are needed, "
                f"not {borders.tolist()[:8]}"
            )
        if np.count_nonzero(borders == 0) != 1:
            raise ModelError(
                f"FaceDefMesh of {self.part!r}: exactly one interval border must be 0, "
                f"but they are {borders.tolist()[:8]}"
            )
        if moves.shape != (len(vertices), len(borders) - 1, 3):
            raise ModelError(
                f"FaceDefMesh of {self.part!r}: {len(vertices)} vertices and {len(borders)} borders need "
                f"displacements of shape ({len(vertices)}, {len(borders) - 1}, 3), not {moves.shape}"
            )
        if not np.isfinite(moves).all():
            row = int(np.argwhere(~np.isfinite(moves))[0, 0])
            raise ModelError(
                f"FaceDefMesh of {self.part!r}: the displacement of vertex {vertices[row]} is not finite"
            )
        if len(vertices) and int(vertices.min()) < 0:
            raise ModelError(f"FaceDefMesh of {self.part!r}: vertex index {vertices.min()} is negative")
        unique, counts = np.unique(vertices, return_counts=True)
        if (counts > 1).any():
            twice = int(unique[counts > 1][0])
            raise ModelError(f"FaceDefMesh of {self.part!r}: vertex {twice} is listed more than once")
        for name, array in (("borders", borders), ("vertices", vertices), ("displacements", moves)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def shift(self, value: float) -> Float32:
        """Return the shift of each vertex by a FAP value, in FAPU: float32 (N, 3)."""
        return interval_lengths(self.borders, value) @ self.displacements


def interval_lengths(borders: Int32, value: float) -> Float32:
    """Return the length of each interval between 0 and a FAP value: float32 (K - 1,), with the value's sign.

    The worked example of the standard: borders [-1000, 0, 500, 1000] and the value 600 give
    [0, 500, 100].
    """
    edges = borders.astype(np.float64)
    edges[0], edges[-1] = min(edges[0], value), max(edges[-1], value)
    low, high = min(0.0, value), max(0.0, value)
    inside = np.clip(np.minimum(edges[1:], high) - np.maximum(edges[:-1], low), 0.0, None)
    return np.asarray((inside * (1.0 if value >= 0 else -1.0)).astype(np.float32))


@dataclass(frozen=True, eq=False)
class FaceDefTransform:
    """A rotation, scale or translation of a part.

    part: its name, or `HEAD` for all. kind: "rotation", "scale" or "translation". amount: float (3,), for
    one step of the FAP: "rotation", the axis times radians per FAPU (1e-5 rad a step where the unit is AU);
    "scale", the growth of each axis per FAPU, 0 for none; "translation", the shift per FAPU. centre: (3,),
    the fixed point of a rotation or scale, in the neutral face.

    Raises ModelError where a number is not finite or the kind unknown.
    """

    part: str
    kind: str
    amount: tuple[float, float, float]
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise ModelError(
                f"FaceDefTransform of {self.part!r}: {self.kind!r} is not one of {', '.join(KINDS)}"
            )
        for name in ("amount", "centre"):
            numbers = np.asarray(getattr(self, name), dtype=np.float64)
            if numbers.shape != (3,) or not np.isfinite(numbers).all():
                raise ModelError(
                    f"FaceDefTransform of {self.part!r}: {name} must be three finite numbers, "
                    f"not {getattr(self, name)!r}"
                )
            object.__setattr__(self, name, tuple(float(n) for n in numbers))


@dataclass(frozen=True, eq=False)
class FaceDefTables:
    """The effect of one FAP. fap: its number, 3..68. ModelError for another, or two meshes of a part."""

    fap: int
    meshes: tuple[FaceDefMesh, ...] = ()
    transforms: tuple[FaceDefTransform, ...] = field(default=())

    def __post_init__(self) -> None:
        if not FIRST_LOW_LEVEL_FAP <= self.fap <= FAP_COUNT:
            raise ModelError(
                f"FaceDefTables: FAP {self.fap} cannot have tables, only {FIRST_LOW_LEVEL_FAP}..{FAP_COUNT}; "
                "visemes and expressions are defined by FAPs"
            )
        names = [mesh.part for mesh in self.meshes]
        for name in names:
            if names.count(name) > 1:
                raise ModelError(f"FaceDefTables of FAP {self.fap}: part {name!r} has two FaceDefMesh")
        object.__setattr__(self, "meshes", tuple(self.meshes))
        object.__setattr__(self, "transforms", tuple(self.transforms))


def _integers(values: npt.ArrayLike, what: str, part: str) -> Int32:
    array = np.array(values)
    if array.ndim != 1 or (array.size and array.dtype.kind not in "iu"):
        raise ModelError(f"FaceDefMesh of {part!r}: {what} must be a list of whole numbers")
    if array.size and (int(array.min()) < -(2**31) or int(array.max()) >= 2**31):
        raise ModelError(f"FaceDefMesh of {part!r}: {what} must fit 32 bits")
    return array.astype(np.int32)
