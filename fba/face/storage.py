"""Face models in files: glTF 2.0 with the extension FBA_face, described in docs/face-models.md."""

from __future__ import annotations

import os

from fba.errors import ModelError
from fba.face.model import FaceModel
from fba.source import Path


def load(path: Path) -> FaceModel:
    """Read a face model from a .glb (or .gltf) file, as `save` writes it.

    Raises FormatError where the file cannot be opened, ModelError, which names the place in it, where it
    is damaged, contradicts itself, or brings no extension FBA_face. Nothing of a bad file is used.
    """
    from fba.face.gltf.reading import read_model
    from fba.gltf.document import open_document

    return read_model(open_document(path))


def save(model: FaceModel, path: Path) -> None:
    """Write a face model as .glb, whole or not at all; loading it gives an equal model again.

    Any glTF viewer shows its neutral face, with a morph target for every FAP that has tables. Raises
    ModelError where glTF cannot hold the model (a part without triangles, a texture that is neither PNG
    nor JPEG), FormatError where the file cannot be written.
    """
    if os.fspath(path).lower().endswith(".gltf"):
        raise ModelError(f"{os.fspath(path)}: face models are written in one file; name it .glb")
    from fba.face.gltf.writing import build

    build(model).save(path)
