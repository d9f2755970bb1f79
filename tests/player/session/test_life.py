"""Signs of life: what they add, and that nothing that is saved has them; groups of parameters that move."""

from typing import Any

import numpy as np
import pytest

from fba.animation import Animation
from fba.parameters import bap_numbers
from fba_player.scene.scene import Scene
from fba_player.session._group_activity import activity_picture, read_activity
from fba_player.session._life import BLINK_EVERY, CLOSING, FIRST_BLINK, GLANCE, OPENING, Life, blink, glance
from fba_player.session._session import Session
from player_tracks import body_track, face_track
from set_clock import Clock

SECONDS = np.arange(0, 60, 0.01)


def still(faps: list[dict[int, int]], body: bool = False) -> Animation:
    track = body_track([{}] * len(faps)) if body else None
    return Animation(25, np.arange(len(faps)), face_track(faps), track)  # type: ignore[arg-type]


def shown(life: Life, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    faps, baps = np.zeros(68, np.float32), np.zeros(296)
    life(seconds, faps, baps)
    return faps, baps


def test_eyes_close_wholly_every_few_seconds_for_a_moment() -> None:
    closed = np.array([blink(float(second)) for second in SECONDS])
    assert closed.min() == 0
    assert closed.max() > 0.9
    begins = SECONDS[1:][(closed[1:] > 0) & (closed[:-1] == 0)]
    assert begins[0] == pytest.approx(FIRST_BLINK, abs=0.02)
    assert len(begins) == pytest.approx(60 / BLINK_EVERY, abs=2)
    assert np.diff(begins).min() > 1.5
    assert (closed > 0).mean() == pytest.approx((CLOSING + OPENING) / BLINK_EVERY, rel=0.2)
    life = Life(still([{}]))
    faps, _ = shown(life, FIRST_BLINK + CLOSING)
    assert faps[18] + faps[20] == pytest.approx(1024, rel=0.01)  # the lids meet
    assert faps[19] + faps[21] == pytest.approx(1024, rel=0.01)


def test_glances_go_back_to_the_viewer() -> None:
    turns = np.array([glance(float(second)) for second in SECONDS])
    assert np.abs(turns[:, 0]).max() <= GLANCE[0]
    assert np.abs(turns[:, 0]).max() > GLANCE[0] / 3
    assert (turns == 0).all(axis=1).mean() > 0.4
    faps, _ = shown(Life(still([{}])), 2.5)
    assert faps[22] == faps[23] != 0  # both eyes turn together
    assert faps[24] == faps[25] != 0


def test_the_same_time_always_looks_the_same() -> None:
    one, other = Life(still([{}])), Life(still([{}]))
    for seconds in (0.0, 0.75, 3.0, 100.0):
        np.testing.assert_array_equal(shown(one, seconds)[0], shown(other, seconds)[0])


def test_what_the_animation_moves_is_left_alone() -> None:
    life = Life(still([{19: 0, 23: 0, 48: 0}, {19: 500, 23: 3000, 48: 900}], body=True))
    for seconds in (0.78, 2.5):
        faps, baps = shown(life, seconds)
        assert not faps.any()
        assert baps[bap_numbers()["l_acromioclavicular_abduct"] - 1] > 0  # it breathes
    lids = Life(still([{19: 100, 20: 100}, {19: 100, 20: 100}]))  # sent, but the same in all frames
    assert shown(lids, FIRST_BLINK + CLOSING)[0][18] > 800


def test_a_head_alone_has_no_body_to_breathe_with() -> None:
    assert not shown(Life(still([{}])), 2.0)[1].any()


def test_pictures_films_and_pauses_have_no_life() -> None:
    clock = Clock()
    scene = Scene(still([{3: 0}, {3: 0}]))
    session = Session(scene, clock=clock)
    session.life = Life(scene.animation)
    clock.now += FIRST_BLINK + CLOSING
    seen: list[np.ndarray] = []
    make = scene.view_for

    def view_for(faps: np.ndarray, baps: np.ndarray, *rest: Any) -> object:
        seen.append(faps)
        return make(faps, baps, *rest)

    scene.view_for = view_for  # type: ignore[method-assign, assignment]
    session.view(0.0)
    assert not seen  # paused
    session.transport.play()
    session.view(0.0)
    assert seen.pop()[18] > 800
    assert not session.values[0].any()  # a take records these
    session.view(0.0, captured=True)
    session.recording = 0.0
    session.view(0.0)
    assert not seen


RED = (1.0, 0.0, 0.0)


def test_groups_that_move_and_when() -> None:
    faces = [{3: 0, 48: 0}] * 10 + [{3: 600, 48: 0}] * 10
    bodies = [{32: 0}] * 15 + [{32: 78540}] * 5  # an arm
    animation = Animation(25, np.arange(20), face_track(faces), body_track(bodies))  # type: ignore[arg-type]
    activity = read_activity(animation, None)
    assert activity.names == ("mouth", "arms")
    assert np.flatnonzero(activity.amounts[:, 0]).tolist() == [10]
    assert np.flatnonzero(activity.amounts[:, 1]).tolist() == [15]
    assert activity.amounts.max(axis=0).tolist() == [255, 255]  # more than 5 strong motions in a second
    assert (activity.moving(0.4, 0.04), activity.moving(0.44, 0.04)) == (["mouth"], [])
    picture = activity_picture(activity, RED, 0.0, 0.8, (20, 6))
    assert picture.shape == (6, 20, 4)
    assert np.flatnonzero(picture[0, :, 3]).tolist() == [10]
    assert np.flatnonzero(picture[5, :, 3]).tolist() == [15]


def test_slow_motion_is_fainter_and_trembling_has_no_row() -> None:
    def amounts(step: int) -> tuple[str, ...]:
        animation = Animation(25, np.arange(50), face_track([{3: step * t} for t in range(50)]))  # type: ignore[arg-type]
        activity = read_activity(animation, None)
        return () if activity is None else activity.names

    assert amounts(1) == ()
    assert amounts(20) == ("mouth",)


def test_a_still_figure_has_no_groups() -> None:
    still = Animation(25, np.arange(3), face_track([{3: 100}] * 3))  # type: ignore[arg-type]
    assert read_activity(still, None) is None
