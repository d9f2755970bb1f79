"""What lips and lids do beside moving their feature points: arcs, flatter lips, a fold that stretches."""

import numpy as np
import pytest

from fba import figures
from fba.face.authoring.regions._eye_opening import STRETCHED, Opening, stretch_fold
from fba.face.authoring.regions._eyes import Eye
from fba.face.authoring.regions._lips import lip_motions
from fba.face.authoring.regions.jaw import hollowing
from fba.face.authoring.surface._fold_limits import Limiter
from fba.face.authoring.surface._motion import Motion
from fba.face.authoring.surface.landmarks import Landmarks, find_landmarks, weld_skin
from fba.face.authoring.surface.surface import weld_parts
from fba.face.model import Part


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


def test_the_fold_above_a_closing_lid_is_stretched_out() -> None:
    """A ridge across a sheet that a lid pulls down: gone when it is closed, and nothing else moves."""
    across, down = np.meshgrid(np.arange(21) * 0.001, np.arange(25) * 0.001)
    ridge = 0.002 * np.exp(-(((down - 0.012) / 0.002) ** 2))
    vertices = np.stack([across, -down, ridge], axis=-1).reshape(-1, 3)
    corner = (np.arange(24)[:, None] * 21 + np.arange(20)).ravel()
    halves = [corner[:, None] + (0, 21, 22), corner[:, None] + (0, 22, 1)]
    sheet = weld_parts([Part("skin", "skin", vertices, np.concatenate(halves).astype(np.int32))])
    share = np.clip((sheet.vertices[:, 1] + 0.004) / -0.016, 0.0, 1.0)
    moving = np.flatnonzero(share > 0)
    ways = np.array([-0.5, 0.0, 0.5, 1.0])
    shifts = np.zeros((4, len(moving), 3))
    shifts[..., 1] = -0.003 * ways[:, None] * share[moving]
    eye = Eye("left", ("eye",), np.array([0.010, -0.012, -0.040]), 0.036, np.zeros(3), measured=True)
    wide = Opening(np.array([-0.1, 0.1]), np.zeros((2, 2)), np.zeros((2, 2)))  # corners far away
    stretched = stretch_fold(sheet, share, moving, shifts, ways, wide, eye)
    np.testing.assert_array_equal(stretched[:2], shifts[:2])  # of an eye that is open, or wide open
    edge = share[moving] >= STRETCHED[1]
    np.testing.assert_array_equal(stretched[:, edge], shifts[:, edge])
    heights = (sheet.vertices[moving] + stretched)[..., 2].max(axis=1)
    assert heights[1] == pytest.approx(0.002)
    assert heights[2] == pytest.approx(0.001, abs=2e-4)
    assert heights[3] < 2e-4
