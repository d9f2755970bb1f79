"""Face models in files: glTF 2.0 with the extension FBA_face, described in docs/face-models.md."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from fba.errors import ModelError
from fba.face._tables import HEAD
from fba.face.gltf._extension import NAME, extension
from fba.face.gltf._reading import read_model
from fba.face.gltf.morphs import displacements
from fba.face.model import FaceModel
from fba.gltf import Builder, PartWriter, open_document
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


def build(model: FaceModel) -> Builder:
    """Return the glTF document of a model. Raises ModelError where glTF cannot represent it, with the
    reason."""
    builder = Builder()
    builder.root["extensionsUsed"] = [NAME]
    builder.root["scene"] = 0
    builder.add("scenes", {"nodes": [0]})
    nodes = list(range(1, len(model.parts) + 1))
    builder.add("nodes", {"name": HEAD, "children": nodes})
    writer = PartWriter(builder)
    primitives = [writer.primitive(part) for part in model.parts]
    targets = _targets(builder, model)
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
