"""`fba encode` of a face, a body and a voice that were recorded at one moment."""

import json
import wave
from pathlib import Path

import numpy as np
import pytest

import fba
from command_line import Run
from fba import Animation
from sound_clicks import write_click
from tools.captures.face_files import ANGLES, UDP_ORDER, livelink_csv

START = 67_739.5
"""Time of day of the first row, 18:48:59:30."""


@pytest.fixture
def table(tmp_path: Path) -> Path:
    """Two seconds in which the jaw opens."""
    columns = {name: np.zeros(120) for name in [*UDP_ORDER, *ANGLES]}
    columns |= {"JawOpen": np.linspace(0, 1, 120), "HeadYaw": np.full(120, 0.1)}
    columns["LeftEyeYaw"] = columns["RightEyeYaw"] = np.full(120, 0.1)
    path = tmp_path / "face.csv"
    path.write_text(livelink_csv(columns, start=START, step=1 / 60))
    return path


@pytest.fixture
def bap(tmp_path: Path, body: Animation) -> Path:
    """Two seconds at 25 frames a second."""
    path = tmp_path / "body.bap"
    fba.write(path, body)
    return path


def test_face_and_body(run: Run, table: Path, bap: Path, tmp_path: Path) -> None:
    out = tmp_path / "both.fba"
    done = run("encode", table, bap, "-o", out, "--offset", "0.5", "--no-mark")
    spans = f"{table} 0.00 to 2.00 s, {bap} 0.50 to 2.47 s; both from 0.50 to 2.00 s"
    assert f"together, by --offset: {spans}" in done.out
    assert f"{bap}: 25 frames/s, interpolated at 60" in done.out
    both = fba.read(out, bap_steps="visage")
    assert (both.rate, len(both)) == (60, 148)
    report = json.loads(run("encode", table, bap, "-o", out, "--trim", "--offset", "-0.5", "--json").out)
    assert report["sync"] == "offset"
    assert report["parts"][0] == {"file": str(table), "begins": 0.5, "ends": 2.5}
    assert (report["parts"][1]["file"], report["frames"]) == (str(bap), 88)
    assert "both from the start on" in run("encode", table, bap, "-o", out).out


def test_the_body_begins_at_a_time_code(run: Run, table: Path, bap: Path, tmp_path: Path) -> None:
    for code in ("18:49:00:00", "18:49:00.000"):
        done = run("encode", table, bap, "-o", tmp_path / "a.fba", "--offset", code)
        assert f"together, by their time codes: {table} 0.00 to 2.00 s, {bap} 0.50 to 2.47 s" in done.out
    done = run("encode", table, bap, "-o", tmp_path / "a.fba", "--sync", "timecode")
    assert "no time code in" in done.err
    assert "both begin together; say when the second one begins with --offset 2.4" in done.err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--offset", "18:50:00:00"), "share no moment; let both begin together with --sync offset"),
        (("--offset", "18:50:00:60"), "no time of day"),
        (("--offset", "soon"), "neither a number of seconds nor a time code"),
        (("--offset", "18:61:00:00"), "no time of day"),
        (("--sync", "timecode", "--offset", "1"), "contradict each other"),
        (("--sync", "offset", "--offset", "18:49:00:00"), "contradict each other"),
    ],
)
def test_impossible_options_are_refused(
    run: Run, table: Path, bap: Path, tmp_path: Path, options: tuple[str, ...], message: str
) -> None:
    done = run("encode", table, bap, "-o", tmp_path / "a.fba", *options, code=None)
    assert done.code in (1, 2)
    assert message in done.err
    assert not (tmp_path / "a.fba").exists()


def test_two_faces_and_one_input(run: Run, table: Path, tmp_path: Path) -> None:
    assert "a second face file" in run("encode", table, table, "-o", tmp_path / "a.fba", code=2).err
    assert (
        "--sync is for two inputs"
        in run("encode", table, "-o", tmp_path / "a.fba", "--sync", "timecode", code=2).err
    )


