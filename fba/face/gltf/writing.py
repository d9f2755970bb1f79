"""A face model written as glTF: meshes and morph targets for all viewers, the extension for this project."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from fba.face.gltf._extension import NAME, extension
from fba.face.gltf.morphs import displacements
from fba.face.model import FaceModel
from fba.face.tables import HEAD
from fba.gltf.part_materials import Looks
from fba.gltf.writer import Builder
from fba.parameters import faps

Float32 = npt.NDArray[np.float32]


def build(model: FaceModel) -> Builder:
    """The whole document of a model. Raises ModelError where glTF cannot hold it, with the reason."""
    builder = Builder()
    builder.root["extensionsUsed"] = [NAME]
    builder.root["scene"] = 0
    builder.add("scenes", {"nodes": [0]})
    nodes = list(range(1, len(model.parts) + 1))
    builder.add("nodes", {"name": HEAD, "children": nodes})
    looks = Looks(builder)
    primitives = [looks.primitive(part) for part in model.parts]
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
    """For each part the accessors of its morph targets, by name of the FAP."""
    found: list[dict[str, int]] = [{} for _ in model.parts]
    ends = np.cumsum([len(part.vertices) for part in model.parts])[:-1]
    for number, shift in displacements(model):
        for targets, moved in zip(found, np.split(shift, ends), strict=True):
            if moved.any():
                targets[faps()[number - 1].name] = builder.displacements(moved)
    return found
