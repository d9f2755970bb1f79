"""The person that BAPs move in the player: body and face in one place, dressed once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import fba
from fba import Animation
from fba.body import BapSolver, BodyModel
from fba.face.model import FaceModel
from fba.player import Scene
from fba_player._figure.face import build_figure
from fba_player._figure.person import Person, build_person
from fba_player.gl._lod import Details
from fba_player.view._view import Seen
from player_tracks import body_track, face_track

STILL = np.zeros(68, dtype=np.float32)


@pytest.fixture(scope="module")
def person() -> Person:
    return build_person(BodyModel.default(), build_figure(FaceModel.default()))


@pytest.fixture(scope="module")
def standing() -> np.ndarray:
    return BapSolver(BodyModel.default().skeleton).pose(np.zeros(296))


def test_a_person_has_each_part_once(person: Person, standing: np.ndarray) -> None:
    body, model = BodyModel.default(), FaceModel.default()
    meshes = person.meshes(STILL, person.joints(STILL, standing))
    worn = [part for part in body.parts if part.kind != "neck"]  # the built-in head brings its neck
    faces = [part for part in model.parts if part.kind not in ("eye", "other")]  # and leaves its shirt
    assert [len(mesh.positions) for mesh in meshes] == [len(part.vertices) for part in (*worn, *faces)]
    for mesh in meshes:
        assert mesh.light.shape == (len(mesh.positions), 4)
        assert np.isfinite(mesh.positions).all()
        np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-3)
    assert len(person.eyes(STILL, standing)) == 2


def test_a_person_stands_on_the_ground_and_has_its_eyes_in_its_head(
    person: Person, standing: np.ndarray
) -> None:
    places = np.concatenate([mesh.positions for mesh in person.meshes(STILL, standing)])
    assert places[:, 1].min() == pytest.approx(0, abs=0.02)
    assert 1.70 < places[:, 1].max() < 1.80
    eyes = np.array([eye.matrix[:3, 3] for eye in person.eyes(STILL, standing)])
    assert eyes[:, 1] == pytest.approx(1.648, abs=0.02)
    assert np.ptp(eyes[:, 0]) == pytest.approx(0.062, abs=0.003)


def test_faps_and_baps_turn_the_head_alike(person: Person, standing: np.ndarray) -> None:
    """30 degrees of yaw by FAP 49 turn the eyes by 30 degrees about the skull base."""
    faps = STILL.copy()
    faps[48] = np.radians(30) * 1e5
    turned = person.joints(faps, standing)
    poses = ((STILL, standing), (faps, turned))
    before, after = (np.mean([eye.matrix[:3, 3] for eye in person.eyes(*p)], axis=0) for p in poses)
    skull = standing[BodyModel.default().skeleton.number("skullbase"), :3, 3]
    arms = (before - skull)[[0, 2]], (after - skull)[[0, 2]]
    assert np.linalg.norm(arms[0]) == pytest.approx(np.linalg.norm(arms[1]), rel=0.02)
    cosine = arms[0] @ arms[1] / np.linalg.norm(arms[0]) / np.linalg.norm(arms[1])
    assert np.degrees(np.arccos(cosine)) == pytest.approx(30, abs=0.5)


def test_another_face_gets_the_neck_of_the_body(standing: np.ndarray) -> None:
    """A face that ends at the jaw: the body's own neck is shown."""
    model = FaceModel.default()
    skin = model.part("skin")
    kept = (skin.vertices[skin.triangles][:, :, 1] > -0.06).all(axis=1)
    used, corners = np.unique(skin.triangles[kept], return_inverse=True)
    arrays = {key: getattr(skin, key)[used] for key in ("vertices", "normals", "texcoords", "colours")}
    mask = replace(skin, triangles=corners.reshape(-1, 3).astype(np.int32), **arrays)
    points, bound = model.points.copy(), np.full(84, -1, dtype=np.int32)
    small = replace(model, parts=(mask, *model.parts[1:]), points=points, bound=bound, tables=())
    person = build_person(BodyModel.default(), build_figure(small))
    assert not person.head.brings_neck
    neck = len(BodyModel.default().part("neck").vertices)
    assert neck in [len(mesh.positions) for mesh in person.meshes(STILL, standing)]


