"""Curves: values over all frames, as many points as pixels, and the range of time that is shown.

Bit rates of a stream.
"""

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fba.animation import Animation
from fba.codec import StreamInfo
from fba.face import FaceModel
from fba.parameters import bap_numbers, faps
from fba.tracks import FaceTrack
from fba_player._ui.panels._curve_data import (
    RESOLVED_AT_ONCE,
    Courses,
    amount,
    envelope,
)
from fba_player._ui.panels._curves_panel import search_parameters
from fba_player._ui.panels._rate_panel import bars_of_planes, measure_rates, probe_encoded
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


@pytest.mark.parametrize(
    ("query", "check"),
    [
        ("open_jaw", lambda rows: rows == [("fap", 3)]),
        ("open jaw", lambda rows: rows == [("fap", 3)]),
        ("48", lambda rows: rows == [("fap", 48), ("bap", 48)]),
        ("bap 48", lambda rows: rows == [("bap", 48)]),
        ("tongue", lambda rows: [n for _, n in rows] == [f.number for f in faps() if f.group == 6]),
        ("L Knee", lambda rows: rows[:-1] == [("bap", 10), ("bap", 12)] and rows[-1][0] == "joint"),
        ("no such thing", lambda rows: rows == []),
    ],
)
def test_searching(query: str, check: Callable[[list[tuple[str, int]]], bool]) -> None:
    assert check([(kind, number) for kind, number, _ in search_parameters(query, face=True, body=True)])


def test_only_parameters_of_the_scene_are_listed() -> None:
    assert {kind for kind, _, _ in search_parameters("", face=True, body=False)} == {
        "fap", "viseme", "expression", "measure"
    }  # fmt: skip
    body = search_parameters("", face=False, body=True)
    assert {kind for kind, _, _ in body} == {"bap", "measure", "joint"}
    assert [text for kind, _, text in body if kind == "measure"] == ["speed over the ground"]


def test_visemes_and_expressions_are_found_and_drawn() -> None:
    found = search_parameters("viseme", face=True, body=False)
    assert len(found) == 14
    assert ("viseme", 10, "viseme A:") in found
    assert search_parameters("viseme", face=False, body=True) == ()
    assert [row[2] for row in search_parameters("expression joy", face=True, body=True)] == ["expression joy"]
    mask = np.zeros((3, 68), dtype=bool)
    viseme = np.zeros((3, 4), dtype=np.int16)
    mask[[0, 2], 0], viseme[0, :3], viseme[2, :3] = True, (10, 1, 21), (1, 10, 63)
    face = FaceTrack(np.zeros((3, 68), dtype=np.int32), mask, viseme)
    courses = complete(Courses(Timeline(Animation(25, np.arange(3), face))))  # type: ignore[arg-type]
    course = courses.course("viseme", 10)
    assert course.values.tolist() == pytest.approx([100 / 3, 100 / 3, 0])
    assert course.sent.tolist() == [True, False, True]
    assert amount("viseme", 10, 33.4) == ("33", "%")


def test_the_opening_of_mouth_and_eyes() -> None:
    fapu = FaceModel.default().fapu
    face = face_track([{4: 0, 5: 0, 19: 0, 21: 0}, {4: -100, 5: -200, 19: 1024, 21: 0}])
    courses = complete(Courses(Timeline(Animation(25, np.arange(2), face))))  # type: ignore[arg-type]
    mouth = courses.course("measure", 1)
    assert mouth.values.tolist() == pytest.approx([0.0, 300 * fapu.MNS * 1000])
    assert amount("measure", 1, 12.34) == ("12.3", "mm")
    assert courses.course("measure", 3).values.tolist() == pytest.approx([100.0, 0.0])  # the left eye


