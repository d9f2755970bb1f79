"""Faces in fewer bytes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from fba.face._tables import FaceDefMesh, FaceDefTables
from fba.face.deform._deformer import Deformer
from fba.face.gltf._storage import load
from fba.face.model import compact
from stored_models import face


def test_a_compact_face_moves_as_before_and_takes_less(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    moves = rng.normal(size=(84, 4, 3)) * [1, 0.1, 0]
    table = FaceDefTables(3, (FaceDefMesh("skin", [-500, -100, 0, 100, 500], np.arange(84), moves),))
    model = face(tables=(table,))
    small = compact(model)
    faps = np.zeros((2, 68))
    faps[:, 2] = -1000, 1000
    # 1000 steps of 20 micrometres, wrong by half of 2**-20 of the largest, which is under 4
    assert np.abs(Deformer(small)(faps) - Deformer(model)(faps)).max() < 1000 * 25e-6 * 2**-21 * 4 + 1e-8
    colours = small.parts[0].colours
    assert colours is not None
    assert np.abs(colours - model.parts[0].colours).max() <= 0.5 / 65535 + 1e-7
    model.save(tmp_path / "a.glb")
    small.save(tmp_path / "b.glb")
    saved = (tmp_path / "a.glb").stat().st_size - (tmp_path / "b.glb").stat().st_size
    assert (
        saved > 84 * 8 + 84 * 4 * 2 * 0.25
    )  # half of the colours, and a byte of four of the moves less some
    again = load(tmp_path / "b.glb")
    assert np.array_equal(again.tables[0].meshes[0].displacements, small.tables[0].meshes[0].displacements)
    assert np.array_equal(again.parts[0].colours, colours)


def test_what_is_compact_stays_as_it_is() -> None:
    once = compact(face())
    twice = compact(once)
    for one, other in zip(once.tables, twice.tables, strict=True):
        for mesh, same in zip(one.meshes, other.meshes, strict=True):
            assert np.array_equal(mesh.displacements, same.displacements)
    # the standard's worked example has few bits: nothing is rounded
    (lid,) = once.tables[1].meshes
    (given,) = face().tables[1].meshes
    assert np.abs(lid.displacements - given.displacements).max() < 4 * 2**-20
    assert np.array_equal(once.parts[0].colours, twice.parts[0].colours)
