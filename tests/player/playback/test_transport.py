"""Transport: the clock is wall time x speed; a fake clock stands in for the wall."""

from fractions import Fraction

import numpy as np
import pytest

from fba.animation import Animation
from fba_player.playback._timeline import Timeline, clock_text, timecode
from fba_player.playback._transport import Transport
from player_tracks import face_track
from set_clock import Clock


def transport(
    index: list[int] | None = None, rate: int = 10, loop: bool = True, playing: bool = False
) -> tuple[Transport, Clock]:
    """A transport, of two seconds unless told otherwise, and its clock."""
    at = list(range(20)) if index is None else index
    animation = Animation(Fraction(rate), np.array(at), face=face_track([{3: 1} for _ in at]))
    clock = Clock(1000.0)
    player = Transport(Timeline(animation), loop=loop, clock=clock)
    if playing:
        player.play()
    return player, clock


def test_it_starts_paused_at_the_first_frame() -> None:
    player, clock = transport([30, 31, 40])
    clock.now += 5
    assert (player.time, player.frame, player.playing) == (3.0, 0, False)


def test_playing_follows_the_clock_however_often_it_is_asked() -> None:
    player, clock = transport(playing=True)
    clock.now += 0.73
    assert player.time == pytest.approx(0.73)
    assert player.frame == 7
    for _ in range(100):
        clock.now += 0.001
        assert player.time <= 0.84
    assert player.time == pytest.approx(0.83)


@pytest.mark.parametrize("speed", [0.1, 0.5, 4.0])
def test_speed_scales_the_clock_without_a_jump(speed: float) -> None:
    player, clock = transport(playing=True)
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
    player, clock = transport(playing=True)
    clock.now += 0.55
    player.pause()
    clock.now += 7
    assert player.time == pytest.approx(0.55)
    player.toggle()
    clock.now += 0.1
    assert player.time == pytest.approx(0.65)


def test_loop_comes_round_and_keeps_the_remainder() -> None:
    player, clock = transport(playing=True)
    clock.now += 4.6
    assert player.time == pytest.approx(0.6)
    assert player.playing


def test_without_loop_it_stops_on_the_last_frame_and_starts_again_from_there() -> None:
    player, clock = transport(loop=False, playing=True)
    clock.now += 10
    assert player.time == pytest.approx(1.9)
    assert (player.playing, player.frame, player.share) == (False, 19, 1.0)
    player.play()
    assert player.time == pytest.approx(0.0)


def test_steps_go_to_the_times_of_frames_over_gaps() -> None:
    player, clock = transport([0, 1, 7, 8], playing=True)
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
    player, clock = transport(playing=True)
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
    player, clock = transport([5], playing=True)  # one frame alone
    clock.now += 3.33
    assert (player.frame, player.share) == (0, 0.0)


def test_stop_stays_where_it_is() -> None:
    player, clock = transport(playing=True)
    clock.now += 0.3
    player.stop()
    clock.now += 9
    assert (player.time, player.playing) == (pytest.approx(0.3), False)


def test_a_loop_between_marks() -> None:
    player, clock = transport(playing=True)
    player.mark_in, player.mark_out = 0.5, 1.1
    clock.now += 1.0  # it begins before the mark
    assert player.time == pytest.approx(1.0)
    clock.now += 0.2
    assert player.time == pytest.approx(0.6)
    clock.now += 0.6 * 1000
    assert player.time == pytest.approx(0.6)
    player.clear_marks()
    clock.now += 1.2
    assert player.time == pytest.approx(1.8)
    assert (player.mark_in, player.mark_out) == (None, None)


def test_without_loop_it_stops_at_the_mark_and_begins_again_at_the_other() -> None:
    player, clock = transport(loop=False)
    player.mark_in, player.mark_out = 0.5, 1.1
    player.seek(0.7)
    player.play()
    clock.now += 5
    assert (player.time, player.playing) == (pytest.approx(1.1), False)
    player.play()
    assert player.time == pytest.approx(0.5)


def test_beyond_the_mark_it_plays_to_the_end_and_then_from_mark_to_mark() -> None:
    player, clock = transport()  # two seconds
    player.mark_in, player.mark_out = 0.5, 1.0
    player.seek(1.5)
    player.play()
    clock.now += 0.4
    assert player.time == pytest.approx(1.9)
    clock.now += 0.3  # 0.2 beyond the end
    assert player.time == pytest.approx(0.7)
    clock.now += 0.4
    assert player.time == pytest.approx(0.6)


@pytest.mark.parametrize(("before", "after"), [(0, 0.27), (0.09, 0.27), (0.11, 0.82)])
def test_a_mark_set_a_tenth_of_a_second_late_turns_back_at_once(before: float, after: float) -> None:
    """A click lies a little before where the player is by then; what lies further back is passed already."""
    player, clock = transport(playing=True)
    player.mark_in = 0.25
    clock.now += 0.8
    player.mark_out = player.time - before
    clock.now += 0.02
    assert player.time == pytest.approx(after)


