"""What a sound device is given, and its clock, with devices that are unpunctual, fast, and that stop."""

import random
from fractions import Fraction

import numpy as np
import pytest

from fba.animation import Animation
from fba_player.playback._timeline import Timeline
from fba_player.playback._transport import Motion, Transport
from fba_player.sound._mixer import FADE_SECONDS, SoundMixer
from fba_player.sound._player import SoundClock
from player_tracks import face_track

RATE = 1000
FADED = round(FADE_SECONDS * RATE)


def ramp(start: int, count: int) -> np.ndarray:
    """Samples whose value is their number; silence outside 0..9999."""
    numbers = np.arange(start, start + count)
    inside = (numbers >= 0) & (numbers < 10_000)
    return np.repeat(np.where(inside, numbers, 0)[:, None], 2, axis=1).astype(np.int16)


class Player:
    """A transport of four seconds at one frame each tenth, and a mixer for it on one clock."""

    def __init__(
        self, start: int = 0, origin: float | None = None, playing_from: float | None = None
    ) -> None:
        frames = np.arange(start, start + 40)
        animation = Animation(Fraction(10), frames, face=face_track([{3: 1}] * 40))
        self.now = 50.0
        self.transport = Transport(Timeline(animation), loop=False, clock=lambda: self.now)
        begin = self.transport.start if origin is None else origin
        self.mixer = SoundMixer(ramp, RATE, lambda: self.transport.motion, begin)
        if playing_from is not None:
            self.transport.seek(playing_from)
            self.transport.play()

    def hear(self, count: int) -> np.ndarray:
        """The next samples of the left side; the clock moves on."""
        samples = self.mixer.fill(self.now, count)
        assert samples.dtype == np.int16
        np.testing.assert_array_equal(samples[:, 0], samples[:, 1])
        self.now += count / RATE
        return samples[:, 0].astype(int)


def test_the_sound_is_that_of_the_time_shown() -> None:
    player = Player(start=30)  # begins at 3 s: the sound's beginning is the first frame's
    assert not player.hear(100).any()
    player.transport.play()
    heard = np.concatenate([player.hear(37), player.hear(512), player.hear(451)])
    np.testing.assert_array_equal(heard[FADED:], np.arange(FADED, 1000))
    assert player.transport.time == pytest.approx(4.0)


def test_pause_ends_softly_and_play_goes_on_there() -> None:
    player = Player(playing_from=0.0)
    player.hear(500)
    player.transport.pause()
    heard = player.hear(100)
    assert (np.diff(heard[: FADED + 1]) < 0).all()
    assert not heard[FADED:].any()
    player.transport.play()
    np.testing.assert_array_equal(player.hear(100)[FADED:], np.arange(500 + FADED, 600))


def test_the_sound_is_moved_while_it_is_heard() -> None:
    player = Player(playing_from=0.0)
    player.hear(500)
    player.mixer.origin = player.transport.start + 0.2  # begins later
    np.testing.assert_array_equal(player.hear(100)[FADED:], np.arange(300 + FADED, 400))
    player.mixer.origin = player.transport.start - 0.1
    np.testing.assert_array_equal(player.hear(100)[FADED:], np.arange(700 + FADED, 800))


def test_seeking_goes_over_softly() -> None:
    player = Player(playing_from=0.0)
    player.hear(500)
    player.transport.seek(3.0)
    heard = player.hear(100)
    np.testing.assert_array_equal(heard[FADED:], np.arange(3000 + FADED, 3100))
    assert heard[0] == 500
    assert (heard[:FADED] >= 500).all()


def test_a_loop_turns_inside_a_buffer() -> None:
    player = Player()
    player.transport.loop = True
    player.transport.mark_in, player.transport.mark_out = 1.0, 1.3
    player.transport.seek(1.2)
    player.transport.play()
    heard = player.hear(950)
    for turn in (100, 400, 700):
        np.testing.assert_array_equal(heard[turn + FADED : turn + 100], np.arange(1000 + FADED, 1100))
    assert player.transport.time == pytest.approx(1.25)


