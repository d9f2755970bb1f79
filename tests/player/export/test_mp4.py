"""Films from made-up pictures, decoded again: times, colours, sound; no OpenGL.

Turns of threads while a film is encoded.
"""

import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fba.errors import FormatError, UnsupportedError
from fba_player.export._recorder import PROMPT_THREADS, PromptThreads, Recorder
from fba_player.sound.soundtrack import Soundtrack, find_sound_beside
from sound_clicks import click_time, sound, write_click, write_wave

av = pytest.importorskip("av")

COLOURS = [(255, 0, 0), (0, 200, 0), (30, 30, 220), (200, 200, 200), (90, 60, 40)]


def plain(colour: tuple[int, int, int], size: tuple[int, int] = (32, 16)) -> np.ndarray:
    pixels = np.full((size[1], size[0], 4), 255, dtype=np.uint8)
    pixels[..., :3] = colour
    return pixels


def pictures(path: Path) -> list[tuple[float, np.ndarray]]:
    """(time, uint8 (H, W, 3)) of every frame."""
    with av.open(str(path)) as film:
        return [(float(f.time), rgb(f)) for f in film.decode(video=0)]


def rgb(frame: Any) -> np.ndarray:
    """uint8 (H, W, 3). PyAV before 17 converts by the colour space only where it is named and changes."""
    if frame.format.name == "yuv420p":
        colours = {"src_colorspace": "ITU709", "dst_colorspace": "ITU601", "src_color_range": "MPEG"}
        frame = frame.reformat(format="rgb24", **colours)
    return frame.to_ndarray(format="rgb24")


