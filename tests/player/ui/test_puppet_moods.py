"""The puppeteer's moods: the plane, the sliders, and that a path over the plane becomes a take."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import graphics
from fba.animation import Animation
from fba.emotion import combine, expression, known_points, modify
from fba.errors import OptionError
from fba.tracks import FaceTrack
from fba_player.playback._transport import Transport
from fba_player.scene.scene import Scene
from fba_player.session._puppet import COMMON, Puppet, PuppetMood
from fba_player.session._session import Session
from set_clock import Clock
from studio_hand import StudioHand, panel_of

graphics.imported("imgui_bundle")

from fba_player._ui.panels._puppet_emotion import EMOTION_RADIUS, EMOTION_TEXT, place_labels  # noqa: E402 - needs imgui
from tools.window_picture import Studio  # noqa: E402 - needs imgui

BROW = 30


class TestMood:
    def test_sliders_and_the_point_mix(self) -> None:
        mood = PuppetMood()
        assert list(mood.weights) == list(COMMON)
        assert not mood.active
        mood.set_weight("angry", 50)
        np.testing.assert_array_equal(mood.blend.faps, combine({"anger": 50}).faps)
        mood.move_point(*known_points()["joy"])
        assert {one.name: round(share) for one, share in mood.blend.parts} == {"anger": 50, "joy": 100}
        mood.set_weight("terror", 20)
        assert list(mood.weights) == [*COMMON, "terror"]
        mood.release()
        assert not mood.active
        assert (mood.point, mood.weights["terror"]) == (None, 0)

    def test_values_out_of_range_are_limited(self) -> None:
        mood = PuppetMood()
        mood.move_point(99, -99)
        assert mood.point == (7, 1)
        mood.set_weight("joy", 400)
        assert mood.weights["joy"] == 100
        with pytest.raises(OptionError, match="did you mean"):
            mood.set_weight("joi", 1)

    def test_the_performance_is_added_as_emote_does(self) -> None:
        puppet = Puppet()
        puppet.mood.set_weight("surprise", 80)
        faps, baps = np.zeros(68, np.float32), np.zeros(296)
        faps[BROW] = 100
        expected = modify(faps[None].astype(float), combine({"surprise": 80}).faps[None].astype(float))[0]
        puppet(faps, baps)
        np.testing.assert_allclose(faps, expected, atol=1e-3)
        assert not puppet.idle
        puppet.move_fap(BROW + 1, 7)
        puppet(faps, baps)
        assert faps[BROW] == 7  # what is moved by hand stays so
        puppet.release_all()
        assert puppet.idle


@pytest.fixture
def studio(opengl: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, clock: Clock) -> Iterator[Studio]:
    monkeypatch.chdir(tmp_path)
    mask = np.ones((50, 68), dtype=bool)
    mask[:, :2] = False
    scene = Scene(Animation(25, np.arange(50), FaceTrack(np.zeros((50, 68), dtype=np.int32), mask)))
    session = Session(scene, Transport(scene.timeline, clock=clock), size=(900, 700), clock=clock)
    session.open.add("puppet")
    with Studio(session) as studio:
        studio.draw(6)
        StudioHand(studio).click(*panel_of(studio, "puppet").buttons["Mood"])
        studio.draw(2)
        yield studio


def place(studio: Studio, name: str) -> tuple[float, float]:
    """Where the plane shows a named emotion, in points."""
    left, top, right, bottom = panel_of(studio, "puppet").emotion.plane
    activation, evaluation = known_points()[name]
    return left + (evaluation - 1) / 6 * (right - left), bottom - (activation - 1) / 6 * (bottom - top)


def test_the_face_follows_a_point_that_is_dragged(studio: Studio) -> None:
    session, hand = studio.session, StudioHand(studio)
    hand.drag(place(studio, "anger"), place(studio, "surprise"))
    studio.draw(1)
    full = expression("surprise").faps[BROW]
    assert session.values[0][BROW] == pytest.approx(full, rel=0.1)
    mood = panel_of(studio, "puppet").performer(session).puppet.mood
    assert max(mood.blend.parts, key=lambda part: part[1])[0].name == "surprise"


def test_a_slider_gives_a_mood(studio: Studio) -> None:
    session, hand = studio.session, StudioHand(studio)
    left, right, y = panel_of(studio, "puppet").emotion.sliders["anger"]
    hand.drag((left + 3, y), ((left + right) / 2, y))
    studio.draw(1)
    assert session.values[0][BROW] == pytest.approx(expression("anger").faps[BROW] / 2, rel=0.1)


def test_a_path_over_the_plane_is_a_take(studio: Studio, clock: Clock) -> None:
    panel, session = panel_of(studio, "puppet"), studio.session
    performer = panel.performer(session)
    StudioHand(studio).click(*panel.buttons["record"])
    start, end = np.array((4.0, 4.0)), np.array(known_points()["surprise"])
    for step in range(11):
        performer.puppet.mood.move_point(*(start + (end - start) * step / 10))
        clock.now += 1 / 25
        studio.draw(1)
    performer.stop()
    take = performer.takes.last
    brow = take.face.values[:, BROW]
    assert brow[0] == 0
    assert brow[-1] == pytest.approx(expression("surprise").faps[BROW], rel=0.05)
    assert 0 < brow[5] < brow[-1]


def overlap(one: tuple[float, ...], other: tuple[float, ...]) -> float:
    wide = min(one[2], other[2]) - max(one[0], other[0])
    return max(wide, 0.0) * max(min(one[3], other[3]) - max(one[1], other[1]), 0.0)


@pytest.mark.parametrize("size", [(1280, 720), (900, 700), (1920, 1080)])
def test_the_whole_tab_is_seen_and_no_label_covers_another(studio: Studio, size: tuple[int, int]) -> None:
    studio.session.size = size
    panel_of(studio, "puppet").performer(studio.session).puppet.mood.move_point(5.0, 4.4)
    studio.draw(6)
    tab = panel_of(studio, "puppet").emotion
    assert tab.hidden == 0
    assert set(tab.sliders) == set(COMMON)
    labels = list(tab.labels.items())
    for number, (name, box) in enumerate(labels):
        assert box[3] - box[1] == pytest.approx(EMOTION_TEXT)
        assert tab.plane[0] - 10 <= box[0] < box[2] <= tab.plane[2] + 10, name
        for other in known_points():
            x, y = place(studio, other)
            assert not overlap(
                box, (x - EMOTION_RADIUS, y - EMOTION_RADIUS, x + EMOTION_RADIUS, y + EMOTION_RADIUS)
            ), (name, other)
        for other, area in labels[number + 1 :]:
            assert not overlap(box, area), (name, other)


def test_labels_of_dots_side_by_side() -> None:
    """Above and below where there is no room beside; inside the box, even where something must be covered."""
    dots = {name: (50.0 + 12 * number, 50.0) for number, name in enumerate("abcd")}
    within = (0.0, 0.0, 120.0, 100.0)
    boxes = place_labels(dots, dict.fromkeys(dots, (30.0, 12.0)), within)
    for name, box in boxes.items():
        assert overlap(box, within) == 30 * 12
        assert not any(overlap(box, other) for key, other in boxes.items() if key != name)
        assert not any(box[0] < x < box[2] and box[1] < y < box[3] for x, y in dots.values())
    crowded = place_labels(dict.fromkeys("ab", (5.0, 5.0)), dict.fromkeys("ab", (30.0, 12.0)), (0, 0, 40, 14))
    assert set(crowded) == {"a", "b"}