def test_the_end_is_silent() -> None:
    player = Player(playing_from=3.85)
    heard = player.hear(300)
    np.testing.assert_array_equal(heard[FADED:150], np.arange(3850 + FADED, 4000))
    assert not heard[150 + FADED :].any()


@pytest.mark.parametrize("speed", [0.25, 0.5, 1.5, 2.0, 4.0])
def test_other_speeds_keep_in_step_like_a_tape(speed: float) -> None:
    player = Player()
    player.transport.set_speed(speed)
    player.transport.play()
    heard = np.concatenate([player.hear(count) for count in (100, 33, 67, 200)])
    expected = np.arange(400) * speed + max(speed - 1, 0) / 2  # the middle of what a sample stands for
    np.testing.assert_allclose(heard[2 * FADED :], expected[2 * FADED :], atol=1.0)
    assert player.transport.time == pytest.approx(0.4 * speed)


def test_changing_the_speed_does_not_jump() -> None:
    player = Player(playing_from=0.0)
    heard = [player.hear(200)]
    player.transport.set_speed(2.0)
    heard.append(player.hear(200))
    steps = np.diff(np.concatenate(heard)[FADED + 2 :])
    assert steps.min() >= 1
    assert steps.max() <= 3


def test_waiting_for_the_device_the_sound_begins_with_its_first_sample() -> None:
    player = Player()
    player.transport.use_clock(lambda: player.now, latency=0.08)
    player.transport.play()
    heard = player.hear(200)
    assert not heard[:80].any()
    np.testing.assert_array_equal(heard[80 + FADED :], np.arange(FADED, 120))
    assert player.transport.time == pytest.approx(0.12)


def test_before_and_after_the_sound_there_is_silence() -> None:
    player = Player(origin=0.5)  # the sound begins half a second after the first frame
    player.transport.play()
    heard = player.hear(1000)
    assert not heard[:500].any()
    np.testing.assert_array_equal(heard[500:], np.arange(500))


def test_volume_and_muting() -> None:
    player = Player(playing_from=2.0)
    player.hear(50)
    player.mixer.volume = 0.5
    np.testing.assert_allclose(player.hear(50), np.arange(2050, 2100) * 0.5, atol=0.5)
    player.mixer.muted = True
    assert not player.hear(50).any()
    player.mixer.muted = False
    player.mixer.volume = 1.0
    np.testing.assert_array_equal(player.hear(50), np.arange(2150, 2200))


def test_a_motion_tells_when_it_turns() -> None:
    motion = Motion(10.0, 1.0, 2.0, True, 3.0, 0.5, 3.0, 3.0, True)
    assert [motion.until_turn(clock) for clock in (9.5, 10.0, 10.75, 11.0)] == [0.5, 1.0, 0.25, 1.25]
    assert [motion.moving(clock) for clock in (9.9, 10.0, 12.0)] == [False, True, True]
    still = Motion(10.0, 1.0, 2.0, True, 3.0, 0.5, 3.0, 3.0, False)
    assert still.until_turn(11.5) == float("inf")
    assert not still.moving(11.5)


def test_fades_last_four_milliseconds() -> None:
    """Shorter ones click, longer ones swallow the beginning of a word."""
    player = Player(playing_from=1.0)
    heard = player.hear(10)
    np.testing.assert_array_equal(heard[4:], np.arange(1004, 1010))
    np.testing.assert_allclose(heard[:4] / np.arange(1000, 1004), [0, 0.25, 0.5, 0.75], atol=0.001)


@pytest.mark.parametrize(
    ("slip", "jumps"), [(0.0015, False), (0.0025, True), (-0.0015, False), (-0.0025, True)]
)
def test_a_clock_that_is_off_by_two_milliseconds_makes_no_jump(slip: float, jumps: bool) -> None:
    """Nobody sees that; each jump would be heard."""
    player = Player(playing_from=1.0)
    player.hear(100)
    player.now += slip
    heard = player.hear(100)[4:]
    straight_on = np.arange(1104, 1200)
    assert np.array_equal(heard, straight_on) != jumps
    if jumps:
        assert abs(heard - straight_on - 1000 * slip).max() <= 1


