"""Audio files of all sorts, and a whole player of sound on a device that nobody hears."""

import time
import tracemalloc
import warnings
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from fba.animation import Animation
from fba.audio import SoundFile
from fba.errors import FbaWarning, FormatError
from fba_player.playback._timeline import Timeline
from fba_player.playback._transport import Motion, Transport
from fba_player.sound._player import Audio, SoundBlocks, find_sound_beside, open_audio, samples_ahead
from player_tracks import face_track
from sound_clicks import write_wave

av = pytest.importorskip("av")


def tone(count: int) -> np.ndarray:
    """Samples no stretch of which looks like another: noise without the highest tones, int16."""
    noise = np.random.default_rng(5).standard_normal(count + 40)
    return (np.convolve(noise, np.hanning(41), "valid") * 2500).astype(np.int16)


def encode(path: Path, codec: str, samples: np.ndarray, rate: int, layout: str = "mono") -> Path:
    """samples: (N,) int16, the same on every channel."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=rate, layout=layout)
        channels = len(av.AudioLayout(layout).channels)
        frame = av.AudioFrame.from_ndarray(
            np.repeat(samples, channels).reshape(1, -1), format="s16", layout=layout
        )
        frame.sample_rate, frame.pts, frame.time_base = rate, 0, Fraction(1, rate)
        resampler = av.AudioResampler(stream.codec_context.format, layout, rate, frame_size=1152)
        for part in [*resampler.resample(frame), *resampler.resample(None)]:
            container.mux(stream.encode(part))
        container.mux(stream.encode(None))
    return path


def transport() -> Transport:
    animation = Animation(Fraction(25), np.arange(250), face=face_track([{3: 1}] * 250))
    return Transport(Timeline(animation), loop=False)


@pytest.mark.parametrize(
    ("name", "codec", "layout", "close"),
    [
        ("a.wav", "pcm_s16le", "mono", 1.0),
        ("a.wav", "pcm_s24le", "5.1", 1.0),
        ("a.flac", "flac", "stereo", 1.0),
        ("a.ogg", "libopus", "mono", 0.8),
        ("a.mp3", "libmp3lame", "mono", 0.8),
        ("a.m4a", "aac", "stereo", 0.8),
    ],
)
def test_any_stretch_is_found_to_the_sample(
    tmp_path: Path, name: str, codec: str, layout: str, close: float
) -> None:
    samples = tone(100_000)
    rate = 48_000 if codec == "libopus" else 44_100
    path = encode(tmp_path / name, codec, samples, rate, layout)
    with SoundFile(path) as file:
        assert file.rate == rate
        assert file.duration == pytest.approx(100_000 / rate, abs=0.1)
        for start in (60_000, 0, 90_000, 90_500, 30_000):
            heard = file.read(start, 2000)[:, 0]
            assert np.corrcoef(heard, samples[start : start + 2000])[0, 1] > close - 1e-4


def test_reading_stops_at_the_last_sample(tmp_path: Path) -> None:
    samples = tone(5000)
    with SoundFile(write_wave(tmp_path / "a.wav", samples)) as file:
        assert (len(file.read(4000, 5000)), len(file.read(9000, 10))) == (1000, 0)
        np.testing.assert_array_equal(file.read(0, 10**9)[:, 0], samples)


def test_left_and_right_stay_apart(tmp_path: Path) -> None:
    left, right = tone(3000), tone(6000)[3000:]
    with SoundFile(write_wave(tmp_path / "a.wav", np.stack([left, right], axis=1), channels=2)) as file:
        np.testing.assert_array_equal(file.read(0, 3000), np.stack([left, right], axis=1))


@pytest.mark.parametrize("rate", [4000, 400_000])
def test_rates_that_no_device_plays_are_converted(tmp_path: Path, rate: int) -> None:
    with SoundFile(write_wave(tmp_path / "a.wav", tone(2 * rate), rate)) as file:
        assert file.rate == 48_000
        assert len(file.read(0, 10**6)) == pytest.approx(96_000, abs=100)


def test_no_sound_at_all_says_so(tmp_path: Path) -> None:
    empty, text, picture = tmp_path / "empty.wav", tmp_path / "a.wav", tmp_path / "a.png"
    empty.write_bytes(b"")
    text.write_bytes(b"RIFF\x10\0\0\0WAVEfmt nothing of the sort")
    picture.write_bytes(b"\x89PNG\r\n\x1a\n")
    nothing = write_wave(tmp_path / "none.wav", np.zeros(0, dtype=np.int16))
    for path, words in (
        (empty, "empty"),
        (text, "sound"),
        (picture, "sound"),
        (nothing, "no sound that can be decoded"),
        (tmp_path / "missing.wav", "No such file"),
    ):
        with pytest.raises(FormatError, match=words) as caught:
            SoundFile(path)
        assert str(path) in str(caught.value)


def test_tags_that_are_not_utf_8_do_not_matter(tmp_path: Path) -> None:
    path = write_wave(tmp_path / "a.wav", tone(1000))
    tag = b"INFOINAM" + (8).to_bytes(4, "little") + b"caf\xe9 bar"
    data = path.read_bytes() + b"LIST" + len(tag).to_bytes(4, "little") + tag
    path.write_bytes(data[:4] + (len(data) - 8).to_bytes(4, "little") + data[8:])
    with SoundFile(path) as file:
        np.testing.assert_array_equal(file.read(0, 1000)[:, 0], tone(1000))


def test_a_format_that_changes_on_the_way_is_followed(tmp_path: Path) -> None:
    parts = [
        encode(tmp_path / f"{layout}.mp3", "libmp3lame", tone(50_000), rate, layout).read_bytes()
        for layout, rate in (("mono", 44100), ("stereo", 32000))
    ]
    path = tmp_path / "both.mp3"
    path.write_bytes(b"".join(parts))
    with SoundFile(path) as file, warnings.catch_warnings(action="ignore", category=FbaWarning):
        samples = file.read(0, 10**6)
    assert len(samples) > 80_000  # FFmpeg believes the first part's own length for some of the second
    assert np.abs(samples[60_000:80_000].astype(float)).mean() > 500


def test_a_damaged_part_is_left_out_with_a_warning(tmp_path: Path) -> None:
    path = encode(tmp_path / "a.m4a", "aac", tone(200_000), 44100)
    data = bytearray(path.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 3000] = bytes(np.random.default_rng(3).integers(0, 256, 3000, dtype=np.uint8))
    path.write_bytes(data)
    with SoundFile(path) as file, pytest.warns(FbaWarning, match="damaged"):
        heard = file.read(0, 400_000)[:, 0]
    for at in (20_000, 180_000):  # before and after
        assert np.corrcoef(heard[at : at + 5000], tone(200_000)[at : at + 5000])[0, 1] > 0.8


def test_blocks_hold_what_is_wanted_and_little_else(tmp_path: Path) -> None:
    samples = tone(16000 * 120)
    path = write_wave(tmp_path / "a.wav", samples)
    place = [0]
    tracemalloc.start()
    blocks = SoundBlocks(SoundFile(path), lambda: [place[0], place[0] + 8000])
    try:
        for at in (0, 1_000_000, 8_000, 1_900_000, *range(100_000, 1_000_000, 60_000)):
            place[0] = at
            blocks.load()
            blocks.load()
            np.testing.assert_array_equal(blocks.take(at, 4000)[:, 1], samples[at : at + 4000])
        assert not blocks.take(-500, 400).any()
        np.testing.assert_array_equal(blocks.take(-100, 200).shape, (200, 2))
        assert tracemalloc.get_traced_memory()[1] < 4e6
    finally:
        tracemalloc.stop()
        blocks.close()


def test_a_device_leads_the_transport(tmp_path: Path) -> None:
    player = transport()
    path = write_wave(tmp_path / "a.wav", tone(16000))
    with open_audio(path, player, backend="null") as audio:  # type: ignore[union-attr]
        assert (audio.backend.lower(), audio.rate, audio.duration) == ("null", 16000, 1.0)
        player.play()
        begun = time.monotonic()
        while player.time == 0.0 and time.monotonic() - begun < 20:
            time.sleep(0.005)
        assert player.time > 0.0
        audio.volume = 3.0
        assert audio.volume == 1.0
        audio.muted = True
        assert audio.muted
        audio.offset = -0.25
        assert (audio.offset, audio._mixer.origin) == (-0.25, player.start - 0.25)
        here = player.time
    assert here <= player.time < here + 10.0  # the wall clock goes on from there
    assert player.playing
    audio.close()


def test_without_a_device_the_wall_clock_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import miniaudio

    def refuse(*_: object, **__: object) -> None:
        raise miniaudio.MiniaudioError("nothing here")

    monkeypatch.setattr(miniaudio, "PlaybackDevice", refuse)
    player = transport()
    path = write_wave(tmp_path / "talk.wav", tone(1600))
    with pytest.warns(FbaWarning, match=r"talk.wav is not heard: no sound device .*nothing here"):
        assert open_audio(path, player) is None
    player.play()
    assert player.playing


def test_a_broken_file_is_an_error_with_or_without_a_device(tmp_path: Path) -> None:
    path = tmp_path / "a.wav"
    path.write_bytes(b"no sound")
    with pytest.raises(FormatError, match=r"a\.wav"):
        Audio(path, transport(), backend="null")


def test_a_sound_beside_a_stream_is_found(tmp_path: Path) -> None:
    write_wave(tmp_path / "talk.wav", tone(10))
    assert find_sound_beside(tmp_path / "talk.fba") == tmp_path / "talk.wav"
    assert find_sound_beside(tmp_path / "walk.fba") is None


def test_the_next_two_and_a_half_seconds_are_decoded_in_advance() -> None:
    rate = 1000
    playing = Motion(
        since=0.0, here=0.0, speed=1.0, playing=True, stop=60.0, low=0.0, high=0.0, rest=60.0, loop=False
    )
    for now in (0.0, 0.3, 7.9):
        samples = list(samples_ahead(playing, now, 0.0, rate))
        assert samples[0] == pytest.approx(now * rate, abs=1)
        blocks = {sample // (rate // 2) for sample in samples[:-1]}
        assert blocks == set(range(int(2 * now), int(2 * now) + 6))
