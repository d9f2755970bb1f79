"""Face models in files: glTF 2.0 with the extension FBA_face, described in docs/face-models.md.

The extension object makes meshes a face that FAPs move; `fba_face.schema.json` defines its members.
"""

from __future__ import annotations

import os
from dataclasses import replace
from typing import Any

import numpy as np

from fba.arrays import Float32
from fba.errors import ModelError
from fba.face._expressions import EXPRESSION_NAMES, VISEME_NAMES
from fba.face._tables import HEAD, FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.face.feature_points import names
from fba.face.gltf._reading import NAME, VERSION, read_model
from fba.face.gltf.morphs import displacements, morph_values
from fba.face.model import DetailLevel, FaceModel
from fba.gltf import MAX_TEXT, Builder, PartWriter, open_document
from fba.limits import DEFAULT_LIMITS, Limits
from fba.parameters import faps
from fba.source import Path


def load(path: Path, limits: Limits = DEFAULT_LIMITS) -> FaceModel:
    """Read a face model from a .glb (or .gltf) file, as `save` writes it.

    Raises FormatError where the file cannot be opened; ModelError, with the position in it, where it is
    damaged, contradicts itself, or lacks the extension FBA_face, LimitError where it takes more memory than
    the limits allow.
    """
    return read_model(open_document(path, limits))


def save(path: Path, model: FaceModel) -> None:
    """Write a face model as .glb, atomically; loading it gives an equal model.

    Any glTF viewer shows its neutral face, with a morph target for every FAP that has tables. Raises
    ModelError where glTF cannot represent the model (a part without triangles, a texture that is neither
    PNG nor JPEG), FormatError where the file cannot be written.
    """
    if os.fspath(path).lower().endswith(".gltf"):
        raise ModelError(f"{os.fspath(path)}: face models are written in one file; name it .glb")
    build(model).save(path)


def build(model: FaceModel, *, morphs: bool = True) -> Builder:
    """Return the glTF document of a model. Raises ModelError, with the reason, where glTF cannot hold it.

    morphs: whether other programs get morph targets.
    """
    builder = Builder()
    builder.root["extensionsUsed"] = [NAME]
    builder.root["scene"] = 0
    builder.add("scenes", {"nodes": [0]})
    nodes = list(range(1, len(model.parts) + 1))
    builder.add("nodes", {"name": HEAD, "children": nodes})
    writer = PartWriter(builder)
    primitives = [writer.primitive(part) for part in model.parts]
    targets = _targets(builder, model) if morphs else [{} for _ in model.parts]
    for part, primitive, moved in zip(model.parts, primitives, targets, strict=True):
        mesh: dict[str, Any] = {"name": part.name, "primitives": [primitive]}
        if moved:
            primitive["targets"] = [{"POSITION": accessor} for accessor in moved.values()]
            mesh["extras"] = {"targetNames": list(moved)}
        builder.add("nodes", {"name": part.name, "mesh": builder.add("meshes", mesh)})
    builder.root["extensions"] = {NAME: extension(builder, model, nodes)}
    return builder


def _targets(builder: Builder, model: FaceModel) -> list[dict[str, int]]:
    """Return the accessors of the morph targets of each part, by FAP name."""
    targets: list[dict[str, int]] = [{} for _ in model.parts]
    ends = np.cumsum([len(part.vertices) for part in model.parts])[:-1]
    for number, shift in displacements(model):
        for accessors, moved in zip(targets, np.split(shift, ends), strict=True):
            if moved.any():
                accessors[faps()[number - 1].name] = builder.displacements(moved)
    return targets


