"""Materials, vertex normals, checked arrays and unique names of the meshes of faces and bodies."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Generic, Literal, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from fba.arrays import Float32, Floating, Int32, Integer, Intp
from fba.errors import ModelError

Alpha = Literal["auto", "opaque", "mask", "blend"]
NORMAL_TOLERANCE = 1e-4
"""Lengths of normals within this of 1 are taken as 1."""


@dataclass(frozen=True, slots=True)
class Material:
    """How a surface looks.

    colour: linear light, 0..1. roughness: 0..1. texture: PNG, JPEG or WebP bytes, sRGB. opacity: 0..1.
    alpha: what a texture's alpha and the opacity mean. "opaque": nothing. "mask": pixels with less than
    `cutoff` are holes, others opaque. "blend": how much hides what is behind. "auto", for surfaces of this
    project: as "blend" where the texture has alpha. two_sided: whether the back is seen, too, and lit.
    """

    name: str = "plain"
    colour: tuple[float, float, float] = (0.8, 0.8, 0.8)
    roughness: float = 0.6
    texture: bytes | None = None
    opacity: float = 1.0
    alpha: Alpha = "auto"
    cutoff: float = 0.5
    two_sided: bool = False

    @property
    def gloss(self) -> float:
        """What vertices without a gloss of their own have; never 0, which is that of hair painted on skin."""
        return max(1.0 - self.roughness, 0.03)


def vertex_normals(vertices: Floating, triangles: Integer) -> Float32:
    """Return unit normals weighted by area: float32 (V, 3); +z where no triangle touches a vertex."""
    corners = np.asarray(vertices, dtype=np.float64)[triangles]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    summed = np.zeros((len(vertices), 3))
    for corner in range(3):
        for axis in range(3):
            summed[:, axis] += np.bincount(triangles[:, corner], faces[:, axis], minlength=len(vertices))
    length = np.linalg.norm(summed, axis=1, keepdims=True)
    unit = np.where(length > 1e-20, summed / np.maximum(length, 1e-20), (0.0, 0.0, 1.0))
    return unit.astype(np.float32)


def mesh_arrays(
    where: str,
    vertices: npt.ArrayLike,
    triangles: npt.ArrayLike,
    normals: npt.ArrayLike | None,
    texcoords: npt.ArrayLike | None,
    colours: npt.ArrayLike | None,
) -> dict[str, Float32 | Int32]:
    """Return checked, read-only copies of a mesh's arrays by name; missing normals are computed.

    where: begins messages. ModelError for other shapes, indices out of range, numbers not finite.
    """
    places = checked_rows(vertices, (-1, 3), f"{where}: vertices")
    count = len(places)
    corners = np.array(triangles)
    if corners.ndim != 2 or corners.shape[1] != 3 or corners.dtype.kind not in "iu":
        raise ModelError(f"{where}: triangles must be whole numbers, (F, 3), not {corners.shape}")
    if corners.size and (int(corners.min()) < 0 or int(corners.max()) >= count):
        bad = int(np.argwhere(((corners < 0) | (corners >= count)).any(axis=1))[0, 0])
        raise ModelError(
            f"{where}: triangle {bad} names vertex {corners[bad].tolist()}, but there are {count}"
        )
    corners = corners.astype(np.int32)
    arrays: dict[str, Float32 | Int32] = {"vertices": places, "triangles": corners}
    arrays["normals"] = (
        vertex_normals(places, corners)
        if normals is None
        else normalise_rows(checked_rows(normals, (count, 3), f"{where}: normals"))
    )
    if texcoords is not None:
        arrays["texcoords"] = checked_rows(texcoords, (count, 2), f"{where}: texture coordinates")
    if colours is not None:
        arrays["colours"] = checked_rows(colours, (count, 4), f"{where}: colours")
    for array in arrays.values():
        array.flags.writeable = False
    return arrays


def checked_rows(values: npt.ArrayLike, shape: tuple[int, int], what: str) -> Float32:
    """Return a finite float32 copy of a given shape: rows (-1: any number) and columns. Else ModelError."""
    array = np.array(values, dtype=np.float32)
    if array.ndim != 2 or array.shape[1] != shape[1] or (shape[0] >= 0 and len(array) != shape[0]):
        wanted = f"({'V' if shape[0] < 0 else shape[0]}, {shape[1]})"
        raise ModelError(f"{what} must have shape {wanted}, not {array.shape}")
    if not np.isfinite(array).all():
        row = int(np.argwhere(~np.isfinite(array))[0, 0])
        raise ModelError(f"{what}: number {row} is {array[row].tolist()}, which is not finite")
    return array


def normalise_rows(normals: Float32) -> Float32:
    """Return the normals scaled to length 1, in place; those that already have it keep their exact values."""
    length = np.linalg.norm(normals.astype(np.float64), axis=1)
    off = np.abs(length - 1.0) > NORMAL_TOLERANCE
    if off.any():
        turned = normals[off] / np.maximum(length[off], 1e-30)[:, None]
        normals[off] = np.where(length[off, None] > 1e-20, turned, (0.0, 0.0, 1.0))
    return normals


class Mesh(Protocol):
    """A named mesh: a part of a face or a body."""

    @property
    def name(self) -> str: ...
    @property
    def vertices(self) -> Float32: ...
    @property
    def triangles(self) -> Int32: ...
    @property
    def normals(self) -> Float32 | None: ...


Part = TypeVar("Part", bound=Mesh)
Number = TypeVar("Number", bound=np.generic)


class Meshes(Generic[Part]):
    """A model of several meshes, `parts`. Vertex indices of the model run through the parts in order."""

    parts: tuple[Part, ...]

    @cached_property
    def vertices(self) -> Float32:
        """float32 (V, 3): vertices of the model at rest, all parts in order, metres; read-only."""
        return join_rows([part.vertices for part in self.parts])

    @cached_property
    def normals(self) -> Float32:
        """float32 (V, 3): unit normals of the model as it rests; read-only."""
        return join_rows([part.normals for part in self.parts if part.normals is not None])

    @cached_property
    def triangles(self) -> Int32:
        """int32 (F, 3): indices into `vertices`; read-only."""
        return join_rows([part.triangles + np.int32(self.starts[part.name]) for part in self.parts])

    @cached_property
    def starts(self) -> dict[str, int]:
        """Index of each part's first vertex in `vertices`."""
        counts = np.cumsum([0, *(len(part.vertices) for part in self.parts)])
        return {part.name: int(start) for part, start in zip(self.parts, counts[:-1], strict=True)}

    def part(self, name: str) -> Part:
        """Return a part by name; ModelError if it does not exist."""
        for part in self.parts:
            if part.name == name:
                return part
        raise ModelError(f"no part {name!r}; there are {', '.join(part.name for part in self.parts)}")


