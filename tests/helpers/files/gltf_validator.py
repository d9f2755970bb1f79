"""The official glTF validator: it runs where FBA_GLTF_VALIDATOR names the node_modules that holds it."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

SCRIPT = """
const validator = require(process.argv[1] + '/gltf-validator');
const bytes = new Uint8Array(require('fs').readFileSync(process.argv[2]));
validator.validateBytes(bytes).then(report => console.log(JSON.stringify(report.issues)));
"""


def assert_valid(*paths: Path, informs: set[str]) -> None:
    """Check that the validator finds no fault in files. informs: codes that it may give. Skips without it."""
    folder = os.environ.get("FBA_GLTF_VALIDATOR", "")
    if not (Path(folder) / "gltf-validator").is_dir() or shutil.which("node") is None:
        pytest.skip("no glTF validator; set FBA_GLTF_VALIDATOR to the node_modules that holds gltf-validator")
    for path in paths:
        command = ["node", "-e", SCRIPT, str(Path(folder).resolve()), str(path)]
        found = json.loads(subprocess.run(command, capture_output=True, check=True).stdout)
        assert (found["numErrors"], found["numWarnings"]) == (0, 0), (path.name, found["messages"][:5])
        assert {message["code"] for message in found["messages"]} <= informs
