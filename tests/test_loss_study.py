"""The study of losses: `python -m bench.codec.loss`, shortened."""

from fractions import Fraction
from random import Random

import numpy as np
import pytest

from bench.codec import loss
from fba import Animation, FbaWarning, decode
from tools import synthetic_motion as motion

ONCE, SECOND = loss.SETTINGS[0], loss.Setting("every second", Fraction(1))


@pytest.fixture(scope="module")
def performance() -> Animation:
    return motion.animation(motion.face(150, faps_sent=(3, 4, 48, 49)))


def test_packets_are_the_stream_in_pieces_of_a_plane(performance: Animation) -> None:
    data = loss.encode(performance, SECOND.options)
    packets = loss.split_planes(data)
    assert b"".join(packets) == data
    assert len(packets) == 150
    with pytest.warns(FbaWarning, match="the end code"):
        part = decode(b"".join(packets[:25]), bap_steps="visage", on_error="salvage")
    assert len(part) == 25


@pytest.mark.parametrize(("share", "burst"), [(0.05, 1), (0.2, 1), (0.2, 10)])
def test_channels_lose_what_they_say(share: float, burst: int) -> None:
    packets = [bytes([n % 256]) for n in range(20_000)]
    arrived = loss.lose(share, burst)(packets, Random(1))
    assert 1 - len(arrived) / len(packets) == pytest.approx(share, rel=0.2)
    flipped = loss.flip(1e-3)([b"\0" * 20_000], Random(1))
    count = int(np.unpackbits(np.frombuffer(flipped, dtype=np.uint8)).sum())
    assert count == pytest.approx(160, rel=0.3)


def test_a_lost_plane_is_forgotten_within_one_period(performance: Animation) -> None:
    """With one I plane only, the error stays."""
    error = loss.recovery(performance, SECOND, seconds=2, rounds=12)
    assert error[:5].mean() > 0
    assert error[25:].max() == 0
    assert loss.recovery(performance, ONCE, seconds=2, rounds=12)[25:].min() > 0


def test_short_periods_bring_more_frames_home(performance: Animation) -> None:
    channels = [loss.CHANNELS[1], loss.CHANNELS[5]]
    results = loss.run(performance, [ONCE, SECOND], channels, rounds=6, seed=2)
    assert results == loss.run(performance, [ONCE, SECOND], channels, rounds=6, seed=2)
    few, _, many, _ = results
    assert few.right < 0.5 < many.right
    assert few.outage > many.outage
    assert few.error > many.error > 0
    for one in results:
        assert one.right + one.held + one.wrong == pytest.approx(1)
        assert one.wrong < 0.1
    lines = loss.tables(results)
    assert lines[0].startswith("| frames shown right: I planes | size | planes lost, 5 % |")
    assert lines[3].startswith(f"| every second | +{100 * many.bytes / few.bytes - 100:.0f} % |")
