"""A face: meshes, the feature points bound to them, and the tables by which FAPs move them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Float64, Int32
from fba.errors import ModelError
from fba.face._expressions import Definitions
from fba.face._tables import HEAD, FaceDefMesh, FaceDefTables
from fba.face.fapu import Fapu
from fba.face.feature_points import names
from fba.limits import DEFAULT_LIMITS, Limits
from fba.mesh import Material, Meshes, mesh_arrays
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, faps

if TYPE_CHECKING:
    from fba.face.interpolation.table import InterpolationTable

__all__ = ["PART_KINDS", "FaceModel", "Material", "Part", "bind"]


PART_KINDS = ("skin", "eye", "teeth", "tongue", "mouth", "brow", "lash", "hair", "other")
"""Kinds of parts. "mouth" is the inside of the mouth where it is not part of the skin; "eye" a whole eyeball,
left or right by the side of its centre."""
SHARED_POINT = 1e-4
"""Largest distance of a bound feature point from its vertex, as a share of the face's height."""
DISPLACEMENT_BITS = 20
"""Displacements are rounded to multiples of 2**-DISPLACEMENT_BITS of the largest of their FaceDefMesh."""
COLOUR_SHADES = 65535
"""Colours become multiples of 1 / COLOUR_SHADES, which glTF stores in 16 bits."""


@dataclass(frozen=True, eq=False)
class Part:
    """One mesh of a face.

    name: unique in its model. kind: one of `PART_KINDS`. vertices: float32 (V, 3), metres, neutral face.
    triangles: int32 (F, 3), counter-clockwise from outside. normals: float32 (V, 3), made unit, or None
    to have them computed. texcoords: float32 (V, 2), origin at the picture's top left, or None. colours:
    float32 (V, 4), linear light, the fourth how glossy, or None for the material's.

    Arrays are read-only copies. ModelError for other shapes, indices out of range, numbers not finite.
    """

    name: str
    kind: str
    vertices: Float32
    triangles: Int32
    normals: Float32 | None = None
    texcoords: Float32 | None = None
    colours: Float32 | None = None
    material: Material = field(default_factory=Material)

    def __post_init__(self) -> None:
        where = f"part {self.name!r}"
        if not self.name or self.name == HEAD:
            raise ModelError(f"{where}: a part needs a name other than {HEAD!r}, which stands for all parts")
        if self.kind not in PART_KINDS:
            raise ModelError(f"{where}: its kind {self.kind!r} is not one of {', '.join(PART_KINDS)}")
        arrays = mesh_arrays(where, self.vertices, self.triangles, self.normals, self.texcoords, self.colours)
        for name, array in arrays.items():
            object.__setattr__(self, name, array)