def test_a_scene_shows_the_person_or_its_bones(person: Person) -> None:
    animation = Animation(25, np.arange(2), face_track([{3: 1}, {3: 200}]), body_track([{32: 5}, {32: 9000}]))  # type: ignore[arg-type]
    scene = Scene(animation)
    shown = scene.view_at(0.04)
    assert (len(shown.capsules), len(shown.meshes)) == (0, 0)
    assert len(shown.faces) > 5
    scene.view = "points"
    bones = scene.view_at(0.04)
    assert len(bones.capsules) > 100


def test_a_scene_shows_the_given_body() -> None:
    body = BodyModel.default()
    scene = Scene(Animation(25, np.arange(1), body=body_track([{}])), body=body)  # type: ignore[arg-type]
    assert scene.person.body is body


def test_real_clips_stand_on_the_ground(shared: Path) -> None:
    """Somebody who dances: the lowest of the person is always within 6 cm of the ground."""
    scene = Scene(fba.read(shared / "data" / "greta" / "Dance.bvh"))
    for share in np.linspace(0.05, 0.95, 7):
        view = scene.view_at(float(scene.start) + share * float(scene.duration))
        lowest = min(float(mesh.positions[:, 1].min()) for mesh in view.faces)
        assert -0.06 < lowest < 0.06


@pytest.mark.parametrize("face", [{3: 600, 5: -900, 19: 500}, {3: 900, 5: -900, 45: 700, 46: 600}, {46: 600}])
@pytest.mark.parametrize("away", [0.7, 1.0, 5.0, 12.0, 40.0])
def test_what_is_moved_for_a_distance_is_drawn_as_if_all_were(away: float, face: dict[int, int]) -> None:
    """The vertices of the levels of detail that are chosen there, and those of a body's shadow."""
    pose = {32: 9000, 60: 90000, 61: -40000}
    scene = Scene(Animation(25, np.arange(1), face_track([face]), body_track([pose])))  # type: ignore[arg-type]
    seen = Seen(np.array([0.3, 1.2, away]), 0.0006)
    every, some = scene.view_at(0.0), scene.view_at(0.0, seen)
    assert (some.faces[-1].finest > 0) == (away > 3)
    details, shapes = Details(), [mesh.shape for mesh in some.faces]
    faces = [mesh for mesh in every.faces if mesh.shape in shapes]  # without teeth behind shut lips
    for one, other in zip(*(details.choose(f, *seen) for f in (faces, some.faces)), strict=True):
        assert one.shape is other.shape
        used = np.unique(one.shape.triangles)
        for field in ("positions", "normals"):
            np.testing.assert_array_equal(getattr(one, field)[used], getattr(other, field)[used])
        np.testing.assert_allclose(one.light[used], other.light[used], atol=1e-6)


@pytest.mark.parametrize(
    ("away", "lip", "seen"), [(0.7, 0, False), (0.7, -200, True), (5.0, -200, True), (40.0, -200, False)]
)
def test_teeth_and_tongue_are_left_out_behind_shut_lips(away: float, lip: int, *, seen: bool) -> None:
    scene = Scene(Animation(25, np.arange(1), face_track([{5: lip}]), body_track([{}])))  # type: ignore[arg-type]
    kinds = {mesh.shape.kind for mesh in scene.view_at(0.0, Seen(np.array([0.0, 1.6, away]), 0.0006)).faces}
    assert {"skin", "hair"} < kinds
    assert ({"teeth", "tongue"} <= kinds) == seen == ("teeth" in kinds)
    assert "teeth" in {mesh.shape.kind for mesh in scene.view_at(0.0).faces}


def test_switches_show_all_vertices() -> None:
    scene = Scene(Animation(25, np.arange(1), body=body_track([{}])))  # type: ignore[arg-type]
    scene.show("wireframe")
    assert scene.view_at(0.0, Seen(np.array([0.0, 1.0, 40.0]), 0.0006)).faces[-1].finest == 0