def extension(builder: Builder, model: FaceModel, nodes: list[int]) -> dict[str, Any]:
    """Return the extension object of a model; arrays go to `builder`. nodes: the node of each part."""
    part_numbers = {part.name: number for number, part in enumerate(model.parts)}
    content: dict[str, Any] = {
        "version": VERSION,
        "name": _text(model.name, "the model's name"),
        "notes": {_text(k, "a note"): _text(v, f"note {k!r}") for k, v in model.notes.items()},
        "parts": [_part(model, number, node) for number, node in enumerate(nodes)],
        "featurePoints": _feature_points(model),
        "tables": [_table(builder, table, part_numbers) for table in model.tables],
        "lost": {_fap(n): _text(model.lost[n], f"reason for FAP {n}") for n in sorted(model.lost)},
        "visemes": _definitions(model.definitions.visemes, VISEME_NAMES),
        "expressions": _definitions(model.definitions.expressions, EXPRESSION_NAMES),
        "morphValues": {_fap(table.fap): morph_values()[table.fap] for table in model.tables},
    }
    if model.wrinkles:
        content["wrinkles"] = True
    if model.fit is not None:
        content["fit"] = model.fit.to_dict()
    if model.levels:
        content["levels"] = [_level(builder, level) for level in model.levels]
    return content


def _level(builder: Builder, level: DetailLevel) -> dict[str, Any]:
    """Return a level of detail: a face model in a buffer view, without the pictures, which it shares."""
    plain = [replace(part, material=replace(part.material, texture=None)) for part in level.model.parts]
    model = build(replace(level.model, parts=tuple(plain)), morphs=False)
    return {"model": builder.blob(model.glb()), "parents": builder.packed(level.parents)}


def _part(model: FaceModel, number: int, node: int) -> dict[str, Any]:
    part = model.parts[number]
    entry: dict[str, Any] = {"node": node, "kind": part.kind}
    if part.colours is not None:
        entry["colour"] = [float(value) for value in part.material.colour]
    _text(part.name, "a part's name")
    _text(part.material.name, f"part {part.name!r}: its material's name")
    return entry


def _feature_points(model: FaceModel) -> dict[str, Any]:
    starts = np.array(list(model.starts.values()))
    points: dict[str, Any] = {}
    for row, name in enumerate(names()):
        if np.isnan(model.points[row]).any():
            continue
        points[name] = {"position": model.points[row].tolist()}
        vertex = int(model.bound[row])
        if vertex >= 0:
            part = int(np.searchsorted(starts, vertex, side="right")) - 1
            points[name] |= {"part": part, "vertex": vertex - int(starts[part])}
    return points


def _table(builder: Builder, table: FaceDefTables, part_numbers: dict[str, int]) -> dict[str, Any]:
    entry: dict[str, Any] = {"fap": _fap(table.fap)}
    if table.meshes:
        entry["meshes"] = [_mesh(builder, mesh, part_numbers) for mesh in table.meshes]
    if table.transforms:
        entry["transforms"] = [_transform(transform, part_numbers) for transform in table.transforms]
    return entry


def _mesh(builder: Builder, mesh: FaceDefMesh, part_numbers: dict[str, int]) -> dict[str, Any]:
    entry: dict[str, Any] = {
        "part": part_numbers[mesh.part],
        "borders": mesh.borders.tolist(),
        "count": len(mesh.vertices),
    }
    if len(mesh.vertices):
        entry["vertices"] = builder.packed(mesh.vertices)
        entry["displacements"] = builder.packed(mesh.displacements.transpose(1, 2, 0))
    return entry


def _transform(transform: FaceDefTransform, part_numbers: dict[str, int]) -> dict[str, Any]:
    entry: dict[str, Any] = {} if transform.part == HEAD else {"part": part_numbers[transform.part]}
    return entry | {
        "kind": transform.kind,
        "amount": list(transform.amount),
        "centre": list(transform.centre),
    }


def _definitions(table: Float32, select_names: tuple[str, ...]) -> list[dict[str, Any]]:
    """Return the FAPs that are not 0 of selects 1, 2, ..."""
    return [
        {"name": name, "faps": {_fap(int(n) + 1): float(row[n]) for n in np.flatnonzero(row)}}
        for name, row in zip(select_names[1:], table[1:], strict=True)
    ]


def _fap(number: int) -> str:
    return faps()[number - 1].name


def _text(text: str, what: str) -> str:
    if not isinstance(text, str) or len(text) > MAX_TEXT:
        raise ModelError(f"{what} must be a text of at most {MAX_TEXT} characters")
    return text
