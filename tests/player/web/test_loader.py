"""`fba-loader.js` moves the morph targets of three.js as `to_blendshapes` says."""

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import fba
from fba.arrays import Float64
from fba.capture.blendshapes import to_blendshapes
from fba.face import Deformer, FaceModel, resolve
from fba.face.gltf.morphs import morph_values
from fba.gltf import read_gltf
from fba.rotations import matrices
from fba_player.view._geometry import transform
from tools.web import make_page_tables

pytestmark = pytest.mark.skipif(shutil.which("node") is None, reason="no node here")
SAMPLES = Path(fba.__file__).parent / "samples"
WEB = Path(__file__).parents[3] / "player" / "fba_player" / "web"


@pytest.mark.parametrize(
    ("file", "make"),
    [
        ("page/names.js", make_page_tables.make_names),
        ("loader/shapes.js", make_page_tables.make_shapes),
        ("loader/definitions.js", make_page_tables.make_definitions),
    ],
)
def test_tables_are_those_of_the_library(file: str, make: object) -> None:
    assert callable(make)
    assert (WEB / file).read_text(encoding="utf-8") == make()


def test_morph_targets_and_the_head_move_as_in_python(tmp_path: Path) -> None:
    path = tmp_path / "hello.fba"
    animation = fba.read(SAMPLES / "hello.fap")[:100]
    fba.write(path, animation)
    program = Path(__file__).with_name("loader_weights.mjs")
    done = subprocess.run(["node", program, path, "25"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    rows = np.array(result["rows"])
    motion = to_blendshapes(fba.read(path), tuple(result["names"]))
    assert rows.shape == (100, 56)
    assert np.abs(rows[:, :52] - motion.weights).max() < 1e-5
    assert motion.weights.max() > 0.3
    turned = Deformer(FaceModel.default()).head_matrices(resolve(fba.read(path).face))[:, :3, :3]
    quaternions = rows[:, [55, 52, 53, 54]]
    assert np.abs(matrices(quaternions) - turned).max() < 1e-3
    assert np.abs(turned - np.eye(3)).max() > 0.05


def test_heads_with_the_extension_move_as_in_python(tmp_path: Path) -> None:
    """Each FAP at the value of its morph target, and turns of eyes and head together."""
    path, model = tmp_path / "head.glb", FaceModel.default()
    model.save(path)
    rows = np.zeros((len(model.tables) + 1, 68))
    for row, table in enumerate(model.tables):
        rows[row, table.fap - 1] = morph_values()[table.fap]
    rows[-1, [22, 24, 47, 48, 49]] = 30_000, -20_000, 15_000, 25_000, -9_000
    program = Path(__file__).with_name("loader_head.mjs")
    done = subprocess.run(
        ["node", program, path], input=json.dumps(rows.tolist()), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    gltf, deform = read_gltf(path), Deformer(model)
    for row, nodes in zip(rows, json.loads(done.stdout), strict=True):
        moved = deform(row)
        head = _matrix(nodes[0])
        for node, (part, start) in enumerate(model.starts.items(), 1):
            mesh = gltf.nodes[node].mesh
            assert mesh is not None
            primitive = gltf.meshes[mesh].primitives[0]
            positions = primitive.positions.astype(np.float64)
            for influence, morph in zip(nodes[node][0], primitive.morphs, strict=True):
                assert morph is not None
                positions += influence * morph
            placed = transform(positions, head @ _matrix(nodes[node]))
            error = np.abs(placed - moved[start : start + len(placed)]).max()
            assert error < 1e-5, (part, np.flatnonzero(row) + 1)


def _matrix(node: list[list[float]]) -> Float64:
    return np.array(node[1]).reshape(4, 4).T