DEVICE_RATE, PERIOD, LATENCY = 48_000, 0.04, 0.08
COUNT = 1920  # samples of a period


class Device:
    """Takes a period whenever one has been played, as a device does that holds three."""

    def __init__(self, pace: float = 1.0, lateness: float = 0.0) -> None:
        self.now = 500.0
        self.begun = self.now
        self.pace = pace
        self.lateness = lateness
        self.random = random.Random(7)
        self.calls = 0
        self.clock = SoundClock(DEVICE_RATE, LATENCY, monotonic=lambda: self.now)
        self.firsts: list[float] = []

    def run(self, seconds: float) -> None:
        """Call the clock as the device would."""
        for _ in range(round(seconds / PERIOD)):
            free = self.begun + max(self.calls - 2, 0) * PERIOD / self.pace
            self.now = max(free + self.random.random() * self.lateness, self.now)
            self.firsts.append(self.clock.take(COUNT))
            self.calls += 1

    @property
    def heard(self) -> float:
        """Seconds of sound that the device has really played."""
        return (self.now - self.begun) * self.pace


def test_it_counts_samples_from_the_first_that_is_heard() -> None:
    device = Device()
    assert device.clock() == -LATENCY  # nothing is heard yet
    device.run(1.0)
    assert device.firsts[:3] == pytest.approx([0.0, 0.04, 0.08])
    assert device.clock() == pytest.approx(device.heard)
    device.now += 0.03  # between two calls the wall clock goes on
    assert device.clock() == pytest.approx(device.heard)


@pytest.mark.parametrize("pace", [0.999, 1.0, 1.001])
def test_ten_minutes_with_a_device_that_is_off_by_a_thousandth(pace: float) -> None:
    device = Device(pace, lateness=0.015)
    worst = 0.0
    for _ in range(600):
        device.run(1.0)
        worst = max(worst, abs(device.clock() - device.heard))
    assert abs(device.heard - (device.now - device.begun)) == pytest.approx(abs(pace - 1) * 600, abs=1e-3)
    assert worst < 0.020


def test_unpunctual_calls_never_turn_it_back() -> None:
    device = Device(lateness=0.035)
    last = -1.0
    for _ in range(500):
        device.run(PERIOD)
        for ahead in (0.0, 0.01, 0.02):
            device.now += ahead
            now = device.clock()
            assert now >= last
            last = now


def test_a_call_that_comes_late_changes_nothing() -> None:
    device = Device()
    device.run(2.0)
    device.now += 0.3  # it played on by itself, and asks for more at once
    device.run(2.0)
    assert device.firsts == pytest.approx([n * PERIOD for n in range(100)])
    assert device.clock() == pytest.approx(device.heard, abs=0.005)


def test_a_device_that_stops_for_a_while_loses_that_sound() -> None:
    device = Device()
    device.run(2.0)
    before, first = device.clock(), device.firsts[-1]
    device.now += 3.0
    assert device.clock() == pytest.approx(before + 3.0)  # the picture goes on
    device.begun += 3.0
    device.run(1.0)  # half of that to be sure
    assert device.firsts[-1] == pytest.approx(first + 4.0, abs=0.05)  # and the sound is at the same place
    assert device.clock() == pytest.approx(before + 4.0, abs=0.05)


def test_unpunctual_calls_hardly_move_it() -> None:
    """Calls are up to 35 ms late; each may move the clock by a twentieth of that, which is less than 2 ms."""
    device = Device(lateness=0.035)
    device.run(5.0)
    moves = []
    for _ in range(500):
        before = device.clock() - device.now
        device.run(PERIOD)
        moves.append(device.clock() - device.now - before)
    assert max(map(abs, moves)) < 0.002
