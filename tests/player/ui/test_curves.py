"""Curves: values over all frames, as many points as pixels, and the range of time that is shown."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fba.animation import Animation, FaceTrack
from fba.parameters import faps
from fba_player._ui.panels._curve_data import (
    MIN_SHOWN_SECONDS,
    RESOLVED_AT_ONCE,
    Courses,
    TimeZoom,
    amount,
    envelope,
)
from fba_player._ui.panels._curves_panel import search_parameters
from fba_player.playback._timeline import Timeline
from player_tracks import body_track, face_track


def complete(courses: Courses) -> Courses:
    while courses.advance():
        pass
    return courses


def test_values_are_those_shown_and_sent_says_who_said_so() -> None:
    face = face_track([{3: 100, 31: 40}, {}, {3: 300}, {}])
    body = body_track([{}, {32: 5000}, {}, {32: 7000}])
    courses = complete(Courses(Timeline(Animation(25, np.array([0, 1, 3, 4]), face, body))))  # type: ignore[arg-type]
    jaw = courses.course("fap", 3)
    assert jaw.times.tolist() == [0.0, 0.04, 0.12, 0.16]
    assert jaw.values.tolist() == [100, 100, 300, 300]
    assert jaw.sent.tolist() == [True, False, True, False]
    mate = courses.course("fap", 32)  # never sent: it copies the left one
    assert mate.values.tolist() == [40, 40, 40, 40]
    assert not mate.sent.any()
    arm = courses.course("bap", 32)
    assert arm.values.tolist() == [0, 5000, 5000, 7000]
    assert arm.sent.tolist() == [False, True, False, True]
    assert courses.course("fap", 3) is jaw


def long_face(frames: int) -> Animation:
    """open_jaw counts the frames up to 1000, again and again."""
    values, mask = np.zeros((frames, 68), np.int32), np.zeros((frames, 68), bool)
    values[:, 2], mask[:, 2] = np.arange(frames) % 1001, True
    return Animation(25, np.arange(frames), FaceTrack(values, mask))  # type: ignore[arg-type]


def test_an_hour_is_worked_out_piece_by_piece() -> None:
    courses = Courses(Timeline(long_face(3 * RESOLVED_AT_ONCE + 5)))
    assert courses.advance()
    assert 0.3 < courses.resolved_share < 0.34
    assert len(courses.course("fap", 3).values) == RESOLVED_AT_ONCE
    complete(courses)
    assert courses.resolved_share == 1.0
    course = courses.course("fap", 3)
    np.testing.assert_array_equal(course.values, np.arange(3 * RESOLVED_AT_ONCE + 5) % 1001)


def test_courses_grow_as_frames_arrive() -> None:
    whole = long_face(100)
    timeline = Timeline(whole[:40])
    courses = complete(Courses(timeline, later=2.0))
    assert len(courses.course("fap", 3).values) == 40
    timeline.animation = whole
    complete(courses)
    course = courses.course("fap", 3)
    assert course.values.tolist() == list(range(100))
    assert course.times[-1] == pytest.approx(99 / 25 + 2.0)


def test_parameters_that_move_most_come_first_and_one_of_mates() -> None:
    face = face_track([{3: 0, 31: 0, 32: 0, 49: 0}, {3: 400, 31: 240, 32: 240, 49: 4500}])
    body = body_track([{32: 0, 181: 0}, {32: 157080, 181: 30}])  # 90 degrees, and 3 cm
    courses = complete(Courses(Timeline(Animation(25, np.arange(2), face, body))))  # type: ignore[arg-type]
    assert courses.movers(9) == [("bap", 32), ("fap", 31), ("fap", 3), ("bap", 181), ("fap", 49)]
    assert courses.movers(2) == [("bap", 32), ("fap", 31)]


def test_amounts_are_written_for_people() -> None:
    assert amount("fap", 3, 412.4) == ("412", "MNS")
    assert amount("fap", 49, 17453.3) == ("10.0", "deg")
    assert amount("bap", 32, -157079.6) == ("-90.0", "deg")
    assert amount("bap", 181, 30.0) == ("30", "mm")


def test_of_few_frames_each_is_a_point() -> None:
    times = np.arange(10) / 10
    drawn = envelope(times, times * 2, times > 0.35, 0.2, 0.6, 100)
    assert drawn.x == pytest.approx([-0.25, 0.0, 0.25, 0.5, 0.75, 1.0, 1.25])
    assert drawn.values == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4])
    assert drawn.runs() == [(3, 7)]


@given(st.integers(300, 2000), st.integers(1, 60), st.data())
def test_many_frames_keep_their_extremes(frames: int, columns: int, data: st.DataObject) -> None:
    values = np.random.default_rng(frames).normal(size=frames)
    spike = data.draw(st.integers(0, frames - 1))
    values[spike] = 99.0
    sent = np.arange(frames) == spike
    drawn = envelope(np.arange(frames) / 25, values, sent, 0.0, (frames - 1) / 25, columns)
    assert len(drawn.x) <= 2 * columns
    assert (drawn.values.min(), drawn.values.max()) == (values.min(), 99.0)  # nothing is lost
    assert (np.diff(drawn.x) >= 0).all()
    assert 0 <= drawn.x[0] <= drawn.x[-1] <= 1
    at = drawn.x[drawn.values.argmax()]
    assert abs(at - spike / (frames - 1)) <= 1 / columns + 1e-9  # within its column
    assert drawn.sent[drawn.values.argmax()]


def test_nothing_to_draw() -> None:
    none = np.zeros(0)
    assert not len(envelope(none, none, none > 0, 0, 1, 100).x)
    one = np.zeros(1)
    assert not len(envelope(one, one, one == 0, 0, 0, 100).x)


def test_zooming_keeps_the_time_under_the_mouse() -> None:
    time_zoom = TimeZoom()
    time_zoom.bound(10.0, 110.0)
    assert time_zoom.shows_all
    time_zoom.zoom(0.5, 35.0)
    assert (time_zoom.low, time_zoom.high) == (22.5, 72.5)  # 35 is a quarter from the left, as before
    time_zoom.pan(1000.0)
    assert (time_zoom.low, time_zoom.high) == (60.0, 110.0)
    time_zoom.follow(20.0)
    assert (time_zoom.low, time_zoom.high) == (15.0, 65.0)
    time_zoom.zoom(1e-9, 30.0)
    assert time_zoom.high - time_zoom.low == pytest.approx(MIN_SHOWN_SECONDS)
    time_zoom.zoom(1e9, 30.0)
    assert time_zoom.shows_all


def test_the_full_range_stays_full_while_a_stream_arrives() -> None:
    time_zoom = TimeZoom()
    time_zoom.bound(0.0, 10.0)
    time_zoom.bound(0.0, 12.0)
    assert (time_zoom.low, time_zoom.high) == (0.0, 12.0)
    time_zoom.zoom(0.25, 0.0)
    time_zoom.bound(0.0, 20.0)
    assert (time_zoom.low, time_zoom.high) == (0.0, 3.0)


@pytest.mark.parametrize(
    ("query", "check"),
    [
        ("open_jaw", lambda rows: rows == [("fap", 3)]),
        ("open jaw", lambda rows: rows == [("fap", 3)]),
        ("48", lambda rows: rows == [("fap", 48), ("bap", 48)]),
        ("bap 48", lambda rows: rows == [("bap", 48)]),
        ("tongue", lambda rows: [n for _, n in rows] == [f.number for f in faps() if f.group == 6]),
        ("L Knee", lambda rows: rows == [("bap", 10), ("bap", 12)]),
        ("no such thing", lambda rows: rows == []),
    ],
)
def test_searching(query: str, check: Callable[[list[tuple[str, int]]], bool]) -> None:
    assert check([(kind, number) for kind, number, _ in search_parameters(query, face=True, body=True)])


def test_only_parameters_of_the_scene_are_listed() -> None:
    assert {kind for kind, _, _ in search_parameters("", face=True, body=False)} == {"fap"}
    assert {kind for kind, _, _ in search_parameters("", face=False, body=True)} == {"bap"}
