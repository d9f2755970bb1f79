"""The clock of a sound device, with devices that are punctual, unpunctual, fast, and that stop."""

import random

import pytest

from fba_player.sound._player import SoundClock

RATE, PERIOD, LATENCY = 48_000, 0.04, 0.08
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
        self.clock = SoundClock(RATE, LATENCY, monotonic=lambda: self.now)
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
