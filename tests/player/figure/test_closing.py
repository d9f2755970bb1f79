"""What closes is closed, and what is inside stays inside: lips, lids, tongue and teeth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from scipy.spatial import cKDTree

import fba
from fba.animation import Animation, BodyTrack
from fba.arrays import Bool, Float32, Float64, Intp
from fba.face import Deformer, resolve
from fba.face.authoring.surface.landmarks import Landmarks, find_landmarks, weld_skin
from fba.face.model import FaceModel
from fba.parameters import faps as parameters
from fba.parameters import point_rows
from fba.player import Offscreen, Scene
from fba_player._figure.face import FaceFigure, build_figure
from player_tracks import face_track

OPEN = {
    3: 500,
    8: -50,
    9: -50,
    5: -600,
    10: -500,
    11: -500,
    51: -50,
    55: -50,
    56: -50,
    52: -600,
    57: -500,
    58: -500,
}
"""FAPs of jaw and lips: a mouth that is open."""
SAMPLES = Path(fba.__file__).parent / "samples"
SEEN = 12
"""Frames of a stream that are looked at."""
TONGUE = (43, 44, 45, 46)
BRIGHT = 3000.0


def vector(values: dict[int, float]) -> Float32:
    result = np.zeros(68, dtype=np.float32)
    for number, value in values.items():
        result[number - 1] = value
    return result


@pytest.fixture(scope="module")
def marks() -> Landmarks:
    model = FaceModel.default()
    return find_landmarks(weld_skin(model.parts, model.bound), model.points, model.bound)


@pytest.fixture(scope="module")
def figure() -> FaceFigure:
    return build_figure(FaceModel.default())


def of_model(marks: Landmarks, chosen: Bool) -> Bool:
    """Return a mask of the model's vertices for one of the surface's."""
    result = np.zeros(len(FaceModel.default().vertices), dtype=bool)
    result[marks.surface.pool] = chosen[marks.surface.number]
    return result


def walls(marks: Landmarks) -> Bool:
    """Return (V,): the inside of the mouth, without what is within two edges of the lips."""
    inside = marks.inside_mouth.copy()
    for _ in range(2):
        edges = marks.surface.edges
        beside = np.zeros_like(inside)
        for a, b in (edges.T, edges[:, ::-1].T):
            np.logical_or.at(beside, a, ~inside[b])
        inside &= ~beside
    return of_model(marks, inside)


def person(faps: dict[int, float], bright: Bool | None = None) -> Scene:
    """Return a person with these FAPs. bright: (V,) vertices of the face whose colour outshines all."""
    count = 296
    still = BodyTrack(np.zeros((1, count), np.int32), np.zeros((1, count), bool))
    scene = Scene(Animation(25, np.arange(1), face_track([faps]), still))
    shapes = scene.person.face_shapes
    for name, shape in list(shapes.items()) if bright is not None else ():
        assert bright is not None
        rows = bright[scene.figure.rows(name)]
        if rows.any():
            colours = shape.colours.copy()
            colours[rows, :3] = BRIGHT
            shapes[name] = replace(shape, colours=colours)
    return scene


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize("lines", [360, 720, 1080])
@pytest.mark.parametrize(
    "pose", [{}, {5: 60, 10: 60, 11: 60, 4: 60, 8: 60, 9: 60}, {6: 150, 7: 150, 12: 90, 13: 90}]
)
def test_closed_lips_show_nothing_of_the_mouth(marks: Landmarks, lines: int, pose: dict[int, float]) -> None:
    """Pictures of a whole person are equal, whatever colour walls of the mouth, teeth and tongue have."""
    bright = walls(marks)
    for part in FaceModel.default().parts:
        if part.kind in ("teeth", "tongue"):
            start = FaceModel.default().starts[part.name]
            bright[start : start + len(part.vertices)] = True
    plain, shining = person(pose), person(pose, bright)
    size = (lines * 16 // 9, lines)
    camera = plain.camera("body", 16 / 9)
    with Offscreen(plain, size, camera) as one, Offscreen(shining, size, camera) as other:
        for yaw, pitch in ((0, 0), (25, 0), (-35, 15), (60, 0)):
            one.camera = other.camera = replace(camera, yaw=yaw, pitch=pitch)
            np.testing.assert_array_equal(one.frame(0.0), other.frame(0.0))


@pytest.mark.parametrize("split", [(1024, 0), (512, 512), (700, 324)])
def test_lids_meet_along_their_whole_length(marks: Landmarks, split: tuple[int, int]) -> None:
    upper, lower = split
    model = FaceModel.default()
    moved = Deformer(model).local(vector({19: upper, 20: upper, 21: lower, 22: lower}))
    places = np.empty((len(marks.surface), 3))
    places[marks.surface.number] = moved[marks.surface.pool]
    for side in ("left", "right"):
        margins = [places[marks.contour(f"{side} {lid} lid")] for lid in ("upper", "lower")]
        top, bottom = (sampled(line) for line in margins)
        assert cKDTree(top).query(bottom)[0].max() < 0.0002
        assert cKDTree(bottom).query(top)[0].max() < 0.0002


def sampled(line: Float64) -> Float64:
    """Return points along a line (N, 3), 20 on each of its pieces."""
    steps = np.linspace(0, 1, 20, endpoint=False)[:, None, None]
    return np.concatenate([(line[:-1] + steps * np.diff(line, axis=0)).reshape(-1, 3), line[-1:]])


def outer_skin(marks: Landmarks) -> npt.NDArray[np.intp]:
    """Return triangles (F, 3) of the face around the mouth, without lips and what is behind them."""
    red = marks.lips | marks.on_inner_lips | marks.inside_mouth
    red |= marks.on_contours("upper outer lip", "lower outer lip")
    model = FaceModel.default()
    start, skin = model.starts["skin"], model.part("skin")
    triangles = skin.triangles.astype(np.intp) + start
    low, high = model.points[point_rows()["2.1"]][1] - 0.01, model.points[point_rows()["9.3"]][1]
    middle = model.vertices[triangles].mean(axis=1)
    near = (
        (middle[:, 1] > low) & (middle[:, 1] < high) & (middle[:, 2] > -0.05) & (np.abs(middle[:, 0]) < 0.06)
    )
    return np.asarray(triangles[near & ~of_model(marks, red)[triangles].any(axis=1)])


def pierced(positions: Float32, edges: Intp, triangles: Intp) -> int:
    """Return how many edges (E, 2) pass through triangles (F, 3)."""
    start = positions[edges[:, 0]].astype(np.float64)
    way = positions[edges[:, 1]] - start
    corner = positions[triangles].astype(np.float64)
    middle = corner.mean(axis=1)
    reach = np.linalg.norm(corner - middle[:, None], axis=2).max(axis=1)
    reach += np.linalg.norm(way, axis=1).max() / 2
    near = cKDTree(start + way / 2).query_ball_point(middle, reach)
    pairs = np.repeat(np.arange(len(triangles)), [len(those) for those in near])
    edge = np.concatenate([np.asarray(those, dtype=np.intp) for those in near])
    return int(_crossings(start[edge], way[edge], corner[pairs]).sum())


def _crossings(start: Float64, way: Float64, corner: Float64) -> Bool:
    """Return (N,) whether segments cross triangles (N, 3, 3), each its own, by Moeller and Trumbore."""
    one, two = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    across = np.cross(way, two)
    det = (across * one).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        away = start - corner[:, 0]
        u = (away * across).sum(axis=1) / det
        turned = np.cross(away, one)
        v = (way * turned).sum(axis=1) / det
        t = (turned * two).sum(axis=1) / det
        return np.asarray((u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1))


def inner_edges(figure: FaceFigure) -> Intp:
    """Return (E, 2): edges of tongue and teeth, vertices counted through the model."""
    found = []
    for part in figure.model.parts:
        if part.kind in ("tongue", "teeth"):
            corners = part.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
            found.append(
                np.unique(np.sort(corners, axis=1), axis=0).astype(np.intp) + figure.model.starts[part.name]
            )
    return np.concatenate(found)


def tongue_poses() -> Iterator[dict[int, float]]:
    for mouth in ({}, {3: 600}, OPEN):
        for number in TONGUE:
            for value in (-1080, -500, -150, 150, 500, 800, 1080):
                yield {**mouth, number: value}
        yield {**mouth, 43: -900, 44: 800, 45: 900}
        yield {**mouth, 44: -900, 45: 900, 46: 400}


@pytest.mark.slow
def test_the_tongue_pierces_no_skin(marks: Landmarks, figure: FaceFigure) -> None:
    edges, skin = inner_edges(figure), outer_skin(marks)
    for values in tongue_poses():
        assert pierced(figure.pose(vector(values)).positions, edges, skin) == 0, values


def test_closed_lips_hold_the_tongue_back(figure: FaceFigure) -> None:
    lips = figure.model.bound[[point_rows()["2.2"], point_rows()["2.3"]]]
    tongue = figure.rows("tongue")
    for values in ({45: 1080}, {3: 600, 45: 800}, {44: 500, 45: 500}):
        positions = figure.pose(vector(values)).positions
        assert positions[tongue, 2].max() < positions[lips, 2].min()
    out = figure.pose(vector({**OPEN, 45: 1080})).positions
    assert out[tongue, 2].max() > out[lips, 2].max() + 0.015


def test_a_tongue_that_is_out_lies_on_the_lower_lip(figure: FaceFigure) -> None:
    lower = int(figure.model.bound[point_rows()["2.3"]])
    positions = figure.pose(vector({**OPEN, 45: 900})).positions
    tongue = positions[figure.rows("tongue")] - positions[lower]
    below = (np.abs(tongue[:, 0]) < 0.004) & (np.abs(tongue[:, 2]) < 0.008) & (tongue[:, 1] < 0.004)
    ahead, height = tongue[below][np.argsort(tongue[below, 2])][:, [2, 1]].T
    assert ahead[0] < 0 < ahead[-1]
    assert 0 <= np.interp(0.0, ahead, height) < 0.001


def test_a_tongue_that_rests_stays_where_its_tables_put_it(figure: FaceFigure) -> None:
    values = vector({3: 400, 5: -300})
    rows = figure.rows("tongue")
    np.testing.assert_array_equal(
        figure.pose(values).positions[rows], Deformer(figure.model).local(values)[rows]
    )


def test_lids_follow_the_gaze_unless_they_are_closed(figure: FaceFigure) -> None:
    upper = int(figure.model.bound[point_rows()["3.1"]])
    rest, down, up = (
        figure.pose(vector({25: way, 26: way})).positions[upper, 1] for way in (0, 25000, -25000)
    )
    assert down < rest - 0.001
    assert up > rest + 0.001
    shut = {19: 1024, 20: 1024}
    closed, looking = (figure.pose(vector({**shut, 25: way})).positions for way in (0, 25000))
    np.testing.assert_array_equal(closed[upper], looking[upper])


@pytest.mark.parametrize("number", [16, 17])
def test_lips_pushed_back_stop_before_the_teeth(marks: Landmarks, figure: FaceFigure, number: int) -> None:
    edges, skin = inner_edges(figure), outer_skin(marks)
    for value in (-1080, -450):
        assert pierced(figure.pose(vector({number: value})).positions, edges, skin) == 0, value


@pytest.mark.parametrize("sample", ["hello.fap"])
def test_frames_of_a_stream_keep_tongue_and_teeth_inside(
    marks: Landmarks, figure: FaceFigure, sample: str
) -> None:
    edges, skin = inner_edges(figure), outer_skin(marks)
    animation = fba.read(SAMPLES / sample)
    assert animation.face is not None
    frames = resolve(animation.face, figure.model)
    for frame in np.random.default_rng(30).choice(len(frames), SEEN, replace=False):
        assert pierced(figure.pose(frames[frame].astype(np.float32)).positions, edges, skin) == 0, frame


@pytest.mark.slow
def test_faps_of_the_mouth_keep_tongue_and_teeth_inside(marks: Landmarks, figure: FaceFigure) -> None:
    edges, skin = inner_edges(figure), outer_skin(marks)
    for parameter in parameters()[2:]:
        if parameter.group not in (2, 8):
            continue
        for value in (-200, 200):
            positions = figure.pose(vector({parameter.number: value})).positions
            assert pierced(positions, edges, skin) == 0, (parameter.number, value)