def join_rows(arrays: Sequence[npt.NDArray[Number]]) -> npt.NDArray[Number]:
    """Return the rows of all arrays, concatenated; read-only."""
    rows = np.concatenate(arrays)
    rows.flags.writeable = False
    return rows


def connected(edges: Integer, count: int) -> Intp:
    """Return (count,) number of the connected piece of each vertex. edges: (E, 2), between two vertices."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], dtype=np.intp)


def result_array(shape: tuple[int, ...], out: Float32 | None, normals: Float32 | None) -> Float32:
    """Return the array to write vertices to: `out`, or a new one if None. Both given arrays are checked.

    Raises ValueError where one is not a writable, C-contiguous float32 array of the shape, or they overlap.
    """
    for name, target in (("out", out), ("normals", normals)):
        if target is not None:
            _check_target(target, shape, name)
    if out is None:
        return np.empty(shape, dtype=np.float32)
    if normals is not None and np.may_share_memory(out, normals):
        raise ValueError("out and normals share memory; give each an array of its own")
    return out


def _check_target(target: Any, shape: tuple[int, ...], name: str) -> None:
    if not isinstance(target, np.ndarray) or target.dtype != np.float32 or target.shape != shape:
        found = f"{target.dtype} {target.shape}" if isinstance(target, np.ndarray) else type(target).__name__
        raise ValueError(f"{name} must be a float32 array of shape {shape}, not {found}")
    if not (target.flags.c_contiguous and target.flags.writeable):
        raise ValueError(f"{name} must be C-contiguous and writable")


class UniqueNames:
    """Gives names, numbered where they are taken: "skin", "skin 2", "skin 3".

    taken: names that are not given. The time for each name does not grow with the number of equal ones.
    """

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._last = dict.fromkeys(taken, 1)

    def __call__(self, name: str) -> str:
        """Return the name, or the name with the next free number; it is taken from now on."""
        number = self._last.get(name, 0) + 1
        unique = name
        if number > 1:
            while (unique := f"{name} {number}") in self._last:
                number += 1
            self._last[unique] = 1
        self._last[name] = number
        return unique
