"""Light of the person that is shown: of its parts, and kept while nothing changes."""

from __future__ import annotations

import numpy as np
import pytest

from fba.body import BapSolver, BodyModel
from fba.compiled import is_compiled
from fba.face.model import FaceModel
from fba_player._figure.face import build_figure
from fba_player._figure.person import Person, build_person
from fba_player.gl._lod import Details, share_memory

pytestmark = pytest.mark.skipif(not is_compiled(), reason="without numba all light counts as free")


@pytest.fixture(scope="module")
def person() -> Person:
    return build_person(BodyModel.default(), build_figure(FaceModel.default()))


def faps(**values: int) -> np.ndarray:
    vector = np.zeros(68, dtype=np.float32)
    for name, value in values.items():
        vector[int(name[1:]) - 1] = value
    return vector


def test_a_coarser_mesh_has_the_light_of_its_vertices(person: Person) -> None:
    vector = faps(f3=600, f5=-700, f10=-500, f11=-500, f44=900, f48=30000, f49=40000)
    joints = BapSolver(person.body.skeleton).pose(np.zeros(296))
    meshes = [*person.figure.meshes(vector, np.eye(4)), *person.meshes(vector, joints)]
    coarser = Details().choose(meshes, (0.0, 1.0, 5.0), 0.001)
    assert sum(len(mesh.positions) for mesh in coarser) < sum(len(mesh.positions) for mesh in meshes) / 2
    for mesh, small in zip(meshes, coarser, strict=True):
        assert mesh.light.shape == (len(mesh.positions), 4)
        if mesh.shape.levels:  # between the vertices of the full face
            number = [level.shape for level in mesh.shape.levels].index(small.shape)
            level = mesh.shape.levels[number]
            expected = np.einsum("nk,nkd->nd", level.weights, mesh.light[level.rows])
            np.testing.assert_allclose(small.light, expected, atol=1e-6)
            continue
        vertices = {
            (*at.tolist(), *light.tolist()) for at, light in zip(mesh.positions, mesh.light, strict=True)
        }
        assert all(
            (*at.tolist(), *light.tolist()) in vertices
            for at, light in zip(small.positions, small.light, strict=True)
        )


def test_light_of_every_part_is_a_share(person: Person) -> None:
    joints = BapSolver(person.body.skeleton).pose(np.zeros(296))
    meshes = person.meshes(faps(f3=300), joints)
    assert len(meshes) > 5
    for mesh in meshes:
        assert np.isfinite(mesh.light).all()
        assert mesh.light.min() >= 0
        assert mesh.light.max() <= 1 + 1e-6


def test_an_earlier_view_stays_as_it_was(person: Person) -> None:
    solver = BapSolver(person.body.skeleton)
    first = person.meshes(faps(f3=300), solver.pose(np.zeros(296)))
    before = [(mesh.positions.copy(), mesh.normals.copy(), mesh.light.copy()) for mesh in first]
    person.meshes(faps(f3=900), solver.pose(np.full(296, 2000.0)))
    for mesh, (positions, normals, light) in zip(first, before, strict=True):
        np.testing.assert_array_equal(mesh.positions, positions)
        np.testing.assert_array_equal(mesh.normals, normals)
        np.testing.assert_array_equal(mesh.light, light)


def test_a_head_that_stands_still_keeps_its_light(person: Person) -> None:
    one, two = (person.figure.meshes(faps(f31=value), np.eye(4))[0] for value in (100, 200))
    assert share_memory(one.light, two.light)  # a brow alone does not change it
    turned = person.figure.meshes(faps(f31=200, f49=40000), np.eye(4))[0]
    assert not share_memory(turned.light, two.light)
    assert np.abs(turned.light - two.light).max() > 0.05


def test_a_face_of_other_vertices_is_refused(person: Person) -> None:
    few = np.zeros((7, 3), dtype=np.float32)
    with pytest.raises(ValueError, match="must have shape"):
        person.head.skin(few, person.body.bind)
