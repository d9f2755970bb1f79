"""The lane of expressions that are felt: where they begin and end on the timeline, and what is left out."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from fba.animation import Animation
from fba.emotion import Mood, emote
from fba.emotion.recogniser import labels
from fba.tracks import BodyTrack, FaceTrack
from fba_player.scene.scene import Scene
from fba_player.session import _timeline_trace as timeline_trace
from fba_player.session._source import Source
from fba_player.session._timeline_trace import lane_of_stretches, read_stretches


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
    assert lane is not None
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
    assert source.activity is not None
    assert "brows" in source.activity.names


def test_every_label_has_a_colour() -> None:
    import graphics

    graphics.imported("imgui_bundle")
    from fba_player._ui import theme

    assert set(theme.HUES) == set(labels()) - {"neutral", "unknown"}
