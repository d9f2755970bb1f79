"""`fba speak` and `fba decode --visemes`: what is written, and what is said of bad input."""

import contextlib
import importlib.util
import json
import shutil
import subprocess
import sys
import wave
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pytest

import fba
from command_line import Run
from fba.face import resolve
from sound_clicks import babble, write_wave

CTM = "map 1 0.00 0.10 M\nmap 1 0.10 0.30 AE\nmap 1 0.40 0.10 P\n"
needs_voice = pytest.mark.skipif(
    shutil.which("flite") is None or importlib.util.find_spec("pocketsphinx") is None,
    reason="flite and pocketsphinx are needed, and not both are installed",
)
needs_recogniser = pytest.mark.skipif(
    importlib.util.find_spec("pocketsphinx") is None, reason="pocketsphinx is not installed"
)


@pytest.fixture
def timings(tmp_path: Path) -> Path:
    path = tmp_path / "map.ctm"
    path.write_text(CTM, encoding="utf-8")
    return path


@pytest.mark.parametrize("coding", ["visemes", "faps"])
def test_timings_become_a_stream(coding: str, run: Run, timings: Path, tmp_path: Path) -> None:
    done = run("speak", "--timings", timings, "--coding", coding, "--life", 0, "-o", tmp_path / "map.fba")
    assert done.err == ""
    assert "map.fba: 0.50 s" in done.out
    assert bool(fba.read(tmp_path / "map.fba").face.mask[:, 0].any()) == (coding == "visemes")


def test_every_sound_is_kept_where_that_is_asked(run: Run, tmp_path: Path) -> None:
    phones = ["HH", "AH", "L", "OW", "W", "ER", "L", "D", "AY", "S", "IY", "Y", "UW"]
    dense = tmp_path / "dense.ctm"
    dense.write_text("".join(f"it 1 {n * 0.08:.2f} 0.08 {name}\n" for n, name in enumerate(phones)))
    frames = []
    for more in ([], ["--every-sound"]):
        run("speak", "--timings", dense, "--life", 0, *more, "-o", tmp_path / "it.fba")
        frames.append(len(fba.read(tmp_path / "it.fba")))
    assert frames[1] > frames[0]


@pytest.mark.parametrize("suffix", ["json", "TextGrid"])
def test_visemes_come_back(suffix: str, run: Run, timings: Path, tmp_path: Path) -> None:
    stream, written = tmp_path / "map.fba", tmp_path / f"map.{suffix}"
    run("speak", "--timings", timings, "--coding", "visemes", "-o", stream)
    run("decode", stream, "--visemes", written)
    again = tmp_path / "again.fba"
    run("speak", "--timings", written, "--coding", "visemes", "-o", again)
    if suffix == "json":
        numbers = [each["number"] for each in json.loads(written.read_text(encoding="utf-8"))["visemes"]]
        assert [number for number in numbers if number] == [1, 10, 1]


def test_curves_of_arkit_are_the_motion_of_the_mouth(run: Run, timings: Path, tmp_path: Path) -> None:
    first, curves, again = (tmp_path / name for name in ("map.fba", "map.csv", "again.fba"))
    run("speak", "--timings", timings, "--life", 0, "-o", first)
    run("convert", first, curves, "--fps", 60)
    run("speak", "--timings", curves, "--life", 1, "-o", again)
    meant, shown = (fba.read(path).resample(25).face for path in (first, again))
    count = min(len(meant), len(shown))
    jaws, gaps = (np.array([resolve(each)[:count, column] for each in (meant, shown)]).T for column in (2, 3))
    assert np.corrcoef(jaws.T)[0, 1] > 0.95
    assert np.corrcoef(gaps.T)[0, 1] > 0.9
    done = run("speak", "--timings", curves, "--coding", "visemes", "--json", "-o", again)
    assert "visemes are guessed from the motion of its mouth" in done.err
    names = [phone["name"] for phone in json.loads(done.out)["phones"]]
    assert (names[0], "AA" in names, names[-1]) == ("SIL", True, "SIL"), "shut, open, shut"


