"""Sound in one channel at a rate: as FFmpeg reads it, and WAV files by the standard library alone."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import resample_poly

from fba.arrays import Int16
from fba.audio import find_duration, read_mono
from fba.errors import DisplayError
from sound_clicks import write_wave


def write_tone(path: Path, rate: int, channels: int, width: int = 2) -> None:
    """Three seconds of 440 Hz, in all channels."""
    tone = 8000 * np.sin(2 * np.pi * 440 * np.arange(3 * rate) / rate)
    samples = np.repeat(tone, channels) if width == 2 else bytes(3 * rate * channels * width)
    write_wave(path, samples, rate, channels, width)


def without_pyav(monkeypatch: pytest.MonkeyPatch) -> None:
    there = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "av" else there(name))


def read(path: Path) -> Int16:
    return np.concatenate(list(read_mono(path, 16000)))


@pytest.mark.parametrize("rate", [8000, 16000, 22050, 44100, 96000])
@pytest.mark.parametrize("channels", [1, 2])
@pytest.mark.parametrize("pyav", [True, False])
def test_a_tone_stays_a_tone(
    rate: int, channels: int, pyav: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "tone.wav"
    write_tone(path, rate, channels)
    if not pyav:
        without_pyav(monkeypatch)
    samples = read(path)
    assert abs(len(samples) - 48000) <= 32
    expected = 8000 * np.sin(2 * np.pi * 440 * np.arange(len(samples)) / 16000)
    middle = slice(200, -200)
    assert np.abs(samples[middle] - expected[middle]).max() < 400


@pytest.mark.parametrize("rate", [8000, 22050, 44100, 96000])
def test_blocks_leave_no_seams(rate: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the standard library, block by block, noise becomes what it becomes at once."""
    without_pyav(monkeypatch)
    noise = np.random.default_rng(4).integers(-9000, 9000, 3 * rate + 77).astype("<i2")
    path = write_wave(tmp_path / "noise.wav", noise, rate)
    common = np.gcd(rate, 16000)
    whole = resample_poly(noise.astype(np.float64), 16000 // common, rate // common)
    samples = read(path)
    assert len(samples) == len(whole)
    assert np.abs(samples - whole).max() < 1


@pytest.mark.parametrize("pyav", [True, False])
def test_the_duration_is_what_a_file_says(
    pyav: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_tone(tmp_path / "tone.wav", 8000, 2)
    (tmp_path / "text.wav").write_text("no sound")
    if not pyav:
        without_pyav(monkeypatch)
    assert find_duration(tmp_path / "tone.wav") == pytest.approx(3)
    assert find_duration(tmp_path / "text.wav") is None
    assert find_duration(tmp_path / "none.wav") is None


def test_other_files_need_pyav(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    without_pyav(monkeypatch)
    write_tone(tmp_path / "fine.wav", 16000, 1, width=3)
    (tmp_path / "song.mp3").write_bytes(b"ID3 and so on")
    for name in ("fine.wav", "song.mp3"):
        with pytest.raises(DisplayError, match=re.escape('needs PyAV: pip install "mpeg4-fba[films]"')):
            read(tmp_path / name)