def test_a_report_compares_what_the_body_covers(run: Run, table: Path, bvh: Path, tmp_path: Path) -> None:
    """The body is three frames at 10 frames a second; with --trim, its first 0.1 s are left out."""
    for offset, options in (("1.0", ()), ("-0.1", ("--trim",))):
        done = run("encode", table, bvh, "-o", tmp_path / "a.fba", "--offset", offset, "--report", *options)
        frames = 13 if not options else 7
        assert f"{bvh}: {frames} frames beside the source" in done.out
        line = next(line for line in done.out.splitlines() if line.strip().startswith("direction"))
        assert float(line.split()[-4]) < 3.0, line


def bext(path: Path, seconds: float) -> None:
    """Add the chunk of a broadcast WAV file that says when it was recorded."""
    data = path.read_bytes()
    rate = int.from_bytes(data[24:28], "little")
    body = bytes(320) + b"2026-01-01" + b"18:48:59" + round(seconds * rate).to_bytes(8, "little") + bytes(256)
    chunk = b"bext" + len(body).to_bytes(4, "little") + body
    size = (len(data) + len(chunk) - 8).to_bytes(4, "little")
    path.write_bytes(data[:4] + size + data[8:36] + chunk + data[36:])


def click(path: Path) -> tuple[float, float]:
    """Return when a sound clicks, and how long it is, in seconds."""
    with wave.open(str(path)) as file:
        samples = np.frombuffer(file.readframes(file.getnframes()), "<i2")
        return float(np.argmax(samples > 9000)) / file.getframerate(), file.getnframes() / file.getframerate()


def test_a_voice(run: Run, table: Path, tmp_path: Path) -> None:
    voice = write_click(tmp_path / "speech.wav", 1.0, seconds=3.0)
    out = tmp_path / "talk.fba"
    done = run("encode", table, "-o", out, "--audio", voice)
    assert f"{tmp_path / 'talk.wav'}: 2.00 s of {voice}, from 0.00 s on, both from the start on" in done.out
    assert click(tmp_path / "talk.wav") == pytest.approx((1.0, 2.0), abs=1e-3)
    done = run("encode", table, "-o", out, "--audio", voice, "--audio-offset", "-0.25", "--json")
    assert json.loads(done.out)["sound"]["begins"] == -0.25
    assert click(tmp_path / "talk.wav") == pytest.approx((0.75, 2.0), abs=1e-3)
    bext(voice, START + 0.5)
    done = run("encode", table, "-o", out, "--audio", voice)
    assert "after 0.50 s of silence, by time codes" in done.out
    assert click(tmp_path / "talk.wav") == pytest.approx((1.5, 2.0), abs=1e-3)


def test_a_voice_whose_program_knew_no_time(run: Run, table: Path, tmp_path: Path) -> None:
    voice = write_click(tmp_path / "speech.wav", 0.5)
    bext(voice, 0.0)
    done = run("encode", table, "-o", tmp_path / "talk.fba", "--audio", voice)
    assert "both from the start on" in done.out


def test_voices_that_do_not_fit(run: Run, table: Path, tmp_path: Path) -> None:
    voice = write_click(tmp_path / "talk.wav", 0.1)
    bext(voice, START + 60)
    for options, message in (
        (("-o", tmp_path / "talk.fba", "--audio", voice), "is beside"),
        (("-o", "-", "--audio", voice), "give the stream a name with -o"),
        (("-o", tmp_path / "a.fba", "--audio-offset", "1"), "--audio-offset needs a sound"),
        (("-o", tmp_path / "a.fba", "--audio", table), "cannot be read as sound"),
        (("-o", tmp_path / "a.fba", "--audio", voice), "lasts from 18:49:59.50 to 18:50:00.50, and"),
    ):
        done = run("encode", table, *options, code=None)
        assert done.code in (1, 2)
        assert message in done.err
    assert not (tmp_path / "a.wav").exists()
