"""What lips and lids do beside moving their feature points: arcs, flatter lips, a fold that settles."""

import numpy as np
import pytest

from fba import figures
from fba.face.authoring.regions._eye_opening import SETTLED, Opening, settle_fold
from fba.face.authoring.regions._eyes import Eye
from fba.face.authoring.regions._lips import lip_motions
from fba.face.authoring.regions.jaw import hollowing
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import Motion
from fba.face.authoring.surface.landmarks import Landmarks, find_landmarks, weld_skin


@pytest.fixture(scope="module")
def lips() -> tuple[Landmarks, dict[int, Motion]]:
    """The landmarks of the built-in head, and motions of its lips."""
    face = figures.face("alex")
    marks = find_landmarks(weld_skin(face.parts, face.bound), face.points, face.bound)
    limiter = Limiter.from_mesh(marks.surface.vertices, marks.surface.triangles)
    return marks, lip_motions(marks, limiter)[0]


@pytest.mark.parametrize(
    ("pair", "contour", "point", "value"),
    [
        ((10, 57), "lower inner lip", "2.8", -300),
        ((8, 55), "upper inner lip", "2.6", -300),
        ((10, 57), "lower inner lip", "2.8", 150),
        ((8, 55), "upper inner lip", "2.6", 150),
        ((10, 57), "lower inner lip", "2.8", -700),  # a mouth wide open is an oval
    ],
)
def test_beside_the_corner_lips_move_in_an_arc(
    lips: tuple[Landmarks, dict[int, Motion]], pair: tuple[int, int], contour: str, point: str, value: int
) -> None:
    marks, motions = lips
    way = np.zeros(len(marks.surface))
    for fap in pair:
        way[motions[fap].vertices] += motions[fap].shifts_at(value)[:, 1]
    own, walk = marks.vertex[point], marks.contour(contour)
    places = marks.surface.vertices[walk]
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    until = length[int(np.flatnonzero(walk == own)[0])]
    quarter = int(np.abs(length / until - 0.25).argmin())
    assert way[walk[0]] == pytest.approx(0, abs=1e-6)
    assert way[walk[quarter]] / way[own] > 1.4 * length[quarter] / until


@pytest.mark.parametrize(
    ("contour", "value"), [("upper inner lip", -200), ("lower inner lip", -200), ("lower inner lip", 200)]
)
def test_a_corner_leaves_the_arcs_beside_it_with_their_lips(
    lips: tuple[Landmarks, dict[int, Motion]], contour: str, value: int
) -> None:
    marks, motions = lips
    way = np.zeros(len(marks.surface))
    for fap in (12, 59):
        way[motions[fap].vertices] += motions[fap].shifts_at(value)[:, 1]
    walk = marks.contour(contour)
    steps = np.linalg.norm(np.diff(marks.surface.vertices[walk], axis=0), axis=1)
    length = np.concatenate([[0.0], np.cumsum(steps)])
    until = length[int(np.flatnonzero(walk == marks.vertex["2.6" if "upper" in contour else "2.8"])[0])]
    quarter = int(np.abs(length / until - 0.25).argmin())
    assert way[walk[quarter]] / way[walk[0]] < 0.75


def test_cheeks_answer_to_corners_and_jaw(lips: tuple[Landmarks, dict[int, Motion]]) -> None:
    marks, motions = lips
    motion = motions[59]
    outward = (motion.shifts_at(300) * marks.surface.normals[motion.vertices]).sum(axis=1)
    assert outward[~(marks.lips | marks.inside_mouth)[motion.vertices]].max() > 0.0005
    hollow = hollowing(marks)
    depth = (hollow * marks.surface.normals).sum(axis=1)
    assert -0.2 < depth.min() < -0.1
    assert depth.max() == 0
    for point in ("2.1", "5.3", "8.3", "2.4", "9.1", "10.7"):
        assert np.linalg.norm(hollow[marks.vertex[point]]) < 0.02, point


@pytest.mark.parametrize(("fap", "value"), [(5, -300), (4, -300), (53, 300)])
def test_lips_that_open_or_stretch_grow_flatter_between_their_contours(
    lips: tuple[Landmarks, dict[int, Motion]], fap: int, value: int
) -> None:
    marks, motions = lips
    motion = motions[fap]
    outward = (motion.shifts_at(value) * marks.surface.normals[motion.vertices])[:, 2]
    red = marks.lips[motion.vertices] & (marks.surface.normals[motion.vertices][:, 2] > 0.7)
    assert outward[red].min() < -5e-5
    assert motion.shifts_at(-value)[red, 2].min() > -1e-6 or fap == 53


def test_the_fold_above_a_closing_lid_settles_on_the_eyeball() -> None:
    x = np.linspace(-0.012, 0.012, 65)
    line = np.stack([np.full(65, 0.005), np.full(65, 0.011)], axis=1)
    opening = Opening(x, line, line * (-1, 1))
    eye = Eye("left", ("eye",), np.zeros(3), 0.0123, np.array([0, 0, 0.0123]), measured=True)
    points = np.array([[0, 0.006, 0.0165], [0, 0.006, 0.0165], [0, 0.006, 0.0165], [0, 0.002, 0.0130]])
    share = np.array([0.5, 1.0, 0.0, 0.5])
    shifts = np.zeros((3, 4, 3))
    shifts[1, :, 1], shifts[2, :, 1] = -0.5 * share * 0.010, -share * 0.010
    settled = settle_fold(points, shifts, share, opening, eye)
    assert (settled[0] == 0).all()  # an open eye stays as it is
    np.testing.assert_array_equal(
        settled[:, 1:], shifts[:, 1:]
    )  # margins, still skin, and what lies on the ball
    away = np.linalg.norm(points[0] + settled[:, 0], axis=1) / eye.radius
    assert away[1] > away[2] == pytest.approx(SETTLED, abs=1e-6)
