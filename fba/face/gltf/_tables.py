"""FaceDefTables from the extension object FBA_face of a glTF file."""

from __future__ import annotations

import numpy as np

from fba.arrays import Float32, Int32
from fba.errors import ModelError
from fba.face.model import Part
from fba.face.tables import HEAD, KINDS, FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.gltf.document import Document
from fba.gltf.packed import unpack
from fba.gltf.values import Value
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, fap_numbers

MAX_BORDERS = 4096
MAX_TRANSFORMS = 10_000
INT32 = 2**31 - 1


def read_tables(document: Document, content: Value, parts: tuple[Part, ...]) -> tuple[FaceDefTables, ...]:
    """The list "tables" of the extension. Raises ModelError naming the place of what is wrong."""
    return tuple(_table(document, entry, parts) for entry in content.elements(FAP_COUNT, "tables"))


def _table(document: Document, entry: Value, parts: tuple[Part, ...]) -> FaceDefTables:
    name = entry.member("fap")
    number = fap_numbers().get(name.text(100), 0)
    if number < FIRST_LOW_LEVEL_FAP:
        raise name.error(f"{name.data!a} is the name of no low-level FAP")
    meshes = [_mesh(document, each, parts) for each in entry.elements(len(parts), "meshes")]
    transforms = [_transform(each, parts) for each in entry.elements(MAX_TRANSFORMS, "transforms")]
    try:
        return FaceDefTables(number, tuple(meshes), tuple(transforms))
    except ModelError as error:
        raise entry.error(str(error)) from error


def _mesh(document: Document, entry: Value, parts: tuple[Part, ...]) -> FaceDefMesh:
    part = parts[entry.member("part").index(len(parts), "part")]
    borders = [border.integer(-INT32 - 1, INT32) for border in entry.member("borders").elements(MAX_BORDERS)]
    if len(borders) < 2:
        raise entry.member("borders").error("at least two borders are needed")
    intervals = len(borders) - 1
    count = entry.member("count").integer(0, len(part.vertices))
    vertices: Int32 = np.zeros(0, dtype=np.int32)
    displacements: Float32 = np.zeros((0, intervals, 3), dtype=np.float32)
    if count:
        reference = entry.member("vertices")
        vertices = unpack(document, reference, np.int32, (count,))
        if int(vertices.min()) < 0 or int(vertices.max()) >= len(part.vertices):
            raise reference.error(
                f"names vertices {vertices.min()} to {vertices.max()}, "
                f"but part {part.name!r} has {len(part.vertices)}"
            )
        reference = entry.member("displacements")
        document.budget.charge(count * intervals * 12, reference)  # the copy in the FaceDefMesh
        displacements = unpack(document, reference, np.float32, (intervals, 3, count)).transpose(2, 0, 1)
    try:
        return FaceDefMesh(part.name, np.array(borders, dtype=np.int64), vertices, displacements)
    except ModelError as error:
        raise entry.error(str(error)) from error


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
