"""Contact sheets: every FAP, viseme and expression once, from where it can be seen."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from fba.animation import Animation
from fba.parameters import faps
from fba.player import Camera, Offscreen, Scene
from fba.tracks import FaceTrack
from fba_player.export.contact_sheet import close_up, contact_sheet, tiles


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene(Animation(Fraction(25), np.arange(1), FaceTrack.empty(1)))


def test_there_is_a_picture_of_everything(scene: Scene) -> None:
    low = tiles("faps", scene)
    assert [tile.label for tile in low] == [f"{fap.number} {fap.name}" for fap in faps()[2:]]
    assert [tile.label for tile in tiles("visemes", scene)][:2] == ["p b m", "f v"]
    assert len(tiles("visemes", scene)) == 14
    expected = ["joy", "sadness", "anger", "fear", "disgust", "surprise"]
    assert [tile.label for tile in tiles("expressions", scene)] == expected


def test_values_are_such_as_a_stream_can_carry(scene: Scene) -> None:
    for fap, tile in zip(faps()[2:], tiles("faps", scene), strict=True):
        value = float(tile.faps[fap.number - 1])
        assert tile.note == f"{value:+.0f}"
        assert fap.i_limits is not None
        low, high = (limit * fap.step for limit in fap.i_limits)
        assert low <= value <= high, fap.label


@pytest.mark.usefixtures("opengl")
def test_every_fap_can_be_seen(scene: Scene) -> None:
    """Each picture differs from the same one without its FAP."""
    size = (72, 72)
    missed = {}
    with Offscreen(scene, size) as view:
        for fap, tile in zip(faps()[2:], tiles("faps", scene), strict=True):
            view.camera = Camera(yaw=tile.yaw, pitch=tile.pitch).fit(close_up(tile.view, scene), 1.0)
            without = tile.faps.copy()
            without[fap.number - 1] = 0
            with_it, bare = (view.still(vector).astype(int) for vector in (tile.faps, without))
            seen = int((np.abs(with_it - bare).max(axis=2) > 12).sum())
            if seen <= 12:
                missed[fap.label] = seen
    assert missed == {}


@pytest.mark.usefixtures("opengl")
def test_the_sheet_of_all_stacks_the_three_sheets() -> None:
    sheets = [contact_sheet(what, tile=(24, 20)) for what in ("faps", "visemes", "expressions", "all")]
    heights = [sheet.shape[0] for sheet in sheets]
    assert heights[3] == sum(heights[:3])
    assert sheets[3].shape[1] == max(sheet.shape[1] for sheet in sheets[:3])
    np.testing.assert_array_equal(sheets[3][: heights[0], : sheets[0].shape[1]], sheets[0])


def test_unknown_sheets_and_tiny_tiles_are_refused() -> None:
    with pytest.raises(ValueError, match="faps, visemes, expressions, all"):
        contact_sheet("tongues")
    with pytest.raises(ValueError, match="16x16"):
        contact_sheet("faps", tile=(4, 4))