# --- pictures -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("rate", ["25", "30000/1001", "100/7"])
def test_every_picture_has_its_time_and_its_colours(tmp_path: Path, rate: str) -> None:
    path = tmp_path / "a.mp4"
    with Recorder(path, (32, 16), rate=rate) as recorder:
        for colour in COLOURS:
            assert recorder.add(plain(colour))
    found = pictures(path)
    assert len(found) == len(COLOURS)
    for number, ((time, shown), colour) in enumerate(zip(found, COLOURS, strict=True)):
        assert time == pytest.approx(float(number / Fraction(rate)), abs=1e-4)
        assert np.abs(shown.astype(int) - colour).max() <= 6
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert stream.codec_context.colorspace == av.video.reformatter.Colorspace.ITU709
        assert stream.average_rate == Fraction(rate)


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_a_picture_stays_until_the_next(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    with Recorder(path, (32, 16), rate=10) as recorder:
        for time, colour in zip((0.0, 0.11, 0.13, 0.52), COLOURS[:4], strict=True):
            wanted = recorder.wants(time)
            assert recorder.add(plain(colour), time) == wanted == (time != 0.13)
        assert recorder.frames == 6
        assert recorder.seconds == Fraction(6, 10)
    found = pictures(path)
    assert [time for time, _ in found] == pytest.approx([0.0, 0.1, 0.5])
    for (_, shown), colour in zip(found, (COLOURS[0], COLOURS[1], COLOURS[3]), strict=True):
        assert np.abs(shown.astype(int) - colour).max() <= 6


def test_bottom_and_top_stay_where_they_are_and_odd_sizes_lose_a_row(tmp_path: Path) -> None:
    pixels = plain((0, 0, 0), (33, 17))
    pixels[:8] = 255
    with Recorder(tmp_path / "a.mp4", (33, 17)) as recorder:
        recorder.add(pixels)
        recorder.add(pixels[..., :3])
        recorder.add(np.ascontiguousarray(pixels[::-1])[::-1])  # rows from the bottom up, as OpenGL has them
    found = pictures(tmp_path / "a.mp4")
    assert len(found) == 3
    for _, shown in found:
        assert shown.shape == (16, 32, 3)
        assert shown[:7].min() > 240
        assert shown[9:].max() < 15


def test_a_picture_of_another_size_is_fitted_with_bars(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.mp4", (64, 32)) as recorder:
        recorder.add(plain((200, 200, 200), (64, 32)))
        recorder.add(plain((200, 200, 200), (40, 40)))
    (_, whole), (_, fitted) = pictures(tmp_path / "a.mp4")
    assert whole.min() > 190
    assert fitted[:, 20:44].min() > 180
    assert fitted[:, :12].max() < 20
    assert fitted[:, 52:].max() < 20


# --- GIF ----------------------------------------------------------------------------------------------


def test_a_gif_loops_and_keeps_its_colours(tmp_path: Path) -> None:
    path = tmp_path / "a.gif"
    ramp = np.zeros((48, 64, 4), dtype=np.uint8)
    ramp[..., :3] = np.linspace(60, 190, 64).astype(np.uint8)[None, :, None]  # as smooth as a studio's wall
    last = ramp.copy()
    last[:, 30:40, :3] = (250, 20, 20)
    with Recorder(path, (64, 48), rate=25) as recorder:
        recorder.add(ramp)
        recorder.add(ramp)
        recorder.add(last)
    with Image.open(path) as film:
        assert film.info["loop"] == 0
        found = []
        for number in range(film.n_frames):
            film.seek(number)
            found.append((film.info["duration"], np.asarray(film.convert("RGB")).astype(int)))
    assert [duration for duration, _ in found] == [40, 40, 40]
    for (_, shown), wanted in zip(found, (ramp, ramp, last), strict=True):
        assert np.abs(shown - wanted[..., :3]).max() <= 8  # one palette has both the greys and the red
    np.testing.assert_array_equal(found[0][1], found[1][1])  # nothing crawls where nothing moves


def test_a_gif_has_hundredths_of_a_second(tmp_path: Path) -> None:
    with Recorder(tmp_path / "a.gif", (16, 16), rate=30) as recorder:
        for number in range(6):
            recorder.add(plain((number * 40, 0, 0), (16, 16)))
    with Image.open(tmp_path / "a.gif") as film:
        durations = []
        for number in range(film.n_frames):
            film.seek(number)
            durations.append(film.info["duration"])
    assert sorted(set(durations)) == [30, 40]
    assert sum(durations) == 200
    with pytest.raises(ValueError, match="100 frames a second"):
        Recorder(tmp_path / "b.gif", (16, 16), rate=120)


# --- sound --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("start", "rate", "channels"),
    [("0", 48000, 1), ("0.2", 44100, 2), ("-0.1", 16000, 1), ("1/30", 22050, 2), ("0", 37800, 1)],
)
def test_a_click_stays_where_it_is(tmp_path: Path, start: str, rate: int, channels: int) -> None:
    click, flash = Fraction(1, 2), Fraction(1, 2) - Fraction(start)
    audio = write_click(tmp_path / "a.wav", float(click), rate=rate, channels=channels)
    path = tmp_path / "a.mp4"
    with Recorder(path, (32, 16), rate=20, audio=audio, audio_start=Fraction(start)) as recorder:
        for number in range(20):
            bright = round(flash * 20) == number
            recorder.add(plain((255, 255, 255) if bright else (0, 0, 0)))
    shown = next(time for time, pixels in pictures(path) if pixels.mean() > 128)
    heard = click_time(path)
    assert shown == pytest.approx(float(flash), abs=0.5 / 20)
    assert heard == pytest.approx(float(flash), abs=0.004)  # less than a tenth of a frame
    assert sound(path)[2] == (rate if rate != 37800 else 48000)


def test_sound_is_as_long_as_the_film(tmp_path: Path) -> None:
    for seconds in (0.3, 5.0):
        audio = write_click(tmp_path / "a.wav", 0.1, seconds=seconds)
        path = tmp_path / f"{seconds}.mp4"
        with Recorder(path, (16, 16), rate=20, audio=audio) as recorder:
            for _ in range(20):
                recorder.add(plain((0, 0, 0), (16, 16)))
        start, samples, rate = sound(path)
        assert start == pytest.approx(0.0, abs=1e-3)
        assert len(samples) / rate == pytest.approx(1.0, abs=0.03)


def test_files_without_sound_are_refused(tmp_path: Path) -> None:
    noise, film = tmp_path / "noise.wav", tmp_path / "film.mp4"
    noise.write_bytes(b"RIFF, or so it says")
    with Recorder(film, (16, 16)) as recorder:
        recorder.add(plain((0, 0, 0), (16, 16)))
    for path, text in (
        (noise, "cannot be read as sound"),
        (film, "no sound"),
        (tmp_path / "x.wav", "No such"),
    ):
        with pytest.raises(FormatError, match=text):
            Recorder(tmp_path / "b.mp4", (16, 16), audio=path)
    with pytest.raises(UnsupportedError, match="GIF has no sound"):
        Recorder(tmp_path / "b.gif", (16, 16), audio=film)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["film.mp4", "noise.wav"]


def test_samples_are_those_of_the_file(tmp_path: Path) -> None:
    """From any sample on, in pieces of any size, and silence where there is nothing."""
    wanted = np.arange(5000, dtype="<i2")
    write_wave(tmp_path / "a.wav", wanted, 8000)
    soundtrack = Soundtrack(tmp_path / "a.wav", Fraction(1234, 8000))
    pieces = [soundtrack.take(size)[0] for size in (1, 1000, 2047, 0, 900)]
    soundtrack.close()
    np.testing.assert_allclose(np.concatenate(pieces)[:3766], wanted[1234:] / 32768, atol=1e-6)
    assert not np.concatenate(pieces)[3766:].any()
    early = Soundtrack(tmp_path / "a.wav", Fraction(-3, 8000))
    np.testing.assert_allclose(early.take(6)[0], np.array([0, 0, 0, 0, 1, 2]) / 32768, atol=1e-6)
    early.close()


def test_sound_of_the_same_name_is_found(tmp_path: Path) -> None:
    assert find_sound_beside(tmp_path / "a.fba") is None
    (tmp_path / "a.WAV").touch()
    assert find_sound_beside(tmp_path / "a.fba") == tmp_path / "a.WAV"
    assert find_sound_beside(tmp_path / "b.fba") is None
    assert find_sound_beside(tmp_path / "a.WAV") is None


class Interpreter:
    """Seconds of a turn, as an interpreter has them."""

    def __init__(self, turn: float) -> None:
        self.turn = turn

    def prompt(self) -> PromptThreads:
        def change(turn: float) -> None:
            self.turn = turn

        return PromptThreads(lambda: self.turn, change)


def test_the_interval_is_short_until_the_last_user_leaves() -> None:
    python = Interpreter(0.005)
    prompt = python.prompt()
    with prompt:
        with prompt:
            assert python.turn < 0.001
        assert python.turn < 0.001
    assert python.turn == 0.005
    with prompt:
        assert python.turn < 0.001


def test_an_error_restores_the_old_interval() -> None:
    python = Interpreter(0.005)
    with pytest.raises(RuntimeError), python.prompt():
        raise RuntimeError
    assert python.turn == 0.005


def test_shorter_turns_stay() -> None:
    python = Interpreter(0.0001)
    with python.prompt():
        assert python.turn == 0.0001


def test_the_switch_interval_is_that_of_the_process() -> None:
    with PROMPT_THREADS:
        assert sys.getswitchinterval() < 0.001
