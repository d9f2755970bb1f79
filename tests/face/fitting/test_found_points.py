"""Points and brows are found on pictures of the built-in head, and not where there is no face."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from fba import Animation, FaceTrack, player
from fba.arrays import Float64, UInt8
from fba.errors import FbaWarning, ModelError
from fba.face import FaceModel
from fba.face.fitting import FRONT_POINTS, FoundPoints, Photograph, find_front_points, find_side_points
from fba.face.fitting._brows import BROWS, TRUST, USUAL, follow_brows
from fba.face.fitting._features import FACE_SIZE, features
from fba.face.fitting._front_points import _likely
from fba.parameters import point_rows

SIZE = (300, 360)


def rendered(yaw: float, size: tuple[int, int] = SIZE) -> tuple[Photograph, Float64]:
    """A picture of the built-in head, and where its feature points are on it."""
    scene = player.Scene(Animation(25, np.arange(1), FaceTrack.empty(1)))
    camera = player.Camera(target=(0.0, -0.03, -0.06), yaw=yaw, distance=1.5, field_of_view=13.0)
    with player.Offscreen(scene, size, samples=2) as view:
        view.camera = camera
        pixels: UInt8 = np.ascontiguousarray(view.frame(0.0)[..., :3])
    points = FaceModel.default().points
    clip = np.column_stack([points, np.ones(len(points))]) @ camera.clip_matrix(size).T
    return Photograph(pixels, size, "head.png"), (clip[:, :2] / clip[:, 3:] * (0.5, -0.5) + 0.5) * size


def errors(found: FoundPoints, true: Float64, unit: float) -> dict[str, float]:
    """How far each point is off, as a share of a length."""
    row = point_rows()
    return {
        name: float(np.hypot(*(np.array(at) - true[row[name]]))) / unit for name, at in found.points.items()
    }


@pytest.mark.parametrize(("spread", "left", "others"), [(0.005, 0.6, 0.05), (0.05, 0.1, 0.01)])
def test_a_point_that_no_likely_head_has_there_goes_back_the_more_the_more_tries_differ(
    spread: float, left: float, others: float
) -> None:
    true = FaceModel.default().points[[point_rows()[name] for name in FRONT_POINTS], :2] * (1000, -1000)
    eyes, own = float(np.linalg.norm(true[0] - true[1])), FRONT_POINTS.index("4.5")
    wrong, spreads = true.copy(), np.full(len(true), 0.005)
    wrong[own, 1] += 0.15 * eyes
    spreads[own] = spread
    before, after = (np.linalg.norm(at - true, axis=1) / eyes for at in (wrong, _likely(wrong, spreads)))
    assert after[own] < left * before[own]
    assert np.delete(after, own).max() < others


@pytest.mark.slow
def test_a_face_s_points_are_found(opengl: None) -> None:
    photograph, true = rendered(5.0)
    found = find_front_points(photograph)
    eyes = float(np.linalg.norm(true[point_rows()["3.5"]] - true[point_rows()["3.6"]]))
    off = errors(found, true, eyes)
    assert len(off) > 25
    assert np.mean(list(off.values())) < 0.06
    assert found.score > 0.6
    assert [step.pixels.ndim for step in found.steps] == [3, 3, 3]


@pytest.mark.parametrize("yaw", [86.0, -90.0])
def test_a_profile_s_points_are_found(opengl: None, yaw: float) -> None:
    photograph, true = rendered(yaw, (600, 720))
    found = find_side_points(photograph)
    tall = float(np.linalg.norm(true[point_rows()["9.3"]] - true[point_rows()["2.1"]]))
    off = errors(found, true, tall)
    assert {"9.3", "9.15", "8.1", "2.2", "8.2", "2.10"} <= set(off)
    assert off["9.3"] < 0.06
    assert np.mean(list(off.values())) < 0.08


def test_where_is_no_face_none_is_found() -> None:
    random = np.random.default_rng(1)
    noise = random.integers(0, 255, (200, 200, 3)).astype(np.uint8)
    plain = np.full((200, 200, 3), 128, dtype=np.uint8)
    for pixels in (noise, plain):
        photograph = Photograph(pixels, (200, 200), "no.png")
        with warnings.catch_warnings(action="ignore", category=FbaWarning):
            with pytest.raises(ModelError, match=r"no\.png.*no face was found"):
                find_front_points(photograph)
            with pytest.raises(ModelError, match=r"no\.png"):
                find_side_points(photograph)


ROWS = [[FRONT_POINTS.index(name) for name in names] for names in BROWS]


SKIN, DARK, VIOLET = (0.8, 0.6, 0.5), (0.2, 0.15, 0.12), (0.68, 0.6, 0.8)
"""Violet is as bright as the skin."""


def drawn(places: np.ndarray, aside: float, colour: tuple[float, float, float]) -> np.ndarray:
    """A face (3, H, W) with two lines where brows are, moved to the side by some pixels."""
    share = np.zeros(FACE_SIZE)
    for inner, top, outer in ROWS:
        bow = np.polyfit(places[[inner, top, outer], 0], places[[inner, top, outer], 1], 2)
        for x in np.linspace(places[inner, 0], places[outer, 0], 200):
            y = np.polyval(bow, x) + USUAL
            share[int(y) - 2 : int(y) + 3, round(x + aside)] = 1
    skin, brow = (np.array(one)[:, None, None] for one in (SKIN, colour))
    return np.asarray(skin + (brow - skin) * gaussian_filter(share, 0.7))


@pytest.mark.parametrize(("aside", "colour"), [(-5.0, DARK), (0.0, DARK), (5.0, DARK), (5.0, VIOLET)])
def test_ends_go_part_of_the_way_to_where_a_brow_ends(
    aside: float, colour: tuple[float, float, float]
) -> None:
    places = features().mean
    found = follow_brows(drawn(places, aside, colour), places)
    for inner, _, outer in ROWS:
        for row, trust in ((inner, TRUST[0, 0]), (outer, TRUST[2, 0])):
            assert found[row, 0] - places[row, 0] == pytest.approx(trust * aside, abs=trust * 3)
    others = np.setdiff1d(np.arange(len(places)), np.ravel(ROWS))
    np.testing.assert_array_equal(found[others], places[others])


def test_a_face_without_brows_keeps_its_points() -> None:
    places = features().mean
    np.testing.assert_array_equal(follow_brows(np.full((3, *FACE_SIZE), 0.7), places), places)
