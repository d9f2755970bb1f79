"""What a scene shows: the head follows its feature points, the body its joints."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from player_tracks import body_track, face_track

from fba.animation import Animation
from fba.body import Skeleton
from fba.face import feature_point_names
from player import Scene, default_camera
from player.head import Head
from player.mannequin import Mannequin

ROW = {name: row for row, name in enumerate(feature_point_names())}
STILL = np.zeros(68, dtype=np.float32)


def faps(**values: float) -> np.ndarray:
    vector = STILL.copy()
    for name, value in values.items():
        vector[int(name[1:]) - 1] = value
    return vector


def skin(vector: np.ndarray) -> np.ndarray:
    return Head.default().meshes(vector, np.eye(4))[0].positions.astype(float)


def nearest(point: str) -> int:
    """Skin vertex at a feature point of the neutral face."""
    away = np.linalg.norm(skin(STILL) - Head.default().face.points[ROW[point]], axis=1)
    assert away.min() < 0.0025, point
    return int(away.argmin())


@pytest.mark.parametrize(
    ("fap", "point", "millimetres"),
    [
        (3, "2.1", (0, -500 * 21.5 / 1024)),
        (31, "4.1", (0, 500 * 45 / 1024)),
        (33, "4.3", (0, 500 * 45 / 1024)),
        (39, "5.1", (500 * 62 / 1024, 0)),
        (51, "8.1", (0, -500 * 21.5 / 1024)),
        (61, "9.1", (500 * 45 / 1024, 0)),
        (63, "9.3", (0, 500 * 45 / 1024)),
    ],
)
def test_the_skin_follows_feature_points(fap: int, point: str, millimetres: tuple[float, float]) -> None:
    vertex = nearest(point)
    shift = (skin(faps(**{f"f{fap}": 500})) - skin(STILL))[vertex, :2] * 1000
    np.testing.assert_allclose(shift, millimetres, atol=0.12 * max(np.abs(millimetres)))


def test_an_upper_lip_never_grips_the_lower_one() -> None:
    moved = np.abs(skin(faps(f4=-400, f8=-300, f9=-300, f51=-400)) - skin(STILL)).max(axis=1)
    below = (skin(STILL)[:, 1] < -0.072) & (np.abs(skin(STILL)[:, 0]) < 0.012)
    assert moved[below].max() < 0.0006
    assert moved.max() > 0.006


def test_the_back_of_the_head_stays() -> None:
    vector = faps(f3=1000, f6=600, f31=900, f39=900, f19=1080, f63=600)
    still = skin(STILL)[:, 2] < -0.09
    assert still.sum() > 200
    np.testing.assert_array_equal(skin(vector)[still], skin(STILL)[still])


@pytest.mark.parametrize("lids", [0, 300, 700, 1024, -300])
def test_lids_stay_off_the_eyeballs(lids: int) -> None:
    face = Head.default().face
    positions = skin(faps(f19=lids, f20=lids))
    for centre in face.eyeball_centres:
        assert np.linalg.norm(positions - centre, axis=1).min() > face.eyeball_radius


@pytest.mark.parametrize("viseme", range(15))
def test_lips_never_pass_through_each_other(viseme: int) -> None:
    from fba.face import Definitions

    head = Head.default()
    positions = head.meshes(Definitions.default().visemes[viseme], np.eye(4))[0].positions
    upper, lower = (head._surface.parts[f"lip inner {which}"] for which in ("upper", "lower"))
    assert (positions[upper[1:-1], 1] - positions[lower, 1]).min() > -1e-6


def test_extreme_faps_give_finite_meshes() -> None:
    head = Head.default()
    for value in (10**5, -(10**5)):
        for mesh in head.meshes(np.full(68, value, dtype=np.float32), np.eye(4)):
            assert np.isfinite(mesh.positions).all()
            assert np.isfinite(mesh.normals).all()


def test_the_skin_is_closed_but_for_eyes_and_mouth() -> None:
    triangles = Head.default()._surface.triangles
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    found, uses = np.unique(edges, axis=0, return_counts=True)
    assert uses.max() == 2
    border = np.unique(found[uses == 1])
    parts = Head.default()._surface.parts
    allowed = np.concatenate(
        [rows for name, rows in parts.items() if "margin" in name or "lip inner" in name]
    )
    assert set(border) <= set(allowed)


def test_capsules_stand_where_the_table_puts_them() -> None:
    skeleton = Skeleton.default()
    rest = np.tile(np.eye(4), (len(skeleton.names), 1, 1))
    rest[:, :3, 3] = skeleton.centres
    mannequin = Mannequin(skeleton)
    capsules = mannequin.capsules(rest)
    assert np.abs(capsules[:, [1, 5]]).max() < 1.5
    left, right = capsules[capsules[:, 0] > 0.01], capsules[capsules[:, 0] < -0.01]
    assert len(left) == len(right) > 25
    np.testing.assert_allclose(np.sort(left[:, 1]), np.sort(right[:, 1]))
    lifted = rest.copy()
    lifted[:, :3, 3] += (0, 0.5, 0)
    np.testing.assert_allclose(mannequin.capsules(lifted)[:, [1, 5]], capsules[:, [1, 5]] + 0.5, atol=1e-6)


def body(frames: list[dict[int, int]], **more: object) -> Animation:
    return Animation(25, np.arange(len(frames)), body=body_track(frames), **more)  # type: ignore[arg-type]


def test_the_head_goes_with_the_body() -> None:
    scene = Scene(body([{}, {181: 0, 182: 300, 183: 0}, {1: 0}]))
    names = list(scene._skeleton.names)
    assert "skullbase" in names
    first = scene.at(0.0).eyes[0].matrix[:3, 3]
    assert 1.55 < first[1] < 1.70  # the eyes of somebody 1.75 m tall
    moved = scene.at(0.04).eyes[0].matrix[:3, 3] - first
    assert np.linalg.norm(moved) == pytest.approx(0.3, abs=1e-6)


def test_a_face_has_shoulders_and_a_body_has_ground() -> None:
    face = Scene(Animation(25, np.arange(1), face=face_track([{3: 1}]))).at(0.0)
    whole = Scene(body([{}])).at(0.0)
    assert (face.ground, len(face.capsules), len(face.eyes)) == (False, 0, 2)
    assert whole.ground
    assert len(whole.capsules) > 50
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
