"""What is said, felt and moved over time, and how it is drawn: values set by hand.

The lane of expressions that are felt: where they begin and end on the timeline, and what is left out.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from fba.animation import Animation
from fba.emotion import Mood, emote
from fba.emotion.recogniser import labels
from fba.parameters import VISEMES
from fba.speech import Phone, Speech, find_shapes, perform
from fba.tracks import BodyTrack, FaceTrack
from fba_player.playback._lanes import Lane, lane_of_expressions, lane_of_visemes, lane_picture
from fba_player.playback._time_zoom import MIN_SHOWN_SECONDS, TimeZoom
from fba_player.scene.scene import Scene
from fba_player.session import _timeline_trace as timeline_trace
from fba_player.session._source import Source
from fba_player.session._timeline_trace import lane_of_stretches, read_stretches
from player_tracks import body_track, face_track

RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def spoken() -> Animation:
    """Six frames at 10 a second from 1 s on: frames 0, 1, 3 and 4 send visemes, frame 2 an expression."""
    mask = np.zeros((6, 68), dtype=bool)
    viseme, expression = np.zeros((6, 4), dtype=np.int16), np.zeros((6, 6), dtype=np.int16)
    mask[[0, 1, 3, 4], 0] = True
    viseme[0, :3] = 10, 0, 63  # A: alone
    viseme[1, :3] = 10, 11, 21  # a third of it, two thirds of e
    viseme[3, :3] = 11, 11, 21  # e in both places
    mask[2, 1] = True
    expression[2, :4] = 1, 63, 3, 21  # joy, and a third of anger
    face = FaceTrack(np.zeros((6, 68), dtype=np.int32), mask, viseme, expression)
    return Animation(10, np.arange(10, 16), face)  # type: ignore[arg-type]


def test_visemes_last_from_halfway_to_the_frame_before_to_halfway_to_the_next() -> None:
    """The mouth moves evenly between frames; visemes are in force until the next are sent."""
    lane = lane_of_visemes(spoken())
    assert lane.at(1.04) == [("A:", 1.0)]
    for time in (1.06, 1.24):  # frame 2 sends none
        assert lane.at(time) == [("e", pytest.approx(2 / 3)), ("A:", pytest.approx(1 / 3))]
    assert lane.at(1.3) == [("e", 1.0)]
    assert lane.at(1.4) == []  # "none" was sent
    assert (lane.at(0.95), lane.text(1.1)) == ([], "e 67%, A: 33%")
    assert lane.named(0.0, 9.0, 0.01) == [
        (1.0, pytest.approx(1.25), "A:"),
        (pytest.approx(1.05), pytest.approx(1.35), "e"),
    ]
    assert lane.named(1.15, 9.0, 0.2) == [(1.15, pytest.approx(1.35), "e")]  # of the other, too little


def test_the_lane_of_speech_agrees_with_its_phones() -> None:
    """Sounds as long as the key frames are apart at least, so that none is left out."""
    names = ["SIL", "M", "AA", "S", "P", "IY", "F", "UW", "T", "OW", "B", "AE", "SIL"]
    ends = np.cumsum(np.random.default_rng(2).uniform(0.1, 0.2, len(names)))
    phones = [Phone(name, float(end - 0.1), float(end)) for name, end in zip(names, ends, strict=True)]
    phones = [replace(each, start=before.end) for before, each in pairwise([phones[0], *phones])]
    phones[0] = replace(phones[0], start=0.0)
    speech = Speech(tuple(phones), (), float(ends[-1]))
    lane = lane_of_visemes(perform(speech, coding="visemes", life=0, keep_goal=False))
    shown = [(start, name) for start, _, name in lane.named(0, 9, 0.01)]
    expected = [shape for shape in find_shapes(phones) if shape.viseme]
    assert [name for _, name in shown] == [VISEMES[shape.viseme] for shape in expected]
    late = np.array([start for start, _ in shown]) - [shape.start for shape in expected]
    assert abs(np.median(late)) <= 0.02
    assert np.abs(late).max() <= 0.06


def test_expressions_last_to_the_end_of_the_last_frame() -> None:
    lane = lane_of_expressions(spoken())
    assert (lane.at(1.19), lane.text(1.59)) == ([], "joy 63 of 63, anger 21 of 63")
    assert lane.at(1.61) == []


def test_a_stream_that_codes_neither_has_no_lanes() -> None:
    animation = Animation(25, np.arange(2), face_track([{3: 100}, {3: 200}]))  # type: ignore[arg-type]
    assert lane_of_visemes(animation) is None
    assert lane_of_expressions(animation) is None
    body = Animation(25, np.arange(2), None, body_track([{8: 1}, {8: 2}]))  # type: ignore[arg-type]
    assert lane_of_visemes(body) is None


def lane(rows: list[tuple[float, float, int, float]]) -> Lane:
    starts, ends, which, shares = (np.array(column) for column in zip(*rows, strict=True))
    return Lane("visemes", ("none", "a", "b"), starts, ends, which, shares.astype(np.float32))


def test_the_height_of_a_name_is_its_intensity() -> None:
    one = lane([(0.0, 4.0, 1, 1.0), (2.0, 4.0, 2, 0.5)])
    picture = lane_picture(one, [(0, 0, 0), RED, BLUE], 0.0, 8.0, (80, 10))
    assert picture.shape == (10, 80, 4)
    assert (picture[:, :40, 3] > 0).all()
    assert (picture[:, 40:, 3] == 0).all()
    assert (picture[:, :20, 0] == 255).all()
    assert (picture[:5, 20:40, 0] == 255).all()
    assert (picture[5:, 20:40, 2] == 255).all()  # the weaker stands in front, half as high


def test_a_part_is_drawn_as_in_the_whole() -> None:
    rng = np.random.default_rng(5)
    starts = np.sort(rng.uniform(0, 60, 3000))
    rows = [(start, start + 0.3, int(rng.integers(1, 3)), float(rng.random())) for start in starts.tolist()]
    colours = [(0.0, 0.0, 0.0), RED, BLUE]
    whole = lane_picture(lane(rows), colours, 0.0, 60.0, (600, 12))
    part = lane_picture(lane(rows), colours, 20.0, 30.0, (100, 12))
    np.testing.assert_array_equal(part[:, 1:-1], whole[:, 201:299])


def test_many_short_segments_show_their_largest() -> None:
    rows = [(k / 1000, (k + 1) / 1000, 1, 0.1) for k in range(10_000)]
    rows[5000] = (5.0, 5.001, 1, 1.0)
    picture = lane_picture(lane(rows), [(0, 0, 0), RED, BLUE], 0.0, 10.0, (20, 10))
    full = (picture[..., 3] > 0).sum(axis=0)
    assert full[10] == 10
    assert (np.delete(full, 10) <= 2).all()


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


def angry_for_a_while(first: int = 0) -> Animation:
    mask = np.ones((150, 68), dtype=bool)
    mask[:, :2] = False
    still = Animation(25, np.arange(first, first + 150), FaceTrack(np.zeros((150, 68), dtype=np.int32), mask))
    return emote(still, [Mood("anger", 90, start=2, end=4, ease=0.2)])


def test_stretches_follow_each_other() -> None:
    found = read_stretches(angry_for_a_while(first=50), None)
    assert [one.label for one in found] == ["neutral", "anger", "neutral"]
    assert found[0].start == 2.0  # frame 50
    assert found[-1].end == 8.0
    assert all(one.end == other.start for one, other in pairwise(found))
    anger = found[1]
    assert abs(anger.start - 4.0) < 0.6
    assert abs(anger.end - 6.0) < 0.6
    assert 60 < anger.intensity <= 100
    assert str(anger) == f"anger {anger.intensity:.0f}"
    lane = lane_of_stretches(found)
    assert lane.at(5.0) == [("anger", pytest.approx(anger.intensity / 100))]
    assert lane.at(8.5) == []
    assert lane_of_stretches(found[:1]) is None  # neutral


def test_no_expressions_without_a_face_and_for_long_animations(monkeypatch: object) -> None:
    body = BodyTrack(np.zeros((3, 296), dtype=np.int32), np.ones((3, 296), dtype=bool))
    assert read_stretches(Animation(25, np.arange(3), None, body), None) == ()
    face = angry_for_a_while()
    monkeypatch.setattr(timeline_trace, "MAX_READ_FRAMES", 100)  # type: ignore[attr-defined]
    assert read_stretches(face, None) == ()


def test_a_source_reads_them_in_the_background() -> None:
    source = Source(Scene(angry_for_a_while()))
    assert source.expressions == ()
    source.probe(wait=True)
    assert [one.label for one in source.expressions] == ["neutral", "anger", "neutral"]
    felt = source.lanes[-1]
    assert (felt.name, felt.labels, felt.estimated) == ("felt", ("anger",), True)
    assert felt.text(4.0 - 1.0) == str(source.expressions[1])
    assert "brows" in source.activity.names


def test_every_label_has_a_colour() -> None:
    import graphics

    graphics.imported("imgui_bundle")
    from fba_player._ui import theme

    assert set(theme.HUES) == set(labels()) - {"neutral", "unknown"}
