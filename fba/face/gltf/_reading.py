"""Reads the extension object FBA_face of a glTF file: meshes, feature points and tables become a face.

Every number is checked against the file's content before it is used. Errors name the position, such as
"head.glb: extensions.FBA_face.tables[3].meshes[0].displacements: ...".
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fba.arrays import Float32, Float64, Int32
from fba.face._expressions import EXPRESSION_NAMES, VISEME_NAMES, Definitions
from fba.face._tables import HEAD, KINDS, FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.face.feature_points import names
from fba.face.interpolation.table import InterpolationTable
from fba.face.model import PART_KINDS, DetailLevel, FaceModel, Part
from fba.gltf import (
    Budget,
    Document,
    Gltf,
    Value,
    locating_errors,
    optional_member,
    read_document,
    read_material,
    unpack,
)
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, fap_numbers, point_rows

NAME = "FBA_face"
VERSION = 1
MAX_PARTS = 1000
MAX_NOTES = 1000
MAX_BORDERS = 4096
MAX_LEVELS = 16
MAX_TRANSFORMS = 10_000
INT32 = 2**31 - 1
FLOAT32_MAX = float(np.finfo(np.float32).max)


def read_model(document: Document) -> FaceModel:
    """Return the face in an opened glTF document. Raises ModelError naming the position of what is wrong."""
    content = optional_member(document.root.get("extensions"), NAME)
    if content is None:
        raise document.root.error(
            f"has no extension {NAME}, so it is not a face model of fba; a plain glTF head with "
            "morph targets can be imported: fba model import"
        )
    version = content.member("version").integer(0, 1 << 30)
    if version != VERSION:
        raise content.error(f"has version {version}, but this fba reads version {VERSION} only")
    gltf = read_document(document)
    parts = _parts(content.member("parts"), gltf, document.budget)
    points, bound = _points(content.member("featurePoints"), parts)
    for name, value in content.entries("morphValues", FAP_COUNT):  # only other programs use these
        _fap_number(name, value)
        value.number()
    levels = content.get("levels")
    fit = None
    if (given := content.get("fit")) is not None:
        with locating_errors(given):
            fit = InterpolationTable.from_dict(given.data)
    title, wrinkles = content.get("name"), content.get("wrinkles")
    with locating_errors(content), np.errstate(all="ignore"):  # absurd sizes may overflow
        return FaceModel(
            parts=parts,
            points=points,
            bound=bound,
            tables=tuple(_table(document, entry, parts) for entry in content.elements(FAP_COUNT, "tables")),
            fit=fit,
            definitions=_definitions(content),
            name="" if title is None else title.text(),
            lost={_fap_number(key, value): value.text() for key, value in content.entries("lost", FAP_COUNT)},
            notes={key: value.text() for key, value in content.entries("notes", MAX_NOTES)},
            wrinkles=wrinkles is not None and wrinkles.boolean(),
            levels=() if levels is None else _levels(document, levels, parts),
        )


def _levels(document: Document, listed: Value, parts: tuple[Part, ...]) -> tuple[DetailLevel, ...]:
    """Return the levels of detail, each a document in a buffer view; the pictures are those of the face."""
    levels = []
    pictures = {part.name: part.material.texture for part in parts}
    count = sum(len(part.vertices) for part in parts)
    for number, entry in enumerate(listed.elements(MAX_LEVELS)):
        inner = document.embedded(entry.member("model"), f"level {number + 1}")
        content = optional_member(inner.root.get("extensions"), NAME)
        if content is not None and content.get("levels") is not None:
            raise content.error("a level of detail has no levels itself")
        model = read_model(inner)
        shown = [
            replace(part, material=replace(part.material, texture=pictures.get(part.name)))
            for part in model.parts
        ]
        parents = unpack(document, entry.member("parents"), np.int32, (count,))
        levels.append(DetailLevel(replace(model, parts=tuple(shown)), parents))
    return tuple(levels)


def _parts(listed: Value, gltf: Gltf, budget: Budget) -> tuple[Part, ...]:
    entries = listed.elements(MAX_PARTS)
    if not entries:
        raise listed.error("a face needs at least one part")
    parts = []
    taken: set[int] = set()
    for entry in entries:
        where = entry.member("node")
        number = where.index(len(gltf.nodes), "node")
        if number in taken:
            raise where.error(f"node {number} is another part already")
        taken.add(number)
        parts.append(_part(entry, where, gltf, number, budget))
    return tuple(parts)


def _part(entry: Value, where: Value, gltf: Gltf, number: int, budget: Budget) -> Part:
    node = gltf.nodes[number]
    if node.mesh is None or len(gltf.meshes[node.mesh].primitives) != 1:
        raise where.error(f"node {number} must have a mesh of one primitive")
    if node.skin is not None or not np.array_equal(node.world, np.eye(4)):
        raise where.error(f"node {number} must have no transform and no skin")
    primitive = gltf.meshes[node.mesh].primitives[0]
    # for the copies in the part and in the joined arrays of the face
    budget.charge(len(primitive.positions) * 120 + len(primitive.triangles) * 36, entry)
    with locating_errors(entry):
        return Part(
            name=node.name,
            kind=entry.member("kind").choice(*PART_KINDS),
            vertices=primitive.positions,
            triangles=primitive.triangles,
            normals=primitive.normals,
            texcoords=primitive.texcoords[0] if primitive.texcoords else None,
            colours=primitive.colours,
            material=read_material(entry, gltf, primitive),
        )


def _points(content: Value, parts: tuple[Part, ...]) -> tuple[Float64, Int32]:
    points = np.full((len(names()), 3), np.nan)
    bound = np.full(len(names()), -1, dtype=np.int32)
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    for name, value in content.members():
        if name not in point_rows():
            raise value.error("there is no such feature point")
        row = point_rows()[name]
        points[row] = value.member("position").numbers(3, -FLOAT32_MAX, FLOAT32_MAX)
        vertex = value.get("vertex")
        if vertex is not None:
            part = value.member("part").index(len(parts), "part")
            bound[row] = starts[part] + vertex.index(len(parts[part].vertices), "vertex")
    return points, bound


def _definitions(content: Value) -> Definitions:
    return Definitions(
        visemes=_poses(content.member("visemes"), VISEME_NAMES),
        expressions=_poses(content.member("expressions"), EXPRESSION_NAMES),
    )


def _poses(listed: Value, select_names: tuple[str, ...]) -> Float32:
    """Return float32 (selects, 68): FAPs of each select; row 0 is "none"."""
    count = len(select_names) - 1
    entries = listed.elements(count + 1)
    if len(entries) != count:
        raise listed.error(f"{len(entries)} entries, but {count} are needed, from select 1 on")
    table = np.zeros((count + 1, FAP_COUNT), dtype=np.float32)
    for select, entry in enumerate(entries, 1):
        for name, value in entry.member("faps").members():
            table[select, _fap_number(name, value) - 1] = value.number(-FLOAT32_MAX, FLOAT32_MAX)
    return table


def _table(document: Document, entry: Value, parts: tuple[Part, ...]) -> FaceDefTables:
    name = entry.member("fap")
    number = _fap_number(name.text(100), name)
    meshes = tuple(_mesh(document, mesh, parts) for mesh in entry.elements(len(parts), "meshes"))
    transforms = tuple(_transform(each, parts) for each in entry.elements(MAX_TRANSFORMS, "transforms"))
    with locating_errors(entry):
        return FaceDefTables(number, meshes, transforms)


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
    with locating_errors(entry):
        return FaceDefMesh(part.name, np.array(borders, dtype=np.int64), vertices, displacements)


def _transform(entry: Value, parts: tuple[Part, ...]) -> FaceDefTransform:
    amount = _three(entry.member("amount"))
    part, centre = entry.get("part"), entry.get("centre")
    return FaceDefTransform(
        part=HEAD if part is None else parts[part.index(len(parts), "part")].name,
        kind=entry.member("kind").choice(*KINDS),
        amount=amount,
        centre=(0.0, 0.0, 0.0) if centre is None else _three(centre),
    )


def _three(value: Value) -> tuple[float, float, float]:
    x, y, z = value.numbers(3)
    return x, y, z


def _fap_number(name: str, value: Value) -> int:
    """Return the number of a low-level FAP by its name. value: named in the error."""
    number = fap_numbers().get(name, 0)
    if number < FIRST_LOW_LEVEL_FAP:
        raise value.error(f"{name[:60]!a} is not the name of a low-level FAP")
    return number
