"""`fba encode --bitrate` and `--tolerance`: what they print and refuse; files keep their promise."""

import json
from pathlib import Path

import numpy as np
import pytest

import fba
from command_line import Run
from fba import Animation, FaceTrack
from fba.face import Deformer, FaceModel, resolve
from fba.parameters import fap_steps


@pytest.fixture(scope="module")
def talk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A FAP file: a mouth that opens, a smile, and a head that turns."""
    time = np.arange(60) / 25
    values = np.zeros((60, 68))
    values[:, 2] = np.abs(200 * np.sin(7 * time))  # open_jaw
    values[:, [11, 12, 58, 59]] = (60 * np.sin(3 * time))[:, None]
    values[:, 48] = 9000 * np.sin(2 * time)
    mask = np.tile(values.any(axis=0), (60, 1))
    step = np.array([1, 1, *(one.step for one in fba.parameters.faps()[2:])])
    faps = FaceTrack((np.rint(values / step) * step).astype(np.int32), mask)
    path = tmp_path_factory.mktemp("talk") / "talk.fap"
    fba.write(path, Animation(25, np.arange(60), faps))
    return path


def test_the_file_keeps_what_is_printed(run: Run, talk: Path, tmp_path: Path) -> None:
    done = run("encode", talk, "-o", tmp_path / "a.fba", "--tolerance", "0.05cm", "--json")
    assert done.err == ""
    near = json.loads(done.out)["tolerance"]
    assert 0.3 < near["face"]["largest_mm"] <= 0.5
    run("decode", tmp_path / "a.fba", "--fap", tmp_path / "b.fap")
    source, decoded = fba.read(talk), fba.read(tmp_path / "b.fap")
    assert decoded.face is not None
    assert source.face is not None
    assert near["frames_left_out"] == len(source) - len(decoded) > 0
    shown = resolve(decoded.face).astype(float)
    shown = np.stack([np.interp(source.index, decoded.index, one) for one in shown.T], axis=1)
    deformer = Deformer(FaceModel.default())
    moved = deformer.local(resolve(source.face)).astype(float) - deformer.local(shown)
    assert np.linalg.norm(moved, axis=2).max() * 1000 == pytest.approx(near["face"]["largest_mm"], abs=1e-4)


def test_the_report_of_a_tolerance(run: Run, talk: Path, tmp_path: Path) -> None:
    done = run("encode", talk, "-o", tmp_path / "a.fba", "--tolerance", "500 um")
    size, face, left_out = done.out.splitlines()
    assert size.startswith(str(tmp_path / "a.fba"))
    assert face.startswith("face: vertices move by at most 0.4")
    assert "of 60 frames are not sent" in left_out
    every = run("encode", talk, "-o", tmp_path / "a.fba", "--tolerance", "0.5mm", "--every-frame").out
    assert "60 frames, " in every
    assert "not sent" not in every
    exact = run("encode", talk, "-o", tmp_path / "a.fba", "--tolerance", "0.000001mm").out
    assert "face: no vertex moves; head within 0" in exact


@pytest.mark.parametrize(
    ("given", "answer"),
    [
        ("0.5", "0.5 has no unit; write 0.5mm, 0.5cm or 0.5um"),
        ("-1mm", "-1mm is not positive"),
        ("0mm", "0mm is not positive"),
        ("3ft", "'ft' is not a unit of a tolerance; use mm, cm or um"),
        ("small", "'small' is not a length; write a number and its unit, as 0.5mm"),
        ("1e999mm", "'1e999mm' is not a length"),
    ],
)
def test_invalid_lengths(run: Run, talk: Path, tmp_path: Path, given: str, answer: str) -> None:
    done = run("encode", talk, "-o", tmp_path / "a.fba", f"--tolerance={given}", code=2)
    assert answer in " ".join(done.err.split())
    assert not (tmp_path / "a.fba").exists()


@pytest.mark.parametrize(
    "options", [("--preset", "exact"), ("--quant", 3), ("--bap-quant", 3), ("--unsent", "keep")]
)
def test_options_that_contradict_a_tolerance(
    run: Run, talk: Path, tmp_path: Path, options: tuple[str, ...]
) -> None:
    done = run("encode", talk, "-o", tmp_path / "a.fba", "--tolerance", "1mm", *options, code=2)
    assert f"{options[0]} and --tolerance contradict each other" in " ".join(done.err.split())


def test_a_tolerance_on_the_vertices_of_another_head(run: Run, talk: Path, tmp_path: Path) -> None:
    alone = run("encode", talk, "-o", tmp_path / "a.fba", "--every-frame", code=2)
    assert "--every-frame goes with --tolerance" in alone.err
    FaceModel.default().save(tmp_path / "head.glb")
    sizes = []
    for options in ((), ("--model", tmp_path / "head.glb")):
        assert run("encode", talk, "-o", tmp_path / "a.fba", "--tolerance", "0.5mm", *options).err == ""
        sizes.append((tmp_path / "a.fba").stat().st_size)
    assert sizes[0] == pytest.approx(sizes[1], rel=0.05)


@pytest.fixture(scope="module")
def gesture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A BAP file: a left arm that is raised and bent."""
    values = np.zeros((30, 296), dtype=np.int32)
    values[:, 31] = np.rint(40_000 * np.sin(np.arange(30) / 7))  # l_shoulder_flexion
    values[:, 37] = np.rint(-30_000 * np.sin(np.arange(30) / 9))  # l_elbow_flexion
    mask = np.tile(values.any(axis=0), (30, 1))
    path = tmp_path_factory.mktemp("gesture") / "gesture.bap"
    fba.write(path, Animation(25, np.arange(30), None, fba.BodyTrack(values, mask)))
    return path