def test_a_stream_without_visemes_has_none_to_write(run: Run, timings: Path, tmp_path: Path) -> None:
    run("speak", "--timings", timings, "-o", tmp_path / "map.fba")
    done = run("decode", tmp_path / "map.fba", "--visemes", tmp_path / "map.json", code=2)
    assert "sends no visemes (FAP 1)" in done.err
    assert not (tmp_path / "map.json").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "say what is spoken"),
        (["--text", "a", "--text-file", "{ctm}"], "--text and --text-file both give the text"),
        (["--timings", "{ctm}", "--text", "a"], "--timings says what is spoken when; leave --text out"),
        (["--timings", "{ctm}", "--voice", "flite"], "--voice speaks a text that has no recording"),
        (["--timings", "{ctm}", "--style", "2"], "is not in the range"),
        (["--timings", "{ctm}", "--mood", "happy", "--coding", "visemes"], "use it with --coding faps"),
        (["--timings", "{ctm}", "--mood", "hapy"], "did you mean 'happy'"),
        (["--timings", "{ctm}", "--mood", "happy=lots"], "--mood: "),
        (["--audio", "-", "--text", "a"], "--audio - is spoken while it comes, and --text needs all of it"),
        (["--audio", "-", "--timings", "{ctm}"], "and --timings needs all of it"),
        (["--audio", "-", "--coding", "visemes"], "leave --coding visemes out"),
        (["--timings", "{ctm}", "--pcm", "8000"], "--pcm goes with --audio -"),
        (["--text", "hello", "-o", "-"], "give the stream a name with -o"),
    ],
)
def test_mistakes_are_told(arguments: list[str], said: str, run: Run, timings: Path, tmp_path: Path) -> None:
    given = [each.replace("{ctm}", str(timings)) for each in arguments]
    target = [] if "-o" in given else ["-o", tmp_path / "out.fba"]
    assert said in run("speak", *given, *target, code=2).err
    assert not (tmp_path / "out.fba").exists()


def test_a_mood_moves_the_brows(run: Run, timings: Path, tmp_path: Path) -> None:
    target = tmp_path / "sad.fba"
    run("speak", "--timings", timings, "--life", 0, "--mood", "sad=80", "-o", target)
    assert fba.read(target).face.values[:, 30].any()


@needs_voice
def test_a_text_is_spoken_and_its_sound_lies_beside_it(run: Run, tmp_path: Path) -> None:
    target = tmp_path / "hello.fba"
    done = run(
        "speak", "--text", "Bob put five maps by the moon.", "--voice", "flite", "-o", target, "--json"
    )
    figures = json.loads(done.out)
    assert [word["text"] for word in figures["words"]] == ["bob", "put", "five", "maps", "by", "the", "moon"]
    with wave.open(str(tmp_path / "hello.wav")) as sound:
        assert sound.getnframes() / sound.getframerate() == pytest.approx(figures["seconds"], abs=0.01)
    assert fba.read(target).duration == pytest.approx(figures["seconds"], abs=0.1)


