"""Bit rates of a stream."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest

from fba.animation import Animation
from fba.codec import StreamInfo
from fba_player._ui.panels._rate_panel import bars_of_planes, measure_rates, probe_encoded


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
    assert found is not None
    assert found.times.tolist() == [2.0, 2.25, 2.5, 2.75, 3.0, 3.25, 3.5]
    assert found.rate == pytest.approx([1.6, 1.0, 2.9, 2.71])  # four planes a second, in kbit/s
    assert [(one.name, one.planes, one.bits) for one in found.totals] == [
        ("I planes", 2, 3000), ("P planes", 5, 1010), ("around them", None, 70),
    ]  # fmt: skip
    assert sum(one.share for one in found.totals) == pytest.approx(1.0)


def test_frames_that_were_skipped_take_time_and_no_bits() -> None:
    found = measure_rates(info([1000, 100, 200], [0], index=[0, 8, 9]))
    assert found is not None
    assert found.rate[-2:] == pytest.approx([0.1, 0.3])


def test_rates_of_one_plane_and_of_no_plane() -> None:
    found = measure_rates(info([1000], [0]))
    assert found is not None
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
    assert found is not None
    assert found.plane_intra is not None
    assert found.plane_intra.tolist() == [True] + [False] * 9
    assert found.frames == 10


def test_long_animations_are_not_encoded_to_be_measured(
    talking: Animation, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fba_player._ui.panels._rate_panel.MAX_VALUES", 29)  # it has thirty
    assert probe_encoded(talking) is None
