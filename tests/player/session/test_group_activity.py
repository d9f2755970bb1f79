"""Which groups of parameters move when, and how that is drawn: values set by hand."""

import numpy as np

from fba.animation import Animation
from fba_player.session._group_activity import activity_picture, read_activity
from player_tracks import body_track, face_track

RED = (1.0, 0.0, 0.0)


def test_groups_that_move_and_when() -> None:
    faces = [{3: 0, 48: 0}] * 10 + [{3: 600, 48: 0}] * 10
    bodies = [{32: 0}] * 15 + [{32: 78540}] * 5  # an arm
    animation = Animation(25, np.arange(20), face_track(faces), body_track(bodies))  # type: ignore[arg-type]
    activity = read_activity(animation, None)
    assert activity is not None
    assert activity.names == ("mouth", "arms")
    assert np.flatnonzero(activity.amounts[:, 0]).tolist() == [10]
    assert np.flatnonzero(activity.amounts[:, 1]).tolist() == [15]
    assert activity.amounts.max(axis=0).tolist() == [255, 255]  # more than 5 strong motions in a second
    assert activity.moving(0.4, 0.04) == ["mouth"]
    assert activity.moving(0.44, 0.04) == []
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
