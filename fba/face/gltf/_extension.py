"""Writes the extension object FBA_face of a glTF file, which makes its meshes a face that FAPs move.

`fba_face.schema.json` defines its members, docs/face-models.md explains them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from fba.arrays import Float32
from fba.errors import ModelError
from fba.face._expressions import EXPRESSION_NAMES, VISEME_NAMES
from fba.face._tables import HEAD, FaceDefMesh, FaceDefTables, FaceDefTransform
from fba.face.feature_points import names
from fba.face.gltf.morphs import morph_values
from fba.face.model import FaceModel
from fba.gltf import MAX_TEXT, Builder
from fba.parameters import faps

NAME = "FBA_face"
VERSION = 1


def extension(builder: Builder, model: FaceModel, nodes: list[int]) -> dict[str, Any]:
    """Return the extension object of a model; its arrays are added to `builder`. nodes: the node of each
    part."""
    part_numbers = {part.name: number for number, part in enumerate(model.parts)}
    content: dict[str, Any] = {
        "version": VERSION,
        "name": _text(model.name, "the model's name"),
        "notes": {_text(k, "a note"): _text(v, f"note {k!r}") for k, v in model.notes.items()},
        "parts": [_part(model, number, node) for number, node in enumerate(nodes)],
        "featurePoints": _points(model),
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
    return content


def _part(model: FaceModel, number: int, node: int) -> dict[str, Any]:
    part = model.parts[number]
    entry: dict[str, Any] = {"node": node, "kind": part.kind}
    if part.colours is not None:
        entry["colour"] = [float(value) for value in part.material.colour]
    _text(part.name, "a part's name")
    _text(part.material.name, f"part {part.name!r}: its material's name")
    return entry


def _points(model: FaceModel) -> dict[str, Any]:
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
