"""Contact sheets: every FAP, viseme and expression once, from where it can be seen.

Sheets of a performance's frames.
"""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from fba.animation import Animation
from fba.errors import RangeError
from fba.parameters import faps
from fba.player import Camera, Offscreen, Scene
from fba.tracks import FaceTrack
from fba_player.export._sheet_layout import choose_columns
from fba_player.export.contact_sheet import close_up, contact_sheet, tiles
from fba_player.export.film_sheet import choose_frames, film_sheet
from player_tracks import face_track


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


@pytest.fixture(scope="module")
def uneven() -> Scene:
    """Frames at 0, 1, 2, 3 and 10 tenths of a second."""
    faces = face_track([{3: 80 * t} for t in range(5)])
    return Scene(Animation(10, np.array([0, 1, 2, 3, 10]), faces))


def test_frames_at_even_distances_in_time(uneven: Scene) -> None:
    assert choose_frames(uneven, 2, None, None) == [0, 4]
    assert choose_frames(uneven, 3, None, None) == [0, 3, 4]  # the one nearest to 0.5 s
    assert choose_frames(uneven, 1, None, None) == [0]
    assert choose_frames(uneven, 50, None, None) == [0, 1, 2, 3, 4]
    assert choose_frames(uneven, 2, 0.1, 0.3) == [1, 3]
    with pytest.raises(RangeError, match=r"0 s to 1 s"):
        choose_frames(uneven, 2, 0.4, 0.9)
    with pytest.raises(ValueError, match="numbers"):
        choose_frames(uneven, 2, float("nan"), None)


@pytest.mark.parametrize(("count", "columns"), [(1, 1), (2, 2), (4, 2), (12, 4), (16, 4), (20, 5)])
def test_sheets_have_no_gaps_where_they_can(count: int, columns: int) -> None:
    assert choose_columns(count, (324, 270)) == columns


@pytest.mark.usefixtures("opengl")
def test_the_sheet_holds_these_frames(uneven: Scene) -> None:
    size = (80, 60)
    seen: list[tuple[int, int]] = []
    sheet = film_sheet(uneven, 4, tile=size, camera="front", progress=lambda *at: seen.append(at))
    assert seen == [(1, 3), (2, 3), (3, 3)]  # at 0.67 and 1 s the last frame is the nearest
    wide = (sheet.shape[1] - 4) // 84
    step = (84, (sheet.shape[0] - 4) // -(-3 // wide))
    with Offscreen(uneven, size, "front", samples=4) as view:
        for number, frame in enumerate((0, 3, 4)):
            x, y = 4 + number % wide * step[0], 4 + number // wide * step[1]
            wanted = view.frame(float(uneven.timeline.time_of(frame)))[..., :3]
            np.testing.assert_array_equal(sheet[y : y + 60, x : x + 80], wanted)
            assert sheet[y + 60 : y + step[1] - 4, x : x + 80].max() > 120  # its time below it


def test_impossible_sheets_are_refused(uneven: Scene, tmp_path: Path) -> None:
    for count, tile, text in (
        (0, None, "at least one"),
        (2, (8, 8), "16x16"),
        (5, (16384, 16383), "too large"),
    ):
        with pytest.raises(ValueError, match=text):
            film_sheet(uneven, count, tile=tile)
