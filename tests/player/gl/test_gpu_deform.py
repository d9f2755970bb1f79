"""Vertices that the graphics card makes are those that the processor makes.

Places near the origin differ by a thousandth of a millimetre at most, two on a body, what 32 bits leave of
sums that are taken in another order; unit normals by less than 0.002.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from fba.body import BapSolver
from fba.body.model import BodyModel
from fba.body.skin.skinning import Skinner
from fba.body.solve.limits import Limits
from fba.compiled import is_compiled
from fba.face.model import FaceModel
from fba_player.figure.body_light import LitPart
from fba_player.figure.face import FaceFigure
from fba_player.figure.face_light import LitFacePart
from fba_player.figure.model_units import usable
from fba_player.figure.person import Person
from fba_player.gl.gpu.tables import BodyTables, CarriedBody
from fba_player.mesh.lazy_vertices import Places, Whole
from fba_player.view.view import FaceMesh
from gpu_reading import Reader, off, reading
from small_face import small_face

pytestmark = pytest.mark.usefixtures("opengl")
PLACE, NORMAL = 1e-6, 2e-3
"""Metres, and length of the difference of unit vectors."""
Float64 = npt.NDArray[np.float64]


@pytest.fixture(scope="module")
def reader(opengl: None) -> Iterator[Reader]:
    with reading() as found:
        yield found


@pytest.fixture(scope="module")
def person() -> Person:
    return Person(BodyModel.default(), FaceFigure(FaceModel.default()))


def check(reader: Reader, meshes: list[FaceMesh], place: float = PLACE) -> None:
    assert meshes
    for mesh, (positions, normals) in zip(meshes, reader([m.places for m in meshes]), strict=True):
        assert len(positions) == len(mesh.places)
        assert off(positions, mesh.positions) < place, mesh.shape.name
        assert off(normals, mesh.normals) < NORMAL, mesh.shape.name


def random_faps(seed: int, most: float = 250.0) -> npt.NDArray[np.float32]:
    faps = np.random.default_rng(seed).normal(0.0, most, 68).astype(np.float32)
    faps[:2] = 0
    faps[22:28] *= 20  # eyeballs and head: 1e-5 rad
    faps[47:50] *= 60
    return faps


def random_joints(person: Person, faps: npt.NDArray[np.float32], seed: int) -> Float64:
    """Within what a person can do, arms and shoulders lifted and twisted, near the origin."""
    random = np.random.default_rng(seed)
    baps = random.normal(0.0, 60000.0, 296)
    baps[:3] = 0
    allowed = Limits.human().clamp(baps)
    joints = BapSolver(person.body.skeleton).pose(allowed)
    joints[:, :3, 3] -= joints[0, :3, 3]
    return person.joints(faps, joints)


@pytest.mark.parametrize("seed", range(4))
def test_a_face(reader: Reader, person: Person, seed: int) -> None:
    faps = random_faps(seed)
    faps[[2, 43, 44, 45]] = (600, 300, 500, 900)  # jaw and tongue far out
    check(reader, person.figure.meshes(faps, np.eye(4)))


def test_a_face_at_rest_and_one_fap_alone(reader: Reader, person: Person) -> None:
    still = np.zeros(68, dtype=np.float32)
    check(reader, person.figure.meshes(still, np.eye(4)))
    for fap in (3, 19, 33, 44, 59):
        for value in (-1200, 40, 900):  # several of their intervals
            one = still.copy()
            one[fap - 1] = value
            check(reader, person.figure.meshes(one, np.eye(4)))


@pytest.mark.parametrize("seed", range(4))
def test_a_person(reader: Reader, person: Person, seed: int) -> None:
    faps = random_faps(seed)
    check(reader, person.meshes(faps, random_joints(person, faps, seed)), 2e-6)


def test_far_from_the_origin_what_32_bits_leave(reader: Reader, person: Person) -> None:
    faps = random_faps(7)
    joints = random_joints(person, faps, 7)
    joints[:, :3, 3] += (40.0, 0.0, -25.0)
    check(reader, person.meshes(faps, joints), 1e-5)  # a step of numbers about 40 is 4e-6


def test_twists_and_lifted_arms(reader: Reader, person: Person) -> None:
    """Forearms turned over, arms above the head: what is wrung, and armpits drawn taut."""
    baps = np.zeros(296)
    for number, degrees in ((38, 80), (39, -80), (46, 60), (47, -60), (32, 150), (34, 120)):
        baps[number - 1] = np.radians(degrees) * 1e5
    joints = BapSolver(person.body.skeleton).pose(baps)
    tables = person.body.skinner.tables()
    assert (tables.wring[:, 0] >= 0).sum() > 500
    assert (tables.wring[:, 3] > 0).sum() > 20
    check(reader, person.meshes(random_faps(1), joints), 2e-6)


@pytest.mark.skipif(not is_compiled(), reason="without numba all light counts as free")
@pytest.mark.parametrize("seed", range(3))
def test_light_on_a_body(reader: Reader, person: Person, seed: int) -> None:
    """Where a rounding decides whether the key light is looked for at all, it may be another: hardly ever."""
    faps = random_faps(seed)
    meshes = [
        m for m in person.meshes(faps, random_joints(person, faps, seed)) if isinstance(m.reaching, LitPart)
    ]
    assert len(meshes) > 3
    for mesh, light in zip(meshes, reader.lit(meshes), strict=True):
        apart = np.abs(light - mesh.light).max(axis=1)
        assert np.ptp(mesh.light[:, 0]) > 0.3  # limbs are in the way
        assert (apart < 1e-3).mean() > 0.995
        assert np.median(apart) < 1e-5


def test_light_on_a_face(reader: Reader, person: Person) -> None:
    """The mouth shut, and wide open; the head turned, alone and on a body; teeth have more of it."""
    for jaw, turn in ((0, 0), (900, 0), (900, 40000), (400, -30000)):
        faps = np.zeros(68, dtype=np.float32)
        faps[[2, 48]] = jaw, turn
        faps[4] = faps[9] = faps[10] = -jaw
        joints = random_joints(person, faps, 2)
        for meshes in (person.figure.meshes(faps, np.eye(4)), person.meshes(faps, joints)):
            lit = [mesh for mesh in meshes if isinstance(mesh.reaching, LitFacePart)]
            assert len(lit) > 4
            for mesh, light in zip(lit, reader.lit(lit), strict=True):
                assert np.ptp(mesh.light[:, 0]) > 0.05
                np.testing.assert_allclose(light, mesh.light, atol=1e-4)


def test_some_vertices_in_any_order(reader: Reader, person: Person) -> None:
    faps = random_faps(3)
    meshes = person.meshes(faps, random_joints(person, faps, 3))
    rows = np.random.default_rng(0).permutation(len(meshes[0].places))[:500]
    ((positions, normals),) = reader([meshes[0].places.some(rows)])
    assert off(positions, meshes[0].positions[rows]) < 2e-6
    assert off(normals, meshes[0].normals[rows]) < NORMAL


def test_several_poses_of_one_figure_in_one_picture(reader: Reader, person: Person) -> None:
    figure = person.figure
    both = [figure.meshes(random_faps(seed), np.eye(4))[0] for seed in (1, 2)]
    check(reader, both)
    assert off(both[0].positions, both[1].positions) > 1e-3


def few_points() -> FaceModel:
    """Nothing bound, one part that no table names."""
    model = small_face()
    return replace(model, bound=np.full(len(model.points), -1))


@pytest.mark.parametrize(
    "make",
    [
        small_face,
        lambda: small_face("skin"),
        lambda: replace(small_face(), tables=()),
        few_points,
        lambda: small_face(scale=3.0),
    ],
    ids=["egg", "skin alone", "no tables", "nothing bound", "three times as large"],
)
def test_odd_faces(reader: Reader, make: object) -> None:
    figure = FaceFigure(make())  # type: ignore[operator]
    for seed in (0, 1):
        check(reader, figure.meshes(random_faps(seed), np.eye(4)))


def test_a_body_without_arms_and_triangles(reader: Reader) -> None:
    """Normals then only turn, and nothing is wrung."""
    body = BodyModel.default()
    rows = np.arange(0, len(body.vertices), 7)
    skinner = Skinner(
        body.vertices[rows],
        body.normals[rows],
        body.joints[rows],
        body.weights[rows],
        body.bind,
        body.skeleton,
    )
    assert (skinner.tables().around < 0).all()
    joints = BapSolver(body.skeleton).pose(
        np.random.default_rng(5).normal(0, 30000, 296) * (np.arange(296) > 2)
    )
    joints[:, :3, 3] -= joints[0, :3, 3]

    def made() -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]:
        normals = np.empty((len(rows), 3), dtype=np.float32)
        return skinner.skin(joints, None, normals), normals

    motion = CarriedBody(BodyTables(skinner), skinner.motion(joints))
    whole = Whole(len(rows), made, None, lambda: motion)
    places = Places(whole, 0, len(rows))
    ((positions, normals),) = reader([places])
    assert off(positions, places.positions) < 2e-6
    assert off(normals, places.normals) < NORMAL


@pytest.mark.filterwarnings("ignore::fba.errors.FbaWarning")
def test_a_model_of_others(reader: Reader, shared: Path) -> None:
    """Candide: 126 vertices, no eyes, no tables for every FAP."""
    from fba.face.importers import import_model

    figure = FaceFigure(usable(import_model(shared / "data" / "candide" / "candide3.fdp")))
    for seed in (0, 1):
        check(reader, figure.meshes(random_faps(seed), np.eye(4)), 2e-6)
