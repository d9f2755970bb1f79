"""Transport: the clock is wall time x speed; a fake clock stands in for the wall."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from player_tracks import face_track

from fba.animation import Animation
from player.timeline import Timeline
from player.transport import Transport, clock_text


class Clock:
    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


def transport(index: list[int] | None = None, rate: int = 10, loop: bool = True) -> tuple[Transport, Clock]:
    at = list(range(20)) if index is None else index
    animation = Animation(Fraction(rate), np.array(at), face=face_track([{3: 1} for _ in at]))
    clock = Clock()
    return Transport(Timeline(animation), loop=loop, clock=clock), clock


def test_it_starts_paused_at_the_first_frame() -> None:
    player, clock = transport([30, 31, 40])
    clock.now += 5
    assert (player.time, player.frame, player.playing) == (3.0, 0, False)


def test_playing_follows_the_clock_however_often_it_is_asked() -> None:
    player, clock = transport()
    player.play()
    clock.now += 0.73
    assert player.time == pytest.approx(0.73)
    assert player.frame == 7
    for _ in range(100):
        clock.now += 0.001
        assert player.time <= 0.84
    assert player.time == pytest.approx(0.83)


@pytest.mark.parametrize("speed", [0.1, 0.5, 4.0])
def test_speed_scales_the_clock_without_a_jump(speed: float) -> None:
    player, clock = transport()
    player.play()
    clock.now += 0.2
    player.set_speed(speed)
    assert player.time == pytest.approx(0.2)
    clock.now += 0.3
    assert player.time == pytest.approx(0.2 + 0.3 * speed)


def test_speeds_step_and_stop_at_their_ends() -> None:
    player, _ = transport()
    seen = [player.speed]
    for _ in range(8):
        player.faster()
        seen.append(player.speed)
    assert seen == [1.0, 1.25, 1.5, 2.0, 3.0, 4.0, 4.0, 4.0, 4.0]
    for _ in range(20):
        player.slower()
    assert player.speed == 0.1
    for wrong in (0.0, -1.0, 5.0, float("nan")):
        with pytest.raises(ValueError, match="speed"):
            player.set_speed(wrong)


def test_pause_stays_where_it_was() -> None:
    player, clock = transport()
    player.play()
    clock.now += 0.55
    player.pause()
    clock.now += 7
    assert player.time == pytest.approx(0.55)
    player.toggle()
    clock.now += 0.1
    assert player.time == pytest.approx(0.65)


def test_loop_comes_round_and_keeps_the_remainder() -> None:
    player, clock = transport()  # two seconds
    player.play()
    clock.now += 4.6
    assert player.time == pytest.approx(0.6)
    assert player.playing


def test_without_loop_it_stops_on_the_last_frame_and_starts_again_from_there() -> None:
    player, clock = transport(loop=False)
    player.play()
    clock.now += 10
    assert player.time == pytest.approx(1.9)
    assert (player.playing, player.frame, player.share) == (False, 19, 1.0)
    player.play()
    assert player.time == pytest.approx(0.0)


def test_steps_go_to_the_frames_own_times_over_gaps() -> None:
    player, clock = transport([0, 1, 7, 8])
    player.play()
    clock.now += 0.25  # between frames 1 and 2
    player.step(1)
    assert (player.time, player.playing) == (pytest.approx(0.7), False)
    player.step(-1)
    assert player.time == pytest.approx(0.1)
    player.seek(0.45)
    player.step(-1)
    assert player.time == pytest.approx(0.1)
    player.step(-5)
    assert player.time == 0.0
    player.step(99)
    assert player.time == pytest.approx(0.8)


def test_seeking_stays_inside_and_goes_on_playing() -> None:
    player, clock = transport()
    player.play()
    player.seek(1.5)
    clock.now += 0.1
    assert player.time == pytest.approx(1.6)
    player.seek(-3)
    assert player.time == pytest.approx(0.0)
    player.pause()
    player.seek(99)
    assert player.time == pytest.approx(2.0)
    player.seek_share(0.5)
    assert player.time == pytest.approx(0.95)
    player.seek_share(7)
    assert player.frame == 19
    with pytest.raises(ValueError, match="seek"):
        player.seek(float("nan"))


def test_first_and_last() -> None:
    player, _ = transport()
    player.last()
    assert (player.frame, player.share) == (19, 1.0)
    player.first()
    assert (player.frame, player.share) == (0, 0.0)


def test_one_frame_alone() -> None:
    player, clock = transport([5])
    player.play()
    clock.now += 3.33
    assert player.frame == 0
    assert player.share == 0.0


def test_text() -> None:
    player, _ = transport()
    player.seek(1.24)
    assert player.text() == "0:01.240 / 0:02.000   frame 13 / 20   1x   loop"


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0, "0:00.000"),
        (7.04, "0:07.040"),
        (59.9996, "1:00.000"),
        (3723.5, "1:02:03.500"),
        (Fraction(1, 3), "0:00.333"),
    ],
)
def test_clock_text(seconds: float, text: str) -> None:
    assert clock_text(seconds) == text
