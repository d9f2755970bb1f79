"""What a scene shows: the face follows its model, the body its joints."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fba.animation import Animation
from fba.errors import FbaWarning
from fba.face.model import FaceModel
from fba.parameters import BAP_COUNT, bap_numbers, point_rows
from fba.player import Scene, default_camera
from fba.tracks import BodyTrack
from fba_player._figure._face_parts import compute_sway
from fba_player._figure.face import FaceFigure, build_figure
from player_tracks import body_track, face_track

STILL = np.zeros(68, dtype=np.float32)


def faps(**values: float) -> np.ndarray:
    vector = STILL.copy()
    for name, value in values.items():
        vector[int(name[1:]) - 1] = value
    return vector


@pytest.fixture(scope="module")
def figure() -> FaceFigure:
    return build_figure(FaceModel.default())


def test_the_skin_follows_the_model(figure: FaceFigure) -> None:
    chin = figure.model.bound[point_rows()["2.1"]]
    skin = figure.model.parts[0]
    assert skin.kind == "skin"
    assert chin < len(skin.vertices)
    before, after = (figure.meshes(one, np.eye(4))[0].positions[chin].copy() for one in (STILL, faps(f3=500)))
    assert after[1] - before[1] == pytest.approx(-500 * figure.model.fapu.MNS, rel=0.02)
    np.testing.assert_array_equal(before, skin.vertices[chin])


@pytest.mark.parametrize(("fap", "side"), [(23, 0), (24, 1)])
def test_eyes_look_where_faps_say(figure: FaceFigure, fap: int, side: int) -> None:
    straight, aside = (figure.eyes(one, np.eye(4)) for one in (STILL, faps(**{f"f{fap}": 30000})))
    expected = [np.sin(0.3), 0, np.cos(0.3)]  # 30,000 steps of 1e-5 rad to the subject's left
    gaze = [eye.matrix[:3, 2] / np.linalg.norm(eye.matrix[:3, 2]) for eye in aside]
    np.testing.assert_allclose(gaze[side], expected, atol=1e-3)
    np.testing.assert_allclose(gaze[1 - side], [0, 0, 1], atol=1e-3)
    np.testing.assert_allclose(aside[side].matrix[:3, 3], straight[side].matrix[:3, 3], atol=1e-5)
    down = figure.eyes(faps(f25=20000), np.eye(4))[0].matrix[:3, 2]
    np.testing.assert_allclose(down / np.linalg.norm(down), [0, -np.sin(0.2), np.cos(0.2)], atol=1e-3)


def test_eyes_have_the_size_of_the_face(figure: FaceFigure) -> None:
    unit = figure.model.fapu
    left, right = figure.eyes(STILL, np.eye(4))
    centre, radius = left.matrix[:3, 3], np.linalg.norm(left.matrix[:3, 0])
    assert centre[0] == pytest.approx(-right.matrix[0, 3], abs=1e-6)
    assert centre[0] == pytest.approx(unit.ES * 512, rel=0.02)
    assert left.iris * radius * 2 == pytest.approx(unit.IRISD * 1024)
    assert left.pupil * radius * 2 == pytest.approx(unit.IRISD * 1024 / 3)  # a third of the iris at rest
    wide = figure.eyes(faps(f29=200), np.eye(4))
    assert (wide[0].pupil - left.pupil) * radius * 2 == pytest.approx(unit.IRISD * 200)
    assert wide[1].pupil == right.pupil
    thrust = figure.eyes(faps(f27=100), np.eye(4))[0].matrix[:3, 3] - centre
    np.testing.assert_allclose(thrust, [0, 0, 100 * unit.ES], atol=1e-5)
    edge = figure.model.points[point_rows()["3.5"]][2]
    assert edge == pytest.approx(centre[2] + radius, abs=0.002)


def test_the_neck_bends_and_the_shoulders_stay(figure: FaceFigure) -> None:
    skin = figure.model.vertices[: len(figure.model.parts[0].vertices)]
    share = compute_sway(figure.model)[: len(skin)]
    chin = figure.model.points[point_rows()["2.10"]]
    assert (share[(skin[:, 1] > chin[1] + 0.01) & (skin[:, 2] > chin[2] - 0.03)] > 0.8).all()
    assert (share[skin[:, 1] > figure.between_eyes[1]] == 1).all()
    assert share[skin[:, 1].argmin()] == 0
    assert share[skin[:, 1] < skin[:, 1].min() + 0.03].max() < 0.1


def test_a_face_without_feature_points_of_the_neck_turns_whole() -> None:
    model = FaceModel.default()
    points, bound = model.points.copy(), model.bound.copy()
    for name in ("2.1", "2.10"):
        points[point_rows()[name]], bound[point_rows()[name]] = np.nan, -1
    assert (compute_sway(replace(model, points=points, bound=bound)) == 1).all()


def test_on_a_body_shoulders_are_left_out(figure: FaceFigure) -> None:
    whole, cut = (figure.meshes(STILL, np.eye(4), on_body=on) for on in (False, True))
    low = [min(mesh.positions[mesh.shape.triangles.ravel(), 1].min() for mesh in m) for m in (whole, cut)]
    assert low[0] < -0.2
    assert low[1] > -0.2
    assert len(cut) < len(whole)


def test_extreme_faps_give_finite_meshes(figure: FaceFigure) -> None:
    for value in (10**5, -(10**5)):
        vector = np.full(68, value, dtype=np.float32)
        for mesh in figure.meshes(vector, np.eye(4)):
            assert np.isfinite(mesh.positions).all()
            assert np.isfinite(mesh.normals).all()
            assert ((mesh.light >= 0) & (mesh.light <= 1)).all()
        for eye in figure.eyes(vector, np.eye(4)):
            assert np.isfinite(eye.matrix).all()


def test_light_falls_into_an_open_mouth(figure: FaceFigure) -> None:
    def seen(vector: np.ndarray) -> np.ndarray:
        meshes = figure.meshes(vector, np.eye(4))
        light = {part.name: mesh.light for part, mesh in zip(drawn, meshes, strict=True)}
        return np.array([light[part.name][row, 1] for part, row in places])

    drawn = [part for part in figure.model.parts if part.kind != "eye"]
    places = []
    for name in ("9.10", "9.11", "6.1"):  # edges of the teeth, tip of the tongue
        vertex = int(figure.model.bound[point_rows()[name]])
        starts = figure.model.starts
        part = max((p for p in drawn if starts[p.name] <= vertex), key=lambda p: starts[p.name])
        places.append((part, vertex - starts[part.name]))
    wide = faps(f3=700, f5=-900, f10=-700, f11=-700, f52=-900, f57=-700, f58=-700, f4=-300, f51=-300)
    assert (seen(STILL) < 0.06).all()
    assert (seen(wide) > 0.1).all()


def test_a_damaged_texture_is_told_and_the_colour_shown() -> None:
    model = FaceModel.default()
    skin = model.parts[0]
    broken = replace(skin, material=replace(skin.material, texture=b"\x89PNG no picture"))
    with pytest.warns(FbaWarning, match="texture of part 'skin' cannot be read"):
        figure = build_figure(replace(model, parts=(broken, *model.parts[1:])))
    assert figure.meshes(STILL, np.eye(4))[0].shape.picture is None


def body(frames: list[dict[int, int]], **more: object) -> Animation:
    return Animation(25, np.arange(len(frames)), body=body_track(frames), **more)  # type: ignore[arg-type]


def test_the_head_goes_with_the_body() -> None:
    scene = Scene(body([{}, {181: 0, 182: 300, 183: 0}, {1: 0}]))
    names = list(scene._skeleton.names)
    assert "skullbase" in names
    first = scene.view_at(0.0).eyes[0].matrix[:3, 3]
    assert 1.55 < first[1] < 1.70  # the eyes of somebody 1.75 m tall
    moved = scene.view_at(0.04).eyes[0].matrix[:3, 3] - first
    assert np.linalg.norm(moved) == pytest.approx(0.3, abs=1e-6)


def test_a_face_has_shoulders_and_a_body_has_ground() -> None:
    face = Scene(Animation(25, np.arange(1), face=face_track([{3: 1}]))).view_at(0.0)
    whole = Scene(body([{}])).view_at(0.0)
    assert (face.ground, len(face.capsules), len(face.eyes)) == (False, 0, 2)
    assert (whole.ground, len(whole.capsules), len(whole.eyes)) == (True, 0, 2)
    assert len(whole.faces) > len(face.faces)
    assert len(whole.blobs) == 5


def test_the_camera_suits_the_content() -> None:
    face = Scene(Animation(25, np.arange(1), face=face_track([{3: 1}])))
    assert default_camera(face).distance < 1.5
    whole = Scene(body([{}]))
    assert default_camera(whole).distance > 3
    gesture = Scene(Animation(25, np.arange(1), face_track([{3: 1}]), body_track([{32: 5}])))
    assert default_camera(face).distance < default_camera(gesture).distance < default_camera(whole).distance


def test_somebody_who_walks_away_is_followed() -> None:
    scene = Scene(body([{181: 0, 182: 0, 183: 0}, {181: 20_000, 182: 0, 183: 20_000}]))
    far = scene.travel(0.04)
    assert np.hypot(far[0], far[2]) > 19
    near = Scene(body([{183: 0}, {183: 500}]))
    assert near.travel(0.04) == (0.0, 0.0, 0.0)


def test_a_real_stream(shared: Path) -> None:
    import fba

    path = shared / "data" / "ist" / "ALLEXPS.FAP"
    scene = Scene(fba.read(path))
    neutral, joy = (scene.timeline.faps(frame / 30) for frame in (0, 150))
    assert not neutral.any()
    assert joy[12 - 1] > 200  # corners of the lips go up at full joy


def test_the_camera_follows_what_it_is_told_to(walking: Animation) -> None:
    scene = Scene(walking)
    assert scene.followed(0.3) == (0.0, 0.0, 0.0)  # nobody walks away
    assert scene.followed(0.3, of_head=True) == scene.head_travel(0.3)
    scene.follow = "head"
    assert scene.followed(0.3) == scene.head_travel(0.3)
    scene.follow = "none"
    assert scene.followed(0.3, of_head=True) == (0.0, 0.0, 0.0)


def test_the_hips_stay_in_the_middle_of_the_picture() -> None:
    steps = np.zeros((10, BAP_COUNT), np.int32)
    steps[:, 181] = np.arange(10) * 100  # millimetres to the left
    mask = np.zeros((10, BAP_COUNT), bool)
    mask[:, 180:183] = True
    scene = Scene(Animation(25, np.arange(10), body=BodyTrack(steps, mask)))
    assert scene.travel(0.3) == (0.0, 0.0, 0.0)
    scene.follow = "hips"
    start, later = (np.array(scene.travel(time)) for time in (0.0, 0.36))
    np.testing.assert_allclose(start, 0.0, atol=1e-9)
    assert np.abs(later).max() == pytest.approx(0.9)


@pytest.mark.parametrize(("switch", "degrees"), [("contact", -20), ("relaxed", 30)])
def test_hands_are_shown_outside_the_body_and_at_ease_unless_switched_off(
    switch: str, degrees: float
) -> None:
    """The stream is not changed, and as points it is shown as it is."""
    turned = {"l_shoulder_abduct": degrees, "r_shoulder_abduct": -degrees}
    number = bap_numbers()
    track = body_track([{number[name]: round(np.radians(angle) * 1e5) for name, angle in turned.items()}])
    sent = track.values.copy()
    scene = Scene(Animation(25, np.arange(1), None, track))
    for view, least in (("figure", 0.01), ("points", 0.0)):
        scene.view = view
        pictures = []
        for on in (True, False):
            scene.show(switch, on)
            seen = scene.view_at(0.0)
            places = seen.faces[0].positions if view == "figure" else seen.capsules
            pictures.append(np.array(places, dtype=np.float64))
        assert (np.abs(pictures[0] - pictures[1]).max() > least) == (view == "figure")
    np.testing.assert_array_equal(track.values, sent)
