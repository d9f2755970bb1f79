"""What the official glTF validator says of the files; it runs where FBA_GLTF_VALIDATOR names its folder."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fba.face.model import FaceModel, Material
from stored_models import face

SCRIPT = """
const validator = require(process.argv[1] + '/gltf-validator');
const bytes = new Uint8Array(require('fs').readFileSync(process.argv[2]));
validator.validateBytes(bytes).then(report => console.log(JSON.stringify(report.issues)));
"""
KNOWN = {"UNSUPPORTED_EXTENSION", "UNUSED_OBJECT"}
"""What it informs about: it does not know the extension, nor what only that uses."""


@pytest.fixture(scope="module")
def modules() -> str:
    folder = os.environ.get("FBA_GLTF_VALIDATOR", "")
    if not (Path(folder) / "gltf-validator").is_dir() or shutil.which("node") is None:
        pytest.skip("no glTF validator; set FBA_GLTF_VALIDATOR to the node_modules that holds gltf-validator")
    return str(Path(folder).resolve())


def issues(modules: str, path: Path) -> dict[str, Any]:
    command = ["node", "-e", SCRIPT, modules, str(path)]
    run = subprocess.run(command, capture_output=True, text=True, check=True)
    found: dict[str, Any] = json.loads(run.stdout)
    return found


def plain(model: FaceModel) -> FaceModel:
    """Without textures, colours and tables."""
    parts = tuple(replace(part, colours=None, texcoords=None, material=Material()) for part in model.parts)
    return replace(model, parts=parts, tables=(), bound=np.full(84, -1))


@pytest.mark.parametrize("which", ["small", "plain", "built-in"])
def test_the_validator_finds_no_fault(modules: str, tmp_path: Path, which: str) -> None:
    model = {"small": face, "plain": lambda: plain(face()), "built-in": FaceModel.default}[which]()
    model.save(tmp_path / "a.glb")
    found = issues(modules, tmp_path / "a.glb")
    assert (found["numErrors"], found["numWarnings"]) == (0, 0), found["messages"][:5]
    assert {message["code"] for message in found["messages"]} <= KNOWN
