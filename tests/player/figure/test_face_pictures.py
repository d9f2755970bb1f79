"""Pictures of the built-in head: what FAPs do is seen where geometry says."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from fba.animation import Animation
from fba.face.model import FaceModel
from fba.parameters import point_rows
from fba.player import Camera, Offscreen, Scene
from player_tracks import face_track

pytestmark = pytest.mark.usefixtures("opengl")
UInt8 = npt.NDArray[np.uint8]
SIZE = (480, 360)


def scene(model: FaceModel | None = None) -> Scene:
    return Scene(Animation(25, np.arange(1), face_track([{}])), model)  # type: ignore[arg-type]


def vector(faps: dict[int, float]) -> npt.NDArray[np.float32]:
    found = np.zeros(68, dtype=np.float32)
    for number, value in faps.items():
        found[number - 1] = value
    return found


def pixel(camera: Camera, place: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """(x, y) of a place in a picture of `SIZE`, from the upper left."""
    aspect = SIZE[0] / SIZE[1]
    clip = camera.projection_matrix(aspect) @ camera.view_matrix() @ [*np.asarray(place), 1.0]
    return np.array([SIZE[0] * (1 + clip[0] / clip[3]) / 2, SIZE[1] * (1 - clip[1] / clip[3]) / 2])


def shown(
    camera: Camera, *poses: dict[int, float], model: FaceModel | None = None
) -> list[npt.NDArray[np.int64]]:
    with Offscreen(scene(model), SIZE, camera) as view:
        return [view.still(vector(faps))[..., :3].astype(int) for faps in poses]


def backdrop(camera: Camera) -> npt.NDArray[np.int64]:
    """The same picture with the head turned out of it."""
    nobody = scene()
    nobody.still = lambda faps: type(nobody.view_at(0.0))()  # type: ignore[method-assign]
    with Offscreen(nobody, SIZE, camera) as view:
        return view.still(np.zeros(68))[..., :3].astype(int)


def eye_camera(side: str = "3.5") -> Camera:
    points = FaceModel.default().points
    x, y, z = points[point_rows()[side]]
    return Camera(target=(x, y, z), distance=0.16)


def test_open_jaw_lowers_the_silhouette_of_the_chin() -> None:
    camera = scene().camera("profile", SIZE[0] / SIZE[1])
    model = FaceModel.default()
    neutral, opened = shown(camera, {}, {3: 600})
    empty = backdrop(camera)
    chin = model.points[point_rows()["2.1"]]
    sunk = 600 * model.fapu.MNS
    before_neck = slice(0, round(pixel(camera, chin - [0, 0, 0.02])[0]))  # the face looks to the left
    lowest = []
    for picture in (neutral, opened):
        head = np.abs(picture - empty).max(axis=2)[:, before_neck] > 12
        lowest.append(int(np.flatnonzero(head.any(axis=1)).max()))
    expected = pixel(camera, chin - [0, sunk, 0])[1] - pixel(camera, chin)[1]
    assert expected > 10
    assert lowest[1] - lowest[0] == pytest.approx(expected, rel=0.2)


@pytest.mark.parametrize("split", [(1024, 0), (700, 324)])
def test_closed_lids_hide_the_eye(split: tuple[int, int]) -> None:
    camera = eye_camera()
    open_, closed = shown(camera, {}, {19: split[0], 21: split[1]})
    middle = (slice(SIZE[1] // 2 - 20, SIZE[1] // 2 + 20), slice(SIZE[0] // 2 - 20, SIZE[0] // 2 + 20))
    assert open_[middle].max(axis=2).min() < 45  # the pupil
    redness = closed[middle][..., 0] - closed[middle][..., 2]
    assert np.median(redness) > 30  # skin
    assert (redness > 10).mean() > 0.9  # lashes may be left


def test_the_pupil_grows_and_the_gaze_turns() -> None:
    camera = eye_camera()
    straight, wide, aside = shown(camera, {}, {29: 170}, {23: 20000})
    row = SIZE[1] // 2 + 3  # below the light mirrored in the eye; lashes lie outside
    dark = [np.flatnonzero(picture[row, 190:290].max(axis=1) < 75) for picture in (straight, wide, aside)]
    at_rest, wide_ = len(dark[0]), len(dark[1])
    # A third of the iris at rest, and 170 of its 1024ths more.
    assert wide_ / at_rest == pytest.approx(1 + 170 / (1024 / 3), rel=0.12)
    centres = [float(np.median(columns)) for columns in (dark[0], dark[2])]
    eye = scene().figure.eyes(vector({}), np.eye(4))[0]
    centre, radius = eye.matrix[:3, 3], float(np.linalg.norm(eye.matrix[:3, 0]))
    turned = centre + radius * np.array([np.sin(0.2), 0, np.cos(0.2)])
    ahead = centre + radius * np.array([0, 0, 1.0])
    expected = pixel(camera, turned)[0] - pixel(camera, ahead)[0]
    assert centres[1] - centres[0] == pytest.approx(expected, abs=3)


def test_the_texture_is_on_the_skin() -> None:
    model = FaceModel.default()
    skin = model.parts[0]
    buffer = io.BytesIO()
    Image.new("RGB", (8, 8), (40, 200, 60)).save(buffer, format="PNG")
    green = replace(
        skin, material=replace(skin.material, colour=(1, 1, 1), texture=buffer.getvalue()), colours=None
    )
    other = replace(model, parts=(green, *model.parts[1:]))
    camera = scene().camera("front", SIZE[0] / SIZE[1])
    as_it_is, painted = shown(camera, {})[0], shown(camera, {}, model=other)[0]
    x, y = (round(v) for v in pixel(camera, model.points[point_rows()["5.3"]]))
    assert as_it_is[y, x, 0] > as_it_is[y, x, 1]
    assert painted[y, x, 1] > painted[y, x, 0] + 40


def test_a_texture_lies_the_right_way_up() -> None:
    """A face of one quad whose picture is red above and blue below."""
    model = FaceModel.default()
    part = model.parts[0]
    buffer = io.BytesIO()
    picture = np.zeros((16, 16, 3), dtype=np.uint8)
    picture[:8, :, 0] = picture[8:, :, 2] = 230
    Image.fromarray(picture).save(buffer, format="PNG")
    flat = type(part)(
        "board",
        "other",
        np.array([[-0.1, -0.1, 0.05], [0.1, -0.1, 0.05], [0.1, 0.1, 0.05], [-0.1, 0.1, 0.05]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
        texcoords=np.array([[0, 1], [1, 1], [1, 0], [0, 0]]),
        material=replace(part.material, colour=(1, 1, 1), texture=buffer.getvalue()),
    )
    with_board = replace(model, parts=(*model.parts, flat))
    camera = scene().camera("front", SIZE[0] / SIZE[1])
    drawn = shown(camera, {}, model=with_board)[0]
    high, low = (pixel(camera, (0.0, y, 0.05)).round().astype(int) for y in (0.05, -0.05))
    assert drawn[high[1], high[0], 0] > drawn[high[1], high[0], 2] + 60
    assert drawn[low[1], low[0], 2] > drawn[low[1], low[0], 0] + 60


def test_what_a_texture_leaves_clear_is_seen_through() -> None:
    model = FaceModel.default()
    part = model.parts[0]
    buffer = io.BytesIO()
    picture = np.zeros((4, 4, 4), dtype=np.uint8)
    picture[:, :2] = (0, 0, 255, 255)  # the left half is blue, the right half is not there
    Image.fromarray(picture).save(buffer, format="PNG")
    pane = type(part)(
        "pane",
        "lash",
        np.array([[-0.05, -0.05, 0.06], [0.05, -0.05, 0.06], [0.05, 0.05, 0.06], [-0.05, 0.05, 0.06]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
        texcoords=np.array([[0, 1], [1, 1], [1, 0], [0, 0]]),
        material=replace(part.material, colour=(1, 1, 1), texture=buffer.getvalue()),
    )
    camera = scene().camera("front", SIZE[0] / SIZE[1])
    # Light on the head alone is stored with it, rounded; with any pane it is computed: so both have one.
    behind = replace(pane, vertices=pane.vertices - (0, 0, 0.3))
    without, through = (
        shown(camera, {}, model=replace(model, parts=(*model.parts, part)))[0] for part in (behind, pane)
    )
    left, right = (pixel(camera, (x, 0.03, 0.06)).round().astype(int) for x in (-0.03, 0.03))
    assert through[left[1], left[0], 2] > without[left[1], left[0], 2] + 20
    np.testing.assert_allclose(
        through[right[1], right[0]].astype(int), without[right[1], right[0]].astype(int), atol=1
    )


def test_shoulders_stay_while_the_head_turns() -> None:
    camera = scene().camera("front", SIZE[0] / SIZE[1])
    ahead, turned = shown(camera, {}, {49: 60000})
    moved = np.abs(ahead - turned).max(axis=2) > 20
    eyes = round(pixel(camera, (0, 0, 0))[1])
    assert moved[eyes - 20 : eyes + 60].mean() > 0.05
    assert moved[-8:].mean() < 0.01
