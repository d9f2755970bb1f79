"""What the official glTF validator says of body files; it runs where FBA_GLTF_VALIDATOR names its folder."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from fba.body import BodyModel
from small_bodies import rod

SCRIPT = """
const validator = require(process.argv[1] + '/gltf-validator');
const bytes = new Uint8Array(require('fs').readFileSync(process.argv[2]));
validator.validateBytes(bytes).then(report => console.log(JSON.stringify(report.issues)));
"""
KNOWN = {"UNSUPPORTED_EXTENSION", "UNUSED_OBJECT"}


@pytest.mark.parametrize("which", ["small", "built-in"])
def test_the_validator_finds_no_fault(tmp_path: Path, which: str) -> None:
    folder = os.environ.get("FBA_GLTF_VALIDATOR", "")
    if not (Path(folder) / "gltf-validator").is_dir() or shutil.which("node") is None:
        pytest.skip("no glTF validator; set FBA_GLTF_VALIDATOR to the node_modules that holds gltf-validator")
    (rod() if which == "small" else BodyModel.default()).save(tmp_path / "a.glb")
    command = ["node", "-e", SCRIPT, str(Path(folder).resolve()), str(tmp_path / "a.glb")]
    found = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    assert (found["numErrors"], found["numWarnings"]) == (0, 0), found["messages"][:5]
    assert {message["code"] for message in found["messages"]} <= KNOWN