@dataclass(frozen=True, eq=False)
class FaceModel(Meshes[Part]):
    """A face that FAPs can move.

    parts: its meshes; vertices of the whole model are counted through them in order. points: float64
    (84, 3), the neutral feature points in metres, rows as `feature_point_names()`, NaN where the face
    has none. bound: int32 (84,), the vertex that each is at, -1 for those on no mesh (the centre of the
    head, the thickness of hair). tables: the effect of each FAP, each FAP at most once. fit: how unsent
    FAPs follow from sent ones, or None for the standard's mates. definitions: the FAPs of visemes and
    expressions. lost: FAPs without tables and why, by number. notes: origin, licence and the like. wrinkles:
    whether players draw wrinkles on the skin as FAPs move it; drawn faces look wrong with them. levels:
    coarser faces for small sizes on the screen, from fine to coarse; see `fba.face.simplification`.

    Axes: +x the subject's left, +y up, +z forward. Raises ModelError naming the part, point or FAP that is
    wrong.
    """

    parts: tuple[Part, ...]
    points: Float64
    bound: Int32
    tables: tuple[FaceDefTables, ...] = ()
    fit: InterpolationTable | None = None
    definitions: Definitions = field(default_factory=Definitions.default)
    name: str = ""
    lost: Mapping[int, str] = field(default_factory=dict)
    notes: Mapping[str, str] = field(default_factory=dict)
    wrinkles: bool = False
    levels: tuple[DetailLevel, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "parts", tuple(self.parts))
        object.__setattr__(self, "tables", tuple(sorted(self.tables, key=lambda table: table.fap)))
        if not self.parts:
            raise ModelError("a face needs at least one part")
        part_names = [part.name for part in self.parts]
        for name in part_names:
            if part_names.count(name) > 1:
                raise ModelError(f"two parts are named {name!r}")
        self._check_points()
        self._check_tables()
        for number in self.lost:
            if not FIRST_LOW_LEVEL_FAP <= number <= FAP_COUNT:
                raise ModelError(
                    f"`lost` names FAP {number}, but only {FIRST_LOW_LEVEL_FAP}..{FAP_COUNT} exist"
                )
        object.__setattr__(self, "lost", dict(self.lost))
        object.__setattr__(self, "notes", dict(self.notes))
        object.__setattr__(self, "levels", tuple(self.levels))
        for number, level in enumerate(self.levels):
            level.check(self, f"level {number + 1}")
        _ = self.fapu  # raises ModelError for a face without units

    @staticmethod
    def default() -> FaceModel:
        """Return the built-in head."""
        from fba.face.builtin import default

        return default()

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, limits: Limits = DEFAULT_LIMITS) -> FaceModel:
        """Return a face from a glTF 2.0 file (.glb or .gltf) with the FBA extension, as `save` writes it.

        Raises FormatError where the file cannot be opened; ModelError, with the position in it, where it is
        damaged, contradicts itself, or lacks the extension; LimitError where it takes more memory than the
        limits allow.
        """
        from fba.face.gltf._storage import load

        return load(path, limits)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the face as glTF 2.0 (.glb), atomically."""
        from fba.face.gltf._storage import save

        save(path, self)

    @property
    def feature_points(self) -> Float64:
        """float64 (84, 3): the neutral feature points, metres; NaN where the face has none."""
        return self.points

    @cached_property
    def fapu(self) -> Fapu:
        """The units in which FAPs move this face."""
        return Fapu.measure(self.points)

    @cached_property
    def table_of(self) -> dict[int, FaceDefTables]:
        """Tables by FAP number."""
        return {table.fap: table for table in self.tables}

    @property
    def missing(self) -> tuple[str, ...]:
        """Names of the feature points that the face does not have."""
        return tuple(n for n, p in zip(names(), self.points, strict=True) if np.isnan(p).any())

    def of_kind(self, kind: str) -> tuple[Part, ...]:
        """Return all parts of a kind."""
        return tuple(part for part in self.parts if part.kind == kind)

    def with_tables(self, tables: tuple[FaceDefTables, ...], lost: Mapping[int, str]) -> FaceModel:
        """Return the same face with other tables."""
        return replace(self, tables=tables, lost=lost, levels=())

    def with_notes(self, notes: Mapping[str, str]) -> FaceModel:
        """Return the same face with more notes."""
        return replace(self, notes={**self.notes, **notes})

    def _check_points(self) -> None:
        points = np.array(self.points, dtype=np.float64)
        if points.shape != (len(names()), 3):
            raise ModelError(f"feature points must have shape ({len(names())}, 3), not {points.shape}")
        bound = np.array(self.bound)
        if bound.shape != (len(names()),) or bound.dtype.kind not in "iu":
            raise ModelError(f"bound vertices must be {len(names())} whole numbers, -1 for none")
        for row, name in enumerate(names()):
            if np.isinf(points[row]).any() or np.isnan(points[row]).any() != np.isnan(points[row]).all():
                raise ModelError(f"feature point {name} at {points[row].tolist()} is not finite")
            vertex = int(bound[row])
            if vertex >= len(self.vertices) or vertex < -1:
                raise ModelError(
                    f"feature point {name} is bound to vertex {vertex}, but there are {len(self.vertices)}"
                )
            if vertex >= 0 and np.isnan(points[row]).any():
                raise ModelError(f"feature point {name} is bound to vertex {vertex}, but has no position")
        height = float(np.ptp(self.vertices[:, 1])) if len(self.vertices) else 0.0
        rows = np.flatnonzero(bound >= 0)
        away = np.linalg.norm(self.vertices[bound[rows]] - points[rows], axis=1)
        if len(away) and float(away.max()) > SHARED_POINT * max(height, 1e-9):
            row = int(rows[away.argmax()])
            raise ModelError(
                f"feature point {names()[row]} is {away.max():g} m away from its vertex {bound[row]}"
            )
        points.flags.writeable = False
        object.__setattr__(self, "points", points)
        bound = bound.astype(np.int32)
        bound.flags.writeable = False
        object.__setattr__(self, "bound", bound)

    def _check_tables(self) -> None:
        sizes = {part.name: len(part.vertices) for part in self.parts}
        seen: set[int] = set()
        for table in self.tables:
            where = f"FaceDefTables of FAP {table.fap} {faps()[table.fap - 1].name}"
            if table.fap in seen:
                raise ModelError(
                    f"{where}: this FAP has two of them; put all its meshes and transforms into one"
                )
            seen.add(table.fap)
            for mesh in table.meshes:
                if mesh.part not in sizes:
                    raise ModelError(f"{where}: there is no part {mesh.part!r}")
                if len(mesh.vertices) and int(mesh.vertices.max()) >= sizes[mesh.part]:
                    raise ModelError(
                        f"{where}: vertex {mesh.vertices.max()} of part {mesh.part!r}, "
                        f"which has {sizes[mesh.part]}"
                    )
            for transform in table.transforms:
                if transform.part != HEAD and transform.part not in sizes:
                    raise ModelError(f"{where}: there is no part {transform.part!r}")


@dataclass(frozen=True, eq=False)
class DetailLevel:
    """A coarser face of the same parts, and how it belongs to the full one.

    parents: int32 (V,), the vertex of `model` that stands for each of the full face's; read-only.
    """

    model: FaceModel
    parents: Int32

    def __post_init__(self) -> None:
        parents = np.array(self.parents, dtype=np.int32)
        parents.flags.writeable = False
        object.__setattr__(self, "parents", parents)

    def check(self, full: FaceModel, where: str) -> None:
        """Raise ModelError where this is no level of a face."""
        if self.model.levels:
            raise ModelError(f"{where}: a level of detail has no levels itself")
        if [part.name for part in self.model.parts] != [part.name for part in full.parts]:
            raise ModelError(f"{where}: its parts are not those of the face")
        if self.parents.shape != (len(full.vertices),):
            raise ModelError(f"{where}: {len(full.vertices)} parents are needed, not {self.parents.shape}")
        if len(self.parents) and not 0 <= self.parents.min() <= self.parents.max() < len(self.model.vertices):
            raise ModelError(f"{where}: parents beyond its {len(self.model.vertices)} vertices")


def bind(parts: tuple[Part, ...], points: npt.ArrayLike, most: float) -> Int32:
    """Return int32 (84,): for each feature point the nearest vertex at most `most` metres away, else -1."""
    from scipy.spatial import cKDTree

    positions = np.asarray(points, dtype=np.float64)
    tree = cKDTree(np.concatenate([part.vertices for part in parts]))
    known = np.isfinite(positions).all(axis=1)
    bound = np.full(len(positions), -1, dtype=np.int32)
    distance, vertex = tree.query(positions[known])
    bound[known] = np.where(distance <= most, vertex, -1)
    return bound


def compact(model: FaceModel) -> FaceModel:
    """Return the face, displacements rounded to 2**-20 of the largest, colours to multiples of 1/65535.

    The error is less than a millionth of a vertex's motion; files get at least a tenth smaller. `save` does
    not round. Vertices that a FAP moves by less than the rounding stay in its tables.
    """
    return replace(
        model,
        parts=tuple(_compact_part(part) for part in model.parts),
        tables=tuple(
            FaceDefTables(table.fap, tuple(_compact_mesh(mesh) for mesh in table.meshes), table.transforms)
            for table in model.tables
        ),
    )


def _compact_part(part: Part) -> Part:
    if part.colours is None:
        return part
    steps = np.float32(COLOUR_SHADES)
    return replace(part, colours=np.rint(np.clip(part.colours, 0, 1) * steps) / steps)


def _compact_mesh(mesh: FaceDefMesh) -> FaceDefMesh:
    largest = float(np.abs(mesh.displacements).max(initial=0.0))
    if not largest:
        return mesh
    step = 2.0 ** (np.ceil(np.log2(largest)) - DISPLACEMENT_BITS)
    rounded: Float32 = (np.rint(mesh.displacements.astype(np.float64) / step) * step).astype(np.float32)
    return replace(mesh, displacements=rounded)
