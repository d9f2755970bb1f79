"""The outline of a sound: its lowest and highest samples over time."""

from pathlib import Path

import numpy as np
import pytest

import graphics
from fba_player.sound import _peaks
from fba_player.sound._peaks import Outline, Peaks, peaks_picture
from sound_clicks import write_wave

graphics.imported("av")

RATE = 8000


def outline_of(path: Path) -> Outline:
    with Peaks(path) as peaks:
        peaks.start(wait=True)
        assert not peaks.reading
        return peaks.outline


def loud_second(seconds: float) -> np.ndarray:
    """Silence with one loud second, from 1 s on, which goes further up than down."""
    samples = np.zeros(round(seconds * RATE))
    samples[RATE : 2 * RATE : 2] = 32000
    samples[RATE + 1 : 2 * RATE : 2] = -16000
    return samples


def test_each_hundredth_of_a_second_has_its_extremes(tmp_path: Path) -> None:
    outline = outline_of(write_wave(tmp_path / "a.wav", loud_second(3.005), RATE))
    assert outline.whole
    assert outline.seconds == pytest.approx(0.01)
    assert len(outline.low) == len(outline.high) == 301
    loud = np.flatnonzero(outline.high > 0)
    assert (loud[0], loud[-1]) == (100, 199)
    assert set(outline.high[loud].tolist()) == {124}  # 32000 / 258
    assert set(outline.low[loud].tolist()) == {-62}


def test_long_sounds_take_bounded_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_peaks, "MOST_BUCKETS", 128)
    monkeypatch.setattr(_peaks, "BUCKETS_AT_ONCE", 64)
    outline = outline_of(write_wave(tmp_path / "a.wav", loud_second(20), RATE))
    assert len(outline.low) <= 128
    assert outline.seconds in (0.16, 0.32)
    assert len(outline.low) * outline.seconds == pytest.approx(20, abs=0.64)
    loud = np.flatnonzero(outline.high > 0) * outline.seconds
    assert loud[0] == pytest.approx(1, abs=0.32)
    assert loud[-1] == pytest.approx(2, abs=0.32)


def test_what_is_no_sound_has_no_outline(tmp_path: Path) -> None:
    (tmp_path / "a.wav").write_bytes(b"RIFF and so on")
    assert len(outline_of(tmp_path / "a.wav").low) == 0
    assert len(outline_of(tmp_path / "missing.wav").low) == 0


def test_reading_can_be_stopped(tmp_path: Path) -> None:
    peaks = Peaks(write_wave(tmp_path / "a.wav", loud_second(3), RATE))
    peaks.close()  # before it has begun
    peaks.start()
    peaks.close()
    assert not peaks.reading
    assert len(peaks.outline.low) == 0


def test_the_loudest_sample_fills_the_height_and_times_match() -> None:
    low, high = np.zeros(100, dtype=np.int8), np.zeros(100, dtype=np.int8)
    low[50], high[50] = -20, 40
    picture = peaks_picture(Outline(0.1, low, high), (1.0, 0.0, 0.0), -10.0, 20.0, (30, 21))
    shown = picture[..., 3] > 0
    assert not shown[:, :10].any()  # before the sound
    assert not shown[:, 20:].any()  # after it
    assert shown[:, 15].nonzero()[0].tolist() == list(range(16))  # all above the middle, half below
    assert shown[:, 12].sum() == 1  # silence is a line
    softer = peaks_picture(Outline(0.1, low // 20, high // 20), (1, 0, 0), 0.0, 10.0, (100, 21))
    assert (softer[:, 50, 3] > 0).sum() < 21  # nearly nothing is not drawn as loud
