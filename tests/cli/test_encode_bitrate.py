"""`fba encode --bitrate`: what it prints, what it refuses, and that the file keeps what it promises."""

import json
from pathlib import Path

import numpy as np
import pytest

import fba
from command_line import Run
from fba import Animation, FaceTrack
from fba.parameters import fap_steps


@pytest.fixture(scope="module")
def talk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A FAP file: a mouth that opens and smiles on both sides alike, and a head that turns."""
    time = np.arange(80) / 25
    values = np.zeros((80, 68))
    values[:, 2] = np.abs(800 * np.sin(7 * time))
    values[:, [11, 12, 58, 59]] = (200 * np.sin(5 * time))[:, None]
    values[:, 18] = 1000 * (np.arange(80) % 30 < 3)
    values[:, 48] = 20_000 * np.sin(2 * time)
    rounded = (np.rint(values / fap_steps()) * fap_steps()).astype(np.int32)
    mask = np.tile(rounded.any(axis=0), (80, 1))
    path = tmp_path_factory.mktemp("talk") / "talk.fap"
    fba.write(path, Animation(25, np.arange(80), FaceTrack(rounded, mask)))
    return path


def test_a_stream_at_a_rate(run: Run, talk: Path, tmp_path: Path) -> None:
    done = run("encode", talk, "-o", tmp_path / "a.fba", "--bitrate", "600bit/s", "--json")
    assert done.err == ""
    said = json.loads(done.out)["bitrate"]
    assert (said["bits_per_second"], said["buffer"]) == (600, 1)
    assert said["most_ahead"] <= 1
    assert 8 * (tmp_path / "a.fba").stat().st_size <= 600 * (80 / 25 + 1)
    source, decoded = fba.read(talk), fba.read(tmp_path / "a.fba")
    assert said["frames_left_out"] == len(source) - len(decoded)
    shown = np.interp(source.index, decoded.index, decoded.face.values[:, 48])
    off = np.abs(shown - source.face.values[:, 48]).max()
    assert off == pytest.approx(said["parameters"]["FAP 49 head_yaw"]["largest"])
    assert said["face"]["head_degrees"] == pytest.approx(np.degrees(1e-5 * off), rel=1e-3)


def test_the_report_of_a_bit_rate(run: Run, talk: Path, tmp_path: Path) -> None:
    done = run("encode", talk, "-o", tmp_path / "a.fba", "--bitrate", "0.7kbit/s", "--buffer", "900ms")
    first, held, face, units = done.out.splitlines()
    assert first.startswith(str(tmp_path / "a.fba"))
    assert held.startswith("held to 700 bit/s: at most 0.")
    assert "s ahead, of 0.9 s; quantiser" in held
    assert face.startswith("face: vertices move by at most ")
    assert units.startswith("off at most, in units: FAP ")
    ample = run("encode", talk, "-o", tmp_path / "a.fba", "--bitrate", "20kbit/s").out.splitlines()
    assert ample[2:] == ["nothing that is sent is off"]


def test_too_few_bits_for_an_i_plane(run: Run, talk: Path, tmp_path: Path) -> None:
    done = run("encode", talk, "-o", tmp_path / "a.fba", "--bitrate", "50", code=1)
    assert "an I plane takes " in done.err
    assert "give a rate of at least --bitrate " in done.err
    assert "or a buffer of at least --buffer " in done.err
    assert not (tmp_path / "a.fba").exists()


@pytest.mark.parametrize(
    ("given", "answer"),
    [
        (["--bitrate", "fast"], "'fast' is no bit rate; write e.g. 1500 or 1.5kbit/s"),
        (["--bitrate", "15mph"], "'mph' is no unit of a bit rate; they are bit/s, kbit/s, Mbit/s"),
        (["--bitrate", "0"], "0 is out of reach"),
        (["--bitrate", "-5"], "-5 is out of reach"),
        (["--bitrate", "nan"], "'nan' is no bit rate"),
        (["--bitrate", "1e12"], "1e12 is out of reach"),
        (["--bitrate", "900", "--buffer", "1min"], "'min' is no unit of a buffer; they are s, ms"),
        (["--buffer", "1s"], "--buffer goes with --bitrate"),
        (["--bitrate", "900", "--quant", "3"], "--quant and --bitrate contradict each other"),
        (["--bitrate", "900", "--preset", "reference"], "--preset and --bitrate contradict each other"),
        (["--bitrate", "900", "--tolerance", "1mm"], "--bitrate and --tolerance contradict each other"),
        (["--bitrate", "900", "--intra-period", "1"], "--intra-period and --bitrate contradict each other"),
    ],
)
def test_invalid_bit_rates_are_refused(
    run: Run, talk: Path, tmp_path: Path, given: list[str], answer: str
) -> None:
    assert answer in " ".join(run("encode", talk, "-o", tmp_path / "a.fba", *given, code=2).err.split())
    assert not (tmp_path / "a.fba").exists()