def test_the_angle_of_a_joint_and_the_speed() -> None:
    quarter = round(np.pi / 2 * 1e5)
    numbers = bap_numbers()
    side, forward = numbers["HumanoidRoot_tr_lateral"], numbers["HumanoidRoot_tr_frontal"]
    flexion, twist = numbers["l_shoulder_flexion"], numbers["l_shoulder_twisting"]
    rows = [
        {flexion: quarter * (t > 0), twist: quarter * (t > 1), side: 40 * t, forward: 30 * t}
        for t in range(3)
    ]
    courses = complete(Courses(Timeline(Animation(25, np.arange(3), None, body_track(rows)))))  # type: ignore[arg-type]
    joint = next(
        row for row in search_parameters("angle l shoulder", face=True, body=True) if row[0] == "joint"
    )
    assert joint[2] == "angle of l_shoulder"
    # two quarter turns about axes at right angles are a third of a turn about their diagonal
    assert courses.course("joint", joint[1]).values.tolist() == pytest.approx([0, 90, 120], abs=0.01)
    speed = search_parameters("speed", face=True, body=True)[0]
    assert courses.course("measure", speed[1]).values.tolist() == pytest.approx([1.25] * 3)  # 50 mm in 1/25 s


def info(bits: list[int], intra: list[int], index: list[int] | None = None, size: int = 0) -> StreamInfo:
    count = len(bits)
    return StreamInfo(
        format="fba", size=size, rate=Fraction(4), frames=count, duration=Fraction(count, 4),
        start=Fraction(2), skipped=0, face=None, body=None,
        plane_bits=np.array(bits), plane_intra=np.isin(np.arange(count), intra),
        frame_index=np.array(index if index is not None else range(count)),
    )  # fmt: skip


def test_the_rate_is_that_of_the_last_second() -> None:
    found = measure_rates(info([1000, 100, 200, 300, 400, 2000, 10], [0, 5], size=510))
    assert found.times.tolist() == [2.0, 2.25, 2.5, 2.75, 3.0, 3.25, 3.5]
    assert found.rate == pytest.approx([1.6, 1.0, 2.9, 2.71])  # four planes a second, in kbit/s
    assert [(one.name, one.planes, one.bits) for one in found.totals] == [
        ("I planes", 2, 3000), ("P planes", 5, 1010), ("around them", None, 70),
    ]  # fmt: skip
    assert sum(one.share for one in found.totals) == pytest.approx(1.0)


def test_frames_that_were_skipped_take_time_and_no_bits() -> None:
    found = measure_rates(info([1000, 100, 200], [0], index=[0, 8, 9]))
    assert found.rate[-2:] == pytest.approx([0.1, 0.3])


def test_rates_of_one_plane_and_of_no_plane() -> None:
    found = measure_rates(info([1000], [0]))
    assert found.rate.tolist() == [1.0]
    assert measure_rates(info([], [])) is None


def test_bars_show_the_largest_and_whether_there_is_an_intra_plane() -> None:
    times, bits = np.arange(10) / 10, np.array([9, 1, 2, 3, 8, 1, 1, 1, 1, 5.0])
    tall, intra = bars_of_planes(times, bits, np.isin(np.arange(10), [0, 5]), 0.0, 1.0, 5)
    assert tall.tolist() == [9, 3, 8, 1, 5]
    assert intra.tolist() == [True, False, True, False, False]
    tall, _ = bars_of_planes(times, bits, bits > 8, 0.4, 0.6, 4)
    assert tall.max() == 8
    assert bars_of_planes(times, bits, bits > 8, 1.0, 1.0, 3)[0].tolist() == [0, 0, 0]


def test_what_a_performance_would_be_as_a_stream(talking: Animation) -> None:
    found = probe_encoded(talking)
    assert found.plane_intra.tolist() == [True] + [False] * 9
    assert found.frames == 10


def test_long_animations_are_not_encoded_to_be_measured(
    talking: Animation, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fba_player._ui.panels._rate_panel.MAX_VALUES", 29)  # it has thirty
    assert probe_encoded(talking) is None