def test_no_voice_on_the_machine_is_told(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    done = run("speak", "--text", "hello", "-o", tmp_path / "out.fba", code=1)
    assert "install flite or espeak-ng" in done.err
    assert list(tmp_path.iterdir()) == []


@needs_recogniser
@pytest.mark.parametrize(
    ("name", "samples", "settings"),
    [
        ("silence", np.zeros(16000), {}),
        ("stereo", np.zeros(32000), {"channels": 2}),
        ("24 bits", bytes(3 * 96000), {"rate": 96000, "width": 3}),
        ("telephone", np.zeros(8000), {"rate": 8000}),
    ],
)
def test_silence_of_any_kind_is_a_face_at_rest(
    name: str, samples: Any, settings: dict[str, int], run: Run, tmp_path: Path
) -> None:
    sound = write_wave(tmp_path / "sound.wav", samples, **settings)
    done = run("speak", "--audio", sound, "-o", tmp_path / "out.fba")
    assert "no speech is heard in it; the face stays at rest" in done.err


@needs_recogniser
def test_clipped_sound_is_told(run: Run, tmp_path: Path) -> None:
    tone = 60000 * np.sin(np.arange(32000) * 0.05) * (np.arange(32000) % 4000 > 1500)
    sound = write_wave(tmp_path / "loud.wav", np.clip(tone, -32768, 32767))
    done = run("speak", "--audio", sound, "-o", tmp_path / "out.fba")
    assert "clipped" in done.err or "no speech is heard" in done.err


@needs_recogniser
@pytest.mark.parametrize(
    ("content", "said"), [(b"", "is empty (0 bytes)"), (b"hello there" * 99, "cannot be read as sound")]
)
def test_what_is_no_sound_is_refused(content: bytes, said: str, run: Run, tmp_path: Path) -> None:
    sound = tmp_path / "sound.wav"
    sound.write_bytes(content)
    assert said in run("speak", "--audio", sound, "-o", tmp_path / "out.fba", code=1).err
    assert not (tmp_path / "out.fba").exists()


def test_text_files_in_other_encodings_are_refused(run: Run, tmp_path: Path) -> None:
    text = tmp_path / "text.txt"
    text.write_bytes(b"caf\xe9")
    done = run("speak", "--text-file", text, "-o", tmp_path / "out.fba", code=1)
    assert "is not UTF-8 text (byte 3)" in done.err


@pytest.fixture
def pipe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[BinaryIO]:
    """Standard input; what is written into it is read."""
    with (tmp_path / "pipe").open("wb", buffering=0) as file, (tmp_path / "pipe").open("rb") as given:
        monkeypatch.setattr(sys, "stdin", given)
        yield file


@pytest.mark.parametrize("rate", [8000, 16000])
def test_what_comes_on_standard_input_is_spoken(rate: int, run: Run, pipe: BinaryIO, tmp_path: Path) -> None:
    pipe.write(write_wave(tmp_path / "sound.wav", babble(2.0), rate).read_bytes())
    target = tmp_path / "live.fba"
    done = run("speak", "--audio", "-", "-o", target, "--mood", "sad", "--json")
    figures = json.loads(done.out)
    assert figures["seconds"] == pytest.approx(32000 / rate, abs=0.01)
    spoken = fba.read(target)
    assert len(spoken) == figures["frames"] == np.ceil(25 * figures["seconds"])
    assert spoken.face is not None
    assert np.ptp(resolve(spoken.face)[:, 2]) > 20, "the jaw does not move"
    assert target.stat().st_size == figures["size"]


@pytest.mark.parametrize(
    ("data", "more", "said"),
    [
        (b"", [], "standard input: the sound is empty: nothing came"),
        (b"x", ["--pcm", "16000"], "the sound is empty: it has no samples"),
        (b"this is no sound at all", [], "say the rate: `fba speak --audio - --pcm 16000`"),
        (b"fLaC" + bytes(50), [], "the sound is FLAC, and only WAV"),
        (b"1234", ["--pcm", "16000", "--fps", "5"], "needs 10 frames/s or more"),
    ],
)
def test_what_is_no_sound_on_standard_input_is_refused(
    data: bytes, more: list[str], said: str, run: Run, pipe: BinaryIO, tmp_path: Path
) -> None:
    pipe.write(data)
    assert said in run("speak", "--audio", "-", "-o", tmp_path / "out.fba", *more, code=1).err
    assert not (tmp_path / "out.fba").exists()


def test_a_reader_that_leaves_ends_it(programs: Path) -> None:
    command = [programs / "fba", "speak", "--audio", "-", "--pcm", "16000", "-o", "-"]
    pipe, sound = subprocess.PIPE, babble(2.0).tobytes()
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, bufsize=0) as done:
        done.stdin.write(sound)
        assert done.stdout.read(100)
        done.stdout.close()
        with contextlib.suppress(BrokenPipeError):
            while done.stdin.write(sound):
                pass
        assert b"Traceback" not in done.stderr.read()
    assert done.returncode == 0
