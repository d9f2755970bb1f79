"""MP4 files on the command line: converted with sound and back, and read by all commands for streams."""

import json
import shutil
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fba
from command_line import Run
from fba.arrays import Float64
from fba.audio import SoundFile
from fba.carriage.mp4 import list_tracks, read_mp4, write_mp4
from fba.cli.scenes import SoundOptions, find_offset, find_sound
from fba.codec import encode_animation, marked_table
from fba_player.sound.coded_sound import read_coded_sound
from joinable_streams import JOINABLE, performance
from mp4_files import Track, whole_file
from sound_clicks import write_wave

RATE = 16_000
SECONDS = 3


@pytest.fixture
def stream(tmp_path: Path) -> Path:
    path = tmp_path / "talk.fba"
    path.write_bytes(encode_animation(performance(), JOINABLE)[0])
    return path


@pytest.fixture
def voice(tmp_path: Path) -> Path:
    return write_wave(tmp_path / "voice.wav", 12_000 * tone(), RATE)


def tone() -> Float64:
    """A tone that rises, louder and softer, so that it fits itself at one place alone."""
    time = np.arange(SECONDS * RATE) / RATE
    return np.sin(2 * np.pi * (200 + 150 * time) * time) * (0.6 + 0.4 * np.sin(7 * time))


