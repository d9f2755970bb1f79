"""Brows are followed where they are dark ridges, and left where nothing is seen."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from fba.face.fitting._brows import BROWS, TRUST, USUAL, follow_brows
from fba.face.fitting._features import FACE_SIZE, features
from fba.face.fitting._points_file import FRONT_POINTS

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