def test_a_body_stays_within_its_own_tolerance(run: Run, gesture: Path, tmp_path: Path) -> None:
    sizes = []
    for given in (("--tolerance", "0.5mm"), ("--body-tolerance", "3mm")):
        done = run("encode", gesture, "-o", tmp_path / "a.fba", "--bap-steps", "visage", *given, "--json")
        assert done.err == ""
        found = json.loads(done.out)
        limit = 10.0 if given[0] == "--tolerance" else 3.0
        assert 0.5 * limit < found["tolerance"]["body"]["largest_mm"] <= limit
        assert found["tolerance"]["body"]["foot_mm"] == 0.0
        assert found["tolerance"]["body"]["share_within"] == 1.0
        assert "face" not in found["tolerance"]
        sizes.append(found["size"])
    assert sizes[0] < sizes[1]


def test_the_report_of_a_body_tolerance(run: Run, gesture: Path, tmp_path: Path) -> None:
    given = ("-o", tmp_path / "a.fba", "--bap-steps", "visage", "--body-tolerance")
    body, left_out = run("encode", gesture, *given, "1cm").out.splitlines()[1:3]
    assert body.startswith("body: points 3 cm from joints move by at most ")
    assert "feet that stand by at most 0.00 mm" in body
    assert "of 30 frames are not sent" in left_out
    assert "quantiser of BAPs" in left_out
    done = run("encode", gesture, *given, "0.01mm", code=1)
    assert "no quantiser keeps the body within 0.01 mm" in done.err
    done = run("encode", gesture, *given, "1cm", "--bap-quant", "2", code=2)
    assert "--bap-quant and --body-tolerance contradict each other" in " ".join(done.err.split())


@pytest.mark.slow
def test_a_capture_is_compared_with_the_frames_that_players_fill_in(run: Run, tmp_path: Path) -> None:
    lines = (Path(fba.__file__).parent / "samples" / "hello.bvh").read_text().splitlines()
    first = lines.index("MOTION") + 3
    lines[first - 2] = "Frames: 80"
    (tmp_path / "short.bvh").write_text("\n".join(lines[: first + 80]) + "\n")
    given = ("--fps", "12", "--body-tolerance", "2cm", "--json")
    found = json.loads(run("encode", tmp_path / "short.bvh", "-o", tmp_path / "a.fba", *given).out)
    assert found["tolerance"]["frames_left_out"] > 5
    assert found["tolerance"]["body"]["largest_mm"] <= 20.0
    assert found["verdict"] == "good"


def test_tolerances_must_fit_the_parts_of_the_input(
    run: Run, talk: Path, gesture: Path, tmp_path: Path
) -> None:
    given = ("-o", tmp_path / "a.fba", "--bap-steps", "visage", "--body-tolerance", "1cm")
    done = run("encode", talk, *given, code=2)
    assert "--body-tolerance is for bodies, and the input has none" in " ".join(done.err.split())
    done = run("encode", talk, gesture, *given, code=2)
    assert "give --tolerance for it as well" in " ".join(done.err.split())
    assert not (tmp_path / "a.fba").exists()


@pytest.fixture(scope="module")
def loud_talk(tmp_path_factory: pytest.TempPathFactory) -> Path:
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


def test_a_stream_at_a_rate(run: Run, loud_talk: Path, tmp_path: Path) -> None:
    done = run("encode", loud_talk, "-o", tmp_path / "a.fba", "--bitrate", "600bit/s", "--json")
    assert done.err == ""
    said = json.loads(done.out)["bitrate"]
    assert (said["bits_per_second"], said["buffer"]) == (600, 1)
    assert said["most_ahead"] <= 1
    assert 8 * (tmp_path / "a.fba").stat().st_size <= 600 * (80 / 25 + 1)
    source, decoded = fba.read(loud_talk), fba.read(tmp_path / "a.fba")
    assert said["frames_left_out"] == len(source) - len(decoded)
    shown = np.interp(source.index, decoded.index, decoded.face.values[:, 48])
    off = np.abs(shown - source.face.values[:, 48]).max()
    assert off == pytest.approx(said["parameters"]["FAP 49 head_yaw"]["largest"])
    assert said["face"]["head_degrees"] == pytest.approx(np.degrees(1e-5 * off), rel=1e-3)


def test_the_report_of_a_bit_rate(run: Run, loud_talk: Path, tmp_path: Path) -> None:
    done = run("encode", loud_talk, "-o", tmp_path / "a.fba", "--bitrate", "0.7kbit/s", "--buffer", "900ms")
    first, held, face, units = done.out.splitlines()
    assert first.startswith(str(tmp_path / "a.fba"))
    assert held.startswith("held to 700 bit/s: at most 0.")
    assert "s ahead, of 0.9 s; quantiser" in held
    assert face.startswith("face: vertices move by at most ")
    assert units.startswith("off at most, in units: FAP ")
    ample = run("encode", loud_talk, "-o", tmp_path / "a.fba", "--bitrate", "20kbit/s").out.splitlines()
    assert ample[2:] == ["nothing that is sent is off"]


def test_too_few_bits_for_an_i_plane(run: Run, loud_talk: Path, tmp_path: Path) -> None:
    done = run("encode", loud_talk, "-o", tmp_path / "a.fba", "--bitrate", "50", code=1)
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
    run: Run, loud_talk: Path, tmp_path: Path, given: list[str], answer: str
) -> None:
    assert answer in " ".join(run("encode", loud_talk, "-o", tmp_path / "a.fba", *given, code=2).err.split())
    assert not (tmp_path / "a.fba").exists()