def fit(path: Path) -> tuple[float, float]:
    """When the tone is heard in a file, in seconds of its presentation, and how well it fits: 1 exactly."""
    with SoundFile(path) as sound:
        heard = sound.read(0, 20 * sound.rate)[:, 0].astype(float)
        start, rate = sound.start, sound.rate
    times = np.arange(int(len(tone()) * rate / RATE)) * RATE / rate
    wanted = np.interp(times, np.arange(len(tone())), tone())
    size = 1 << 20
    found = np.fft.irfft(np.fft.rfft(heard, size) * np.conj(np.fft.rfft(wanted, size)), size)
    lag = int(np.argmax(found))
    lag -= size * (lag > size // 2)
    energy = np.sqrt((heard**2).sum() * (wanted**2).sum())
    return start + lag / rate, float(found.max() / energy)


@pytest.mark.parametrize("fragment", [(), ("--fragment", "1s"), ("--fragment", "500ms")])
@pytest.mark.parametrize("coding", ["aac", "opus"])
@pytest.mark.parametrize("offset", [0, 0.25])
def test_sound_is_heard_when_it_is_due(
    run: Run, stream: Path, voice: Path, coding: str, offset: float, fragment: tuple[str, ...]
) -> None:
    target = stream.with_suffix(".fba.mp4")
    options = ["--audio", voice, "--audio-codec", coding, "--audio-offset", offset, *fragment]
    done = run("convert", stream, target, *options)
    assert done.err.count("\n") == 1  # the table of BAP steps
    assert f"with the sound of {voice} as {'AAC' if coding == 'aac' else 'Opus'}" in done.out
    begin, likeness = fit(target)
    assert abs(begin - offset) < 0.002
    assert likeness > 0.98
    assert find_offset(target, (target,), SoundOptions()) == pytest.approx(SoundFile(target).start)
    back = stream.with_name("back.fba")
    run("convert", target, back)
    assert back.read_bytes() == stream.read_bytes()


def test_sound_that_begins_before_the_first_frame(run: Run, stream: Path, voice: Path) -> None:
    target = stream.with_suffix(".mp4")
    run("convert", stream, target, "--audio", voice, "--audio-offset", -0.5)
    with SoundFile(target) as sound:
        assert abs(len(sound.read(0, 10 * RATE)) / sound.rate - (SECONDS - 0.5)) < 0.1
        assert sound.start == 0


@pytest.mark.parametrize("frames", [1, 10, 60])
def test_sound_may_be_longer_and_shorter_than_the_stream(
    run: Run, tmp_path: Path, voice: Path, frames: int
) -> None:
    source, target = tmp_path / "part.fba", tmp_path / "part.mp4"
    source.write_bytes(encode_animation(replace(performance()[:frames], rate=Fraction(5)))[0])
    for fragment in ((), ("--fragment", 1)):
        run("convert", source, target, "--audio", voice, *fragment)
        assert len(fba.read(target)) == frames
        with SoundFile(target) as sound:
            assert abs(len(sound.read(0, 10 * RATE)) / sound.rate - SECONDS) < 0.15


def test_coded_sound_is_copied(run: Run, stream: Path, voice: Path, tmp_path: Path) -> None:
    first, second = tmp_path / "first.mp4", tmp_path / "second.mp4"
    for coding in ("aac", "opus"):
        run("convert", stream, first, "--audio", voice, "--audio-codec", coding, "--audio-offset", 0.25)
        run("convert", first, second, "--fragment", 1)  # its own sound goes along
        packets = read_coded_sound(first).packets
        assert len(packets) > 30
        assert read_coded_sound(second).packets == packets
        assert second.read_bytes().count(packets[5]) == 1
        assert abs(fit(second)[0] - 0.25) < 0.002
    run("convert", first, second, "--no-audio")
    assert len(list_tracks(second.read_bytes())) == 1
    run("convert", first, second, "--audio-codec", "aac")
    assert list_tracks(second.read_bytes())[1].coding == "AAC"


def test_all_commands_read_them(run: Run, stream: Path, tmp_path: Path) -> None:
    film = tmp_path / "film.mp4"
    run("convert", stream, film, "--no-audio")
    for command in ("verify", "stats"):
        of_stream, of_film = (json.loads(run(command, "--json", path).out) for path in (stream, film))
        assert {**of_film, "file": ""} == {**of_stream, "file": ""}
    listed = run("info", film).out
    assert (
        f"MP4, {film.stat().st_size} bytes\n  tracks   1: FBA, the stream of {stream.stat().st_size} bytes\n"
        in listed
    )
    report: dict[str, Any] = json.loads(run("info", "--json", film).out)
    assert (report["format"], report["file_size"]) == ("mp4", film.stat().st_size)
    assert [track["coding"] for track in report["tracks"]] == ["FBA"]
    assert report["bap_steps_choice"] == "visage: the stream says so"
    for path, name in ((stream, "a"), (film, "b")):
        run("decode", path, "--fap", tmp_path / f"{name}.fap", "--bap", tmp_path / f"{name}.bap")
        run("encode", path, "-o", tmp_path / f"{name}.fba")
        run("export", path, "-o", tmp_path / f"{name}.html", "--title", "x")
    for suffix in ("fap", "bap", "fba"):
        contents = [(tmp_path / f"{name}.{suffix}").read_bytes() for name in "ab"]
        assert contents[0].replace(b" talk ", b" film ") == contents[1]
    pages = [(tmp_path / f"{name}.html").read_text().replace("talk.fba", "film.mp4") for name in "ab"]
    assert pages[0] == pages[1]
    assert run("info", "--trace", film).out == run("info", "--trace", stream).out


def test_a_page_takes_the_sound_alone(run: Run, stream: Path, voice: Path, tmp_path: Path) -> None:
    film, page = tmp_path / "film.mp4", tmp_path / "film.html"
    run("convert", stream, film, "--audio", voice, "--audio-offset", 0.5)
    run("export", film, "-o", page)
    text = page.read_text()
    assert '"audio": "data:audio/mp4;base64,' in text
    assert '"audioOffset": 0.5' in text


def test_the_sound_of_the_file_comes_before_the_one_beside(
    run: Run, stream: Path, voice: Path, tmp_path: Path
) -> None:
    film = tmp_path / "voice.mp4"
    run("convert", stream, film, "--audio", voice)
    assert find_sound((film,), SoundOptions(), "without") == film
    assert find_sound((film,), SoundOptions(audio=voice), "without") == voice
    assert find_offset(voice, (film,), SoundOptions(audio_offset=2.0)) == 2
    run("convert", stream, film, "--no-audio")
    assert find_sound((film,), SoundOptions(), "without") == voice
    film.write_bytes(film.read_bytes()[:50])
    assert find_sound((film,), SoundOptions(), "without") == voice


def test_other_files_become_mp4_as_well(run: Run, tmp_path: Path, stream: Path) -> None:
    run("decode", stream, "--fap", tmp_path / "a.fap")
    run("convert", tmp_path / "a.fap", tmp_path / "a.mp4", "--fragment", 2)
    assert fba.read(tmp_path / "a.mp4").face == fba.read(tmp_path / "a.fap").face
    run("convert", stream, tmp_path / "b.mp4", "--fps", 10)
    assert fba.read(tmp_path / "b.mp4").rate == 10


def test_out_again_by_another_table_or_rate(run: Run, stream: Path, tmp_path: Path) -> None:
    film, back = tmp_path / "film.mp4", tmp_path / "back.fba"
    run("convert", stream, film)
    run("convert", film, back, "--no-mark")
    assert marked_table(back.read_bytes()) is None
    run("convert", film, back, "--fps", 10)
    assert fba.read(back).rate == 10
    unmarked = tmp_path / "unmarked.fba"
    run("convert", stream, unmarked, "--no-mark", "--bap-steps", "visage")
    run("convert", unmarked, film, "--bap-steps", "visage")
    assert marked_table(read_mp4(film.read_bytes()).stream) == "visage"


def test_of_several_streams_one_is_named(run: Run, stream: Path, tmp_path: Path) -> None:
    from fba.carriage.mp4 import split_samples

    planes = split_samples(encode_animation(performance(body=False)[:30])[0]).planes
    film = tmp_path / "two.mp4"
    film.write_bytes(whole_file(Track(planes), Track(planes[:9], number=3)))
    for command in (("info",), ("verify",), ("stats",), ("convert",)):
        more = [tmp_path / "out.fba"] if command == ("convert",) else []
        assert "several FBA tracks: 1, 3; choose one with --track 1" in run(*command, film, *more, code=1).err
    run("convert", film, tmp_path / "out.fba", "--track", 3)
    assert len(fba.read(tmp_path / "out.fba")) == 9
    assert json.loads(run("verify", "--json", film, "--track", 3).out)["frames"] == 9


def test_a_cut_file_is_salvaged(run: Run, stream: Path, tmp_path: Path) -> None:
    film = tmp_path / "cut.mp4"
    film.write_bytes(write_mp4(stream.read_bytes())[:-2000])
    assert "it was cut off, or is damaged" in run("convert", film, tmp_path / "out.fba", code=1).err
    assert "samples before it are read" in run("convert", film, tmp_path / "out.fba", "--salvage").err
    assert 0 < len(fba.read(tmp_path / "out.fba")) < len(fba.read(stream))


def test_options_that_do_not_fit(run: Run, stream: Path, voice: Path, tmp_path: Path) -> None:
    for option in (("--fragment", 2), ("--audio", voice), ("--audio-codec", "opus"), ("--no-audio",)):
        wrong = run("convert", stream, tmp_path / "a.fap", *option, code=2)
        assert f"{option[0]} is for MP4 files, and OUT becomes FAP" in wrong.err
    for option, text in (
        (("--fragment", "0s"), "out of reach"),
        (("--fragment", "2h"), "'h' is no unit of a length; they are s, ms"),
        (("--audio-offset", 2), "--audio-offset needs a sound"),
        (("--audio", voice, "--no-audio"), "contradict each other"),
        (("--mark",), "--mark is for streams"),
    ):
        assert text in run("convert", stream, tmp_path / "a.mp4", *option, code=2).err
    assert not (tmp_path / "a.mp4").exists()


def test_a_film_is_no_stream(run: Run, voice: Path, tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    film = tmp_path / "film.mp4"
    with av.open(str(film), "w") as container:
        pictures = container.add_stream("mpeg4", rate=25)
        pictures.width = pictures.height = 32
        for _ in range(5):
            container.mux(pictures.encode(av.VideoFrame(32, 32, "yuv420p")))
        container.mux(pictures.encode(None))
    failed = run("info", film, code=1)
    assert f"{film}: the MP4 file has no FBA track; its tracks: 1: video mp4v" in failed.err
    shutil.copy(voice, tmp_path / "voice.mp4")
    run("info", tmp_path / "voice.mp4", code=1)
