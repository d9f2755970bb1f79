"""Light that is asked for at some vertices is that of the whole part there."""

from __future__ import annotations

import numpy as np
import pytest

from fba.body import BapSolver
from fba.body.model import BodyModel
from fba.compiled import is_compiled
from fba.face.model import FaceModel
from fba_player.figure.face import FaceFigure
from fba_player.figure.person import Person

pytestmark = pytest.mark.skipif(not is_compiled(), reason="without numba all light counts as free")


@pytest.fixture(scope="module")
def person() -> Person:
    return Person(BodyModel.default(), FaceFigure(FaceModel.default()))


def faps(**values: int) -> np.ndarray:
    vector = np.zeros(68, dtype=np.float32)
    for name, value in values.items():
        vector[int(name[1:]) - 1] = value
    return vector


def test_of_a_face_that_turns_its_head_and_puts_its_tongue_out(person: Person) -> None:
    vector = faps(f3=600, f5=-700, f10=-500, f11=-500, f44=900, f48=30000, f49=40000)
    for mesh in person.figure.meshes(vector, np.eye(4)):
        rows = np.arange(len(mesh.positions))[::7]
        np.testing.assert_allclose(mesh.light_at(rows), mesh.light[rows], atol=1e-6)
        assert mesh.light.shape == (len(mesh.positions), 4)


def test_of_a_body(person: Person) -> None:
    joints = BapSolver(person.body.skeleton).pose(np.zeros(296))
    meshes = person.meshes(faps(f3=300), joints)
    assert len(meshes) > 5
    for mesh in meshes:
        rows = np.arange(len(mesh.positions))[3::5]
        np.testing.assert_allclose(mesh.light_at(rows), mesh.light[rows], atol=1e-6)


def test_a_head_that_stands_still_keeps_its_light(person: Person) -> None:
    one, two = (person.figure.meshes(faps(f31=value), np.eye(4))[0] for value in (100, 200))
    assert one.reaching is two.reaching  # a brow alone does not change it
    turned = person.figure.meshes(faps(f31=200, f49=40000), np.eye(4))[0]
    assert turned.reaching is not two.reaching
    assert np.abs(turned.light - two.light).max() > 0.05


def test_a_face_of_other_vertices_is_refused(person: Person) -> None:
    few = np.zeros((7, 3), dtype=np.float32)
    with pytest.raises(ValueError, match="must have shape"):
        person.head.skin(few, person.body.bind)


def test_of_the_whole_body_and_of_its_first_part(person: Person) -> None:
    body, light = person.body, person._light
    joints = BapSolver(body.skeleton).pose(np.zeros(296))
    places, normals = np.empty_like(body.vertices), np.empty_like(body.vertices)
    body.skin(joints, places, normals)
    first = light.lit(places, normals, joints)(slice(0, len(body.parts[0].vertices)), None)
    whole = light.reaching(places, normals, joints)
    assert len(whole) == len(places)
    np.testing.assert_allclose(first, whole[: len(first)], atol=1e-6)