@pytest.mark.parametrize(("off", "frame"), [(5e-7, 3), (2e-6, 2)])
def test_a_time_a_millionth_of_a_frame_early_is_that_frames(off: float, frame: int) -> None:
    timeline = transport()[0]._timeline
    assert timeline.position((3 - off) / 10)[0] == frame


def test_marks_stay_in_order_and_inside() -> None:
    player, _ = transport()
    player.mark_in = 1.0
    player.mark_out = 0.4
    assert (player.mark_in, player.mark_out) == (None, 0.4)
    player.mark_in = 0.4
    assert (player.mark_in, player.mark_out) == (0.4, None)
    player.mark_in, player.mark_out = -5.0, 99.0
    assert (player.mark_in, player.mark_out) == (0.0, 2.0)
    player.mark_out = None
    assert player.mark_out is None
    with pytest.raises(ValueError, match="mark"):
        player.mark_in = float("nan")


def test_a_slow_machine_drops_frames_and_keeps_the_time() -> None:
    player, clock = transport(list(range(1000)), rate=100)
    player.play()
    shown = []
    for cost in [0.3, 0.001, 1.2, 0.017, 0.05] * 4:  # what drawing takes, seconds
        shown.append(player.frame)
        clock.now += cost
    elapsed = np.cumsum([0, *([30, 0.1, 120, 1.7, 5] * 4)])[:20]  # the same in frames of 10 ms
    assert shown == [int(frame + 1e-6) for frame in elapsed]
    assert player.time == pytest.approx(4 * 1.568)


def test_another_clock_goes_on_from_the_same_place() -> None:
    player, clock = transport(playing=True)
    clock.now += 0.5
    other = Clock(1000.0)
    other.now = -3.0
    player.use_clock(other)
    clock.now += 1.0
    assert player.time == pytest.approx(0.5)
    other.now += 0.25
    assert player.time == pytest.approx(0.75)


def test_the_motion_tells_the_time_to_come() -> None:
    player, clock = transport()
    player.mark_out = 1.5
    player.set_speed(2.0)
    player.play()
    motion = player.motion
    assert [motion.time(clock.now + ahead) for ahead in (0.0, 0.5, 0.8)] == pytest.approx([0.0, 1.0, 0.1])
    assert (motion.over(clock.now + 0.7), motion.over(clock.now + 0.8)) == (False, True)


def test_without_interpolation_the_frame_last_passed_is_held() -> None:
    animation = Animation(Fraction(10), np.array([0, 4, 5]), face=face_track([{3: 0}, {3: 100}, {3: 200}]))
    timeline = Timeline(animation)
    player = Transport(timeline)
    assert player.interpolate
    assert timeline.faps(0.2)[2] == pytest.approx(50)
    player.interpolate = False
    assert [timeline.faps(time)[2] for time in (0.0, 0.2, 0.39, 0.4, 0.49, 0.5)] == [0, 0, 0, 100, 100, 200]
    player.seek(0.45)
    player.step(-1)  # to the frame whose time has been passed, as with interpolation
    assert player.time == pytest.approx(0.4)


def test_timecode_is_that_of_the_stream() -> None:
    player, _ = transport([25 * 3661 + 24, 25 * 3662], rate=25)  # 1 h, 1 min, 1 s and 24 frames
    assert player.timecode() == "1:01:01:24"
    player.last()
    assert (player.timecode(), player.timecode(0.999)) == ("1:01:02:00", "0:00:00:24")


@pytest.mark.parametrize(
    ("index", "rate", "text"),
    [
        (29, Fraction(30000, 1001), "0:00:00:29"),  # at 0.96763 s
        (30, Fraction(30000, 1001), "0:00:01:00"),  # at 1.001 s
        (60, Fraction(30000, 1001), "0:00:02:00"),  # at 2.002 s
        (29 + 1799 * 30, Fraction(30), "0:29:59:29"),
        (3, Fraction(1, 2), "0:00:06:00"),
        (36000 * 60, Fraction(60), "10:00:00:00"),
    ],
)
def test_timecodes_of_frames(index: int, rate: Fraction, text: str) -> None:
    assert timecode(float(index / rate), rate) == text


def test_text() -> None:
    player, _ = transport()
    player.seek(1.24)
    assert player.text() == "0:01.240 / 0:02.000   frame 12 / 19   1x   loop"


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


@pytest.mark.parametrize(("mark", "time"), [(0.65, 0.65), (0.61, 0.61), (0.5, 0.7)])
def test_an_end_set_just_behind_the_present_moment_is_reached_at_once(mark: float, time: float) -> None:
    player, clock = transport(loop=False, playing=True)
    clock.now += 0.7
    player.mark_out = mark
    assert player.time == pytest.approx(time)
