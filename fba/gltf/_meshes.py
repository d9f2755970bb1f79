"""Meshes of a glTF file: triangles, attributes, morph targets.

Primitives packed by Draco (KHR_draco_mesh_compression) are read by the package DracoPy where it is installed;
without it they are refused with a remedy: Draco's own code is C++, and too large to write again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fba.arrays import Array, Float32, Int32
from fba.errors import warn
from fba.gltf._accessors import Accessors
from fba.gltf._document import MAX_ITEMS, Document, find_extension
from fba.gltf._scene import GltfMesh, Primitive
from fba.gltf._values import Value

TRIANGLES = 4
STRIP = 5
FAN = 6
"""Modes of primitives that are surfaces."""
MODES = 7
"""Number of modes of primitives."""
MAX_TARGETS = 4096
"""Most morph targets of a mesh."""
MAX_SETS = 8
"""Most sets of texture coordinates, or of joints, that are read."""
DRACO = "KHR_draco_mesh_compression"


def read_meshes(document: Document, accessors: Accessors, materials: int) -> tuple[GltfMesh, ...]:
    """Return all meshes, in order; materials: how many there are."""
    return tuple(
        _mesh(document, accessors, entry, n, materials) for n, entry in enumerate(document.entries("meshes"))
    )


def _mesh(document: Document, accessors: Accessors, entry: Value, number: int, materials: int) -> GltfMesh:
    name = entry.get("name")
    entries = entry.member("primitives").elements(MAX_ITEMS)
    primitives = []
    for each in entries:
        document.budget.charge(1024, each)
        mode = each.get("mode")
        if mode is not None and mode.integer(0, MODES - 1) < TRIANGLES:
            warn(f"{each.file}: {each.path}: points or lines, not triangles; left out", stacklevel=5)
            continue
        primitives.append(_Reader(document, accessors, each, materials).primitive())
    counts = {len(primitive.morphs) for primitive in primitives}
    if len(counts) > 1:
        raise entry.error(
            f"its primitives have {sorted(counts)} morph targets; all must have the same number"
        )
    count = counts.pop() if counts else 0
    weights = entry.get("weights")
    if weights is not None and primitives and len(weights.elements(MAX_TARGETS)) != count:
        raise weights.error(f"{len(weights.data)} weights for {count} morph targets")
    return GltfMesh(
        name=f"mesh {number}" if name is None else name.text(),
        primitives=tuple(primitives),
        morph_names=_names(entry, entries, count),
        weights=(0.0,) * count if weights is None or not primitives else weights.numbers(count),
    )


def _names(entry: Value, primitives: list[Value], count: int) -> tuple[str, ...]:
    """Return the names of the morph targets, from the extras of the mesh or of its first primitive."""
    for holder in (entry, *primitives[:1]):
        extras = holder.get("extras")
        names = extras.get("targetNames") if extras is not None and isinstance(extras.data, dict) else None
        if names is None:
            continue
        given = [name.text() for name in names.elements(MAX_TARGETS)]
        if len(given) == count:
            return tuple(given)
        if count:
            warn(
                f"{names.file}: {names.path}: {len(given)} names for {count} morph targets; ignored",
                stacklevel=6,
            )
    return tuple(f"target {number}" for number in range(count))


class _Reader:
    """Reads one primitive."""

    def __init__(self, document: Document, accessors: Accessors, entry: Value, materials: int) -> None:
        self._document = document
        self._accessors = accessors
        self._entry = entry
        self._materials = materials
        self._attributes = entry.member("attributes")

    def primitive(self) -> Primitive:
        """Return the primitive; ModelError where it is damaged."""
        unpack_primitive(self._document, self._accessors, self._entry)
        positions = self._accessors.floats(self._attributes.member("POSITION"), "VEC3")
        count = len(positions)
        normals = self._attributes.get("NORMAL")
        joints, weights = self._skinning(count)
        material = self._entry.get("material")
        return Primitive(
            positions=positions,
            triangles=self._triangles(count),
            normals=None if normals is None else self._accessors.floats(normals, "VEC3", count=count),
            texcoords=tuple(
                self._accessors.floats(value, "VEC2", count=count) for value in self._sets("TEXCOORD")
            ),
            colours=self._colours(count),
            joints=joints,
            weights=weights,
            morphs=self._morphs(count),
            material=None if material is None else material.index(self._materials, "material"),
        )

    def _sets(self, name: str) -> list[Value]:
        sets = []
        for number in range(MAX_SETS):
            value = self._attributes.get(f"{name}_{number}")
            if value is None:
                break
            sets.append(value)
        return sets

    def _colours(self, count: int) -> Float32 | None:
        value = self._attributes.get("COLOR_0")
        if value is None:
            return None
        colours = self._accessors.floats(value, "VEC3", "VEC4", count=count)
        if colours.shape[1] == 3:
            self._document.budget.charge(count * 16, value)
            colours = np.concatenate([colours, np.ones((count, 1), np.float32)], axis=1)
            colours.flags.writeable = False
        return colours

    def _skinning(self, count: int) -> tuple[Int32 | None, Float32 | None]:
        joints, weights = self._sets("JOINTS"), self._sets("WEIGHTS")
        if len(joints) != len(weights):
            raise self._attributes.error(f"{len(joints)} sets of JOINTS, but {len(weights)} of WEIGHTS")
        if not joints:
            return None, None
        self._document.budget.charge(count * 32 * len(joints), self._attributes)
        which = np.concatenate(
            [self._accessors.integers(value, "VEC4", count=count) for value in joints], axis=1
        )
        if int(which.max()) > MAX_ITEMS:
            raise joints[0].error(f"names joint {which.max()}, more than a file can have")
        share = np.concatenate(
            [self._accessors.floats(value, "VEC4", count=count) for value in weights], axis=1
        )
        if (share < 0).any():
            raise weights[0].error("a weight is negative")
        joint_numbers = which.astype(np.int32)
        joint_numbers.flags.writeable = share.flags.writeable = False
        return joint_numbers, share

    def _triangles(self, count: int) -> Int32:
        mode, reference = self._entry.get("mode"), self._entry.get("indices")
        if reference is None:
            self._document.budget.charge(count * 8, self._entry)
            corners = np.arange(count, dtype=np.int64)
        else:
            raw = self._accessors.integers(reference, "SCALAR")[:, 0]
            self._document.budget.charge(len(raw) * 8, reference)
            if int(raw.max()) >= count:
                position = int(raw.argmax())
                raise reference.error(f"element {position} names vertex {raw.max()}, but there are {count}")
            corners = raw.astype(np.int64)
        where = self._entry if reference is None else reference
        shape = TRIANGLES if mode is None else mode.integer(0, MODES - 1)
        if shape == TRIANGLES and len(corners) % 3:
            raise where.error(f"{len(corners)} corners are not a multiple of 3")
        if shape != TRIANGLES:
            self._document.budget.charge(len(corners) * 24, where)
        triangles = _TO_TRIANGLES[shape](corners).astype(np.int32)
        triangles.flags.writeable = False
        return triangles

    def _morphs(self, count: int) -> tuple[Float32 | None, ...]:
        morphs: list[Float32 | None] = []
        for target in self._entry.elements(MAX_TARGETS, "targets"):
            self._document.budget.charge(256, target)
            value = target.get("POSITION")
            morphs.append(None if value is None else self._accessors.floats(value, "VEC3", count=count))
        return tuple(morphs)


Corners = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


def _strip(corners: Corners) -> Corners:
    triangles = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    triangles[1::2] = triangles[1::2][:, [1, 0, 2]]  # every other triangle has the opposite order
    return triangles


def _fan(corners: Corners) -> Corners:
    return np.stack([corners[1:-1], corners[2:], np.broadcast_to(corners[:1], len(corners[2:]))], axis=1)


_TO_TRIANGLES: dict[int, Callable[[Corners], Corners]] = {
    TRIANGLES: lambda corners: corners.reshape(-1, 3),
    STRIP: _strip,
    FAN: _fan,
}


def unpack_primitive(document: Document, accessors: Accessors, primitive: Value) -> None:
    """Fill the accessors of a primitive that Draco packed; others are left as they are.

    Raises ModelError where the package is missing, or the data are damaged or of another size than the
    accessors say.
    """
    packing = find_extension(primitive, DRACO)
    if packing is None:
        return
    given = primitive.get("mode")
    if given is not None and given.integer(0, 6) != TRIANGLES:
        raise given.error("only lists of triangles are read from Draco's data; convert the file without it")
    attributes, numbers = primitive.member("attributes"), packing.member("attributes")
    wanted = {name: (attributes.member(name), value) for name, value in numbers.members()}
    for reference, _ in wanted.values():
        accessors.charge(reference)
    accessors.charge(primitive.member("indices"))
    data, view = document.view(packing.member("bufferView"))
    mesh = _decode(bytes(data), packing, view)
    columns = {int(each["unique_id"]): each["data"] for each in mesh.attributes}
    for reference, value in wanted.values():
        number = value.integer(0, 1 << 16)
        if number not in columns:
            raise value.error(f"Draco's data in {view.path} have no attribute {number}")
        accessors.fill(reference, _as_columns(columns[number]))
    accessors.fill(primitive.member("indices"), _as_columns(np.asarray(mesh.faces).reshape(-1)))


def _decode(data: bytes, packing: Value, view: Value) -> Any:
    try:
        import DracoPy
    except ImportError:
        raise packing.error(
            'the mesh is packed by Draco, which DracoPy reads: pip install "mpeg4-fba[draco]". Or convert '
            "the file: npx @gltf-transform/cli copy in.glb out.glb"
        ) from None
    try:
        mesh = DracoPy.decode(data)
    except Exception as error:  # the package has several kinds for damaged data
        raise view.error(f"Draco's data are damaged: {error}") from None
    if not isinstance(mesh, DracoPy.DracoMesh):
        raise view.error("Draco's data are a cloud of points, not a mesh")
    return mesh


def _as_columns(values: Any) -> Array:
    array: Array = np.asarray(values)
    return array.reshape(len(array), -1)
