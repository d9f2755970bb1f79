"""FaceDefTables from the extension object FBA_face of a glTF file."""

from __future__ import annotations

import numpy as np

from fba.errors import ModelError
from fba.face.gltf.extension import AXES
from fba.face.model import Part
from fba.face.tables import HEAD, KINDS, FaceDefMesh, FaceDefTables, FaceDefTransform, Float32, Int32
from fba.gltf.accessors import Accessors
from fba.gltf.document import Document
from fba.gltf.values import Value
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, fap_numbers

MAX_BORDERS = 4096
MAX_TRANSFORMS = 10_000
INT32 = 2**31 - 1
AXES_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}
SUBSETS = ("x", "y", "z", "xy", "xz", "yz", "xyz")


def read_tables(
    document: Document, accessors: Accessors, content: Value, parts: tuple[Part, ...]
) -> tuple[FaceDefTables, ...]:
    """The list "tables" of the extension. Raises ModelError naming the place of what is wrong."""
    return tuple(_table(document, accessors, entry, parts) for entry in content.elements(FAP_COUNT, "tables"))


def _table(document: Document, accessors: Accessors, entry: Value, parts: tuple[Part, ...]) -> FaceDefTables:
    name = entry.member("fap")
    number = fap_numbers().get(name.text(100), 0)
    if number < FIRST_LOW_LEVEL_FAP:
        raise name.error(f"{name.data!a} is the name of no low-level FAP")
    meshes = [_mesh(document, accessors, each, parts) for each in entry.elements(len(parts), "meshes")]
    transforms = [_transform(each, parts) for each in entry.elements(MAX_TRANSFORMS, "transforms")]
    try:
        return FaceDefTables(number, tuple(meshes), tuple(transforms))
    except ModelError as error:
        raise entry.error(str(error)) from error


def _mesh(document: Document, accessors: Accessors, entry: Value, parts: tuple[Part, ...]) -> FaceDefMesh:
    part = parts[entry.member("part").index(len(parts), "part")]
    borders = [border.integer(-INT32 - 1, INT32) for border in entry.member("borders").elements(MAX_BORDERS)]
    reference = entry.get("vertices")
    vertices: Int32 = np.zeros(0, dtype=np.int32)
    displacements: Float32 = np.zeros((0, max(len(borders) - 1, 0), 3), dtype=np.float32)
    if reference is not None:
        raw = accessors.integers(reference, "SCALAR")[:, 0]
        document.budget.charge(len(raw) * 16, reference)
        if int(raw.max()) >= len(part.vertices):
            raise reference.error(
                f"element {raw.argmax()} names vertex {raw.max()}, "
                f"but part {part.name!r} has {len(part.vertices)}"
            )
        vertices = raw.astype(np.int32)
        displacements = _displacements(document, accessors, entry, len(vertices), len(borders) - 1)
    try:
        return FaceDefMesh(part.name, np.array(borders, dtype=np.int64), vertices, displacements)
    except ModelError as error:
        raise entry.error(str(error)) from error


def _displacements(
    document: Document, accessors: Accessors, entry: Value, count: int, intervals: int
) -> Float32:
    """float32 (N, K - 1, 3); the file leaves out axes without motion and intervals that repeat others."""
    which = list(range(intervals))
    given = entry.get("intervals")
    if given is not None:
        which = [value.integer(0, MAX_BORDERS) for value in given.elements(MAX_BORDERS)]
        if len(which) != intervals:
            raise given.error(f"{len(which)} entries for {intervals} intervals")
    if not which:
        raise entry.member("borders").error("at least two borders are needed")
    stored = max(which) + 1
    axes = entry.get("axes")
    chosen = [AXES.index(axis) for axis in ("xyz" if axes is None else axes.choice(*SUBSETS))]
    kept = accessors.floats(
        entry.member("displacements"), AXES_TYPES[len(chosen)], count=count * stored
    ).reshape(count, stored, len(chosen))
    # here, once more in the FaceDefMesh, and on the way
    document.budget.charge(count * intervals * 12 * 3, entry)
    moves = np.zeros((count, intervals, 3), dtype=np.float32)
    moves[:, :, chosen] = kept[:, which]
    return moves


def _transform(entry: Value, parts: tuple[Part, ...]) -> FaceDefTransform:
    part = entry.get("part")
    centre = entry.get("centre")
    amount, place = (
        (0.0, 0.0, 0.0) if value is None else _three(value) for value in (entry.member("amount"), centre)
    )
    return FaceDefTransform(
        part=HEAD if part is None else parts[part.index(len(parts), "part")].name,
        kind=entry.member("kind").choice(*KINDS),
        amount=amount,
        centre=place,
    )


def _three(value: Value) -> tuple[float, float, float]:
    x, y, z = value.numbers(3)
    return x, y, z
