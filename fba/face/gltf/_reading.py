"""The extension object FBA_face of a glTF file, read: meshes, feature points and tables become a face.

Every number is checked against what the file really holds before anything is made of it. What is wrong
is a ModelError that names the place, such as
"head.glb: extensions.FBA_face.tables[3].meshes[0].displacements: ...".
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fba.arrays import Float32, Float64, Int32
from fba.face.expressions import EXPRESSION_NAMES, VISEME_NAMES, Definitions
from fba.face.feature_points import names, row_of
from fba.face.gltf._extension import NAME, VERSION
from fba.face.gltf._tables import read_tables
from fba.face.interpolation.table import InterpolationTable
from fba.face.model import PART_KINDS, FaceModel, Part
from fba.gltf.document import Document
from fba.gltf.part_materials import read_material
from fba.gltf.reader import read_document
from fba.gltf.scene import Gltf
from fba.gltf.values import Budget, Value, locating_errors, optional_member
from fba.parameters import FAP_COUNT, FIRST_LOW_LEVEL_FAP, fap_numbers

MAX_PARTS = 1000
MAX_NOTES = 1000
LARGEST = float(np.finfo(np.float32).max)


def read_model(document: Document) -> FaceModel:
    """The face in an opened glTF document. Raises ModelError naming the place of what is wrong."""
    content = optional_member(document.root.get("extensions"), NAME)
    if content is None:
        raise document.root.error(
            f"brings no extension {NAME}, so it is no face model of this project; a plain glTF head with "
            "morph targets can be imported: fba model import"
        )
    version = content.member("version").integer(0, 1 << 30)
    if version != VERSION:
        raise content.error(f"is version {version}; version {VERSION} is read here")
    gltf = read_document(document)
    parts = _parts(content.member("parts"), gltf, document.budget)
    points, bound = _points(content.member("featurePoints"), parts)
    for name, value in _members(content, "morphValues", FAP_COUNT):  # for viewers' users, not for us
        _fap(name, value)
        value.number()
    fit = content.get("fit")
    with locating_errors(content), np.errstate(all="ignore"):  # absurd sizes overflow; no harm comes of it
        return FaceModel(
            parts=parts,
            points=points,
            bound=bound,
            tables=read_tables(document, content, parts),
            fit=None if fit is None else _fit(fit),
            definitions=_definitions(content),
            name=_text(content, "name"),
            lost={_fap(key, value): value.text() for key, value in _members(content, "lost", FAP_COUNT)},
            notes={key: value.text() for key, value in _members(content, "notes", MAX_NOTES)},
        )


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
        raise where.error(f"node {number} must stand where it is modelled: no transform, no skin")
    primitive = gltf.meshes[node.mesh].primitives[0]
    # copies here and in the joined arrays of the face
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
            material=read_material(entry, gltf, primitive.material),
        )


def _points(content: Value, parts: tuple[Part, ...]) -> tuple[Float64, Int32]:
    points = np.full((len(names()), 3), np.nan)
    bound = np.full(len(names()), -1, dtype=np.int32)
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    for name, value in content.members():
        if name not in row_of():
            raise value.error("there is no such feature point")
        row = row_of()[name]
        points[row] = value.member("position").numbers(3, -LARGEST, LARGEST)
        vertex = value.get("vertex")
        if vertex is not None:
            part = value.member("part").index(len(parts), "part")
            bound[row] = starts[part] + vertex.index(len(parts[part].vertices), "vertex")
    return points, bound


def _fit(value: Value) -> InterpolationTable:
    with locating_errors(value):
        return InterpolationTable.from_dict(value.data)


def _definitions(content: Value) -> Definitions:
    return Definitions(
        visemes=_poses(content.member("visemes"), VISEME_NAMES),
        expressions=_poses(content.member("expressions"), EXPRESSION_NAMES),
    )


def _poses(listed: Value, words: tuple[str, ...]) -> Float32:
    """float32 (1 + selects, 68); row 0 is "none"."""
    entries = listed.elements(len(words))
    if len(entries) != len(words) - 1:
        raise listed.error(f"{len(entries)} entries, but {len(words) - 1} are needed, from select 1 on")
    table = np.zeros((len(words), FAP_COUNT), dtype=np.float32)
    for select, entry in enumerate(entries, 1):
        for name, value in entry.member("faps").members():
            table[select, _fap(name, value) - 1] = value.number(-LARGEST, LARGEST)
    return table


def _members(content: Value, key: str, most: int) -> list[tuple[str, Value]]:
    held = content.get(key)
    if held is None:
        return []
    found: list[tuple[str, Value]] = []
    for name, value in held.members():
        if len(found) == most:
            raise held.error(f"more than the {most} entries that are read")
        Value(name, held.file, held.path).text()  # names must be Unicode too
        found.append((name, value))
    return found


def _text(content: Value, key: str) -> str:
    given = content.get(key)
    return "" if given is None else given.text()


def _fap(name: Any, value: Value) -> int:
    number = fap_numbers().get(name, 0)
    if number < FIRST_LOW_LEVEL_FAP:
        raise value.error(f"{name[:60]!a} is the name of no low-level FAP")
    return number
