"""encode, decode, convert, info, stats, bench, conformance on files made here."""

import json
import shlex
import sys
from fractions import Fraction
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import fba
from command_line import Run, pipe_in
from fba import Animation, FaceTrack


@pytest.fixture
def face_file(tmp_path: Path, face: Animation) -> Path:
    path = tmp_path / "face.fap"
    fba.write(path, face)
    return path


@pytest.fixture
def body_file(tmp_path: Path, body: Animation) -> Path:
    path = tmp_path / "body.bap"
    fba.write(path, body)
    return path


def test_encode_and_decode(run: Run, tmp_path: Path, face_file: Path, face: Animation) -> None:
    stream, back = tmp_path / "face.fba", tmp_path / "back.fap"
    _, out, err = run("encode", face_file, "-o", stream)
    assert err == ""
    size = stream.stat().st_size
    assert out == (
        f"{stream}: 50 frames, 2.00 s at 25 frames/s, {size} bytes, {8 * size / 2000:.2f} kbit/s, 1 I plane\n"
    )
    assert run("decode", stream, "--fap", back)[1:] == (f"{stream}: 50 frames to {back}\n", "")
    assert fba.read(back) == face


def test_face_and_body_become_one_stream(
    run: Run, tmp_path: Path, face_file: Path, body_file: Path, face: Animation, body: Animation
) -> None:
    stream = tmp_path / "both.fba"
    run("encode", body_file, face_file, "-o", stream)
    both = fba.read(stream)
    assert both.face == face.face
    assert both.body == body.body
    run("decode", stream, "--fap", tmp_path / "f.fap", "--bap", tmp_path / "b.bap")
    assert fba.read(tmp_path / "b.bap") == body


def test_two_faces_are_bad_usage(run: Run, tmp_path: Path, face_file: Path) -> None:
    assert "second face file" in run("encode", face_file, face_file, "-o", tmp_path / "x.fba", code=2).err
    assert not (tmp_path / "x.fba").exists()


def test_different_rates_need_fps(run: Run, tmp_path: Path, face_file: Path, body: Animation) -> None:
    slow = tmp_path / "slow.bap"
    fba.write(slow, body.resample(10))
    assert "--fps" in run("encode", face_file, slow, "-o", tmp_path / "x.fba", code=2).err
    run("encode", face_file, slow, "-o", tmp_path / "x.fba", "--fps", "25")
    assert fba.read(tmp_path / "x.fba").rate == 25


def test_fps_resamples(run: Run, tmp_path: Path, face_file: Path) -> None:
    run("encode", face_file, "-o", tmp_path / "x.fba", "--fps", "29.97")
    assert fba.read(tmp_path / "x.fba").rate == Fraction(30000, 1001)


def test_a_header_can_be_supplied(run: Run, tmp_path: Path, face_file: Path) -> None:
    headless = tmp_path / "headless.fap"
    lines = face_file.read_text().splitlines()
    headless.write_text("\n".join(line for line in lines if not line.startswith(("2.2", "#"))) + "\n")
    assert "--source-fps" in run("encode", headless, "-o", tmp_path / "x.fba", code=1).err
    stream = tmp_path / "x.fba"
    run("encode", headless, "-o", stream, "--source-fps", "25")
    frames = len(fba.read(stream))
    run("encode", headless, "-o", stream, "--source-fps", "25", "--fps", "50")
    assert len(fba.read(stream)) == 2 * frames - 1


def test_values_beyond_the_codable_range_are_named_or_clamped(run: Run, tmp_path: Path) -> None:
    values = np.zeros((2, 68), dtype=np.int32)
    values[:, 13] = 2000, 2100  # FAP 14 thrust_jaw: step 1, so 1860 at most
    mask = np.zeros((2, 68), dtype=bool)
    mask[:, 13] = True
    path, stream = tmp_path / "wild.fap", tmp_path / "wild.fba"
    fba.write(path, Animation(25, np.arange(2), FaceTrack(values, mask)))
    err = run("encode", path, "-o", stream, code=1).err
    assert "frame 0, FAP 14 thrust_jaw: the value 2000 cannot be carried" in err
    assert "--clamp" in err
    assert not stream.exists()
    out = run("encode", path, "-o", stream, "--clamp").out
    assert "1 value clamped" in out
    assert "  clamped: FAP 14 thrust_jaw in frame 0: 2000 sent as 1860, 140 off\n" in out
    assert fba.read(stream).face.values[:, 13].tolist() == [1860, 2100]  # type: ignore[union-attr]


def test_epf_makes_the_same_bytes_again(run: Run, tmp_path: Path, face_file: Path) -> None:
    stream, again = tmp_path / "a.fba", tmp_path / "b.fba"
    run("encode", face_file, "-o", stream, "--quant", 3, "--intra-period", "0.4", "--no-mark")
    run("decode", stream, "--fap", tmp_path / "a.fap", "--epf", tmp_path / "a.epf")
    run("encode", tmp_path / "a.fap", "-o", again, "--epf", tmp_path / "a.epf")
    assert again.read_bytes() == stream.read_bytes()


def test_several_streams_need_a_folder(run: Run, tmp_path: Path, face: Animation) -> None:
    for name in ("a", "b"):
        fba.write(tmp_path / f"{name}.fba", face)
    err = run("decode", tmp_path / "a.fba", tmp_path / "b.fba", "--fap", tmp_path / "x.fap", code=2).err
    assert "folder" in err
    (tmp_path / "out").mkdir()
    run("decode", tmp_path / "a.fba", tmp_path / "b.fba", "--fap", tmp_path / "out")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a.fap", "b.fap"]


def test_decode_says_what_to_write(run: Run, tmp_path: Path, face: Animation) -> None:
    fba.write(tmp_path / "a.fba", face)
    assert "--fap" in run("decode", tmp_path / "a.fba", code=2).err
    assert "carries no BAPs" in run("decode", tmp_path / "a.fba", "--bap", tmp_path / "a.bap", code=2).err


def test_salvage(run: Run, tmp_path: Path, face: Animation) -> None:
    data = bytearray(fba.encode(face, fba.EncoderOptions(intra_period=1, start_codes=True)))
    second = data.index(b"\x00\x00\x01\xbb")
    data[second - 8] ^= 0xFF
    path, out_file = tmp_path / "d.fba", tmp_path / "d.fap"
    path.write_bytes(data)
    run("decode", path, "--fap", out_file, code=1)
    assert "were lost" in run("decode", path, "--fap", out_file, "--salvage").err
    rescued = fba.read(out_file)
    assert 25 <= len(rescued) < 50
    assert np.array_equal(rescued.face.values[-25:], face.face.values[-25:])  # type: ignore[union-attr]


def test_motion_capture(run: Run, tmp_path: Path, bvh: Path) -> None:
    stream = tmp_path / "walk.fba"
    assert "--bap-steps visage" in run("encode", bvh, "-o", stream, "--bap-steps", "iso").err
    assert run("encode", bvh, "-o", stream).err == ""
    assert run("encode", bvh, "-o", stream, "--no-plant").err == ""  # planted feet bend knees a little
    decoded = fba.read(stream)
    assert decoded.rate == 10
    knee = decoded.body.values[:, 10 - 1]  # type: ignore[union-attr]  # BAP 10 l_knee_flexion
    # Knees bend by negative flexion, from where the default posture, not quite straight, has them.
    bent = np.radians([0, -5, -10]) * 1e5
    assert np.abs(knee - knee[0] - bent).max() <= 170


def test_standard_input_and_output(
    run: Run, tmp_path: Path, face_file: Path, face: Animation, monkeypatch: pytest.MonkeyPatch
) -> None:
    pipe_in(monkeypatch, face_file.read_bytes())
    stream = tmp_path / "x.fba"
    run("encode", "-", "-o", stream)
    assert fba.read(stream) == face


def test_convert(run: Run, tmp_path: Path, face_file: Path, face: Animation) -> None:
    run("convert", face_file, tmp_path / "x.fba")
    run("convert", tmp_path / "x.fba", tmp_path / "y.fap")
    assert fba.read(tmp_path / "y.fap") == face
    run("convert", face_file, tmp_path / "noname", "--to", "fap")
    assert ".fba" in run("convert", face_file, tmp_path / "x.xyz", code=1).err
    assert "read only" in run("convert", face_file, tmp_path / "x.epf", code=1).err
    assert "only a face" in run("convert", face_file, tmp_path / "x.bvh", code=1).err
    run("convert", face_file, tmp_path / "x.bap", code=1)
    assert not (tmp_path / "x.bap").exists()


def test_info(run: Run, tmp_path: Path, face_file: Path, face: Animation) -> None:
    stream = tmp_path / "face.fba"
    fba.write(stream, face, intra_period=1)
    out = run("info", stream, face_file).out
    assert f"{stream}: FBA, {stream.stat().st_size} bytes" in out
    assert "50 frames, 2.00 s at 25 frames/s" in out
    assert "2 I, 48 P" in out
    assert "2 FAPs: 3, 48; quantiser 1" in out
    assert f"{face_file}: FAP" in out
    report = json.loads(run("info", "--json", stream).out)
    assert (report["frames"], report["intra_planes"]) == (50, 2)
    assert report["face"]["parameters"] == [3, 48]
    assert len(json.loads(run("info", "--json", stream, face_file).out)) == 2


def test_info_goes_on_after_a_bad_file(run: Run, tmp_path: Path, face_file: Path) -> None:
    bad = tmp_path / "bad.fba"
    bad.write_bytes(b"nothing of the kind")
    _, out, err = run("info", bad, face_file, code=1)
    assert "bad.fba" in err
    assert "50 frames" in out


def test_trace(run: Run, tmp_path: Path, face: Animation) -> None:
    stream = tmp_path / "face.fba"
    fba.write(stream, face[:2])
    out = run("info", "--trace", stream).out
    lines = [line.split() for line in out.splitlines()[1:]]
    assert lines[0] == ["0", "32", "fba_object_start_code", "=", "0x000001ba"]
    assert ["32", "1", "0", "is_intra", "=", "1"] in lines
    elements = [json.loads(line) for line in run("info", "--trace", "--json", stream).out.splitlines()]
    assert sum(element["bits"] for element in elements) == 8 * stream.stat().st_size


def test_stats(run: Run, tmp_path: Path, face: Animation) -> None:
    stream = tmp_path / "face.fba"
    fba.write(stream, face, intra_period=1, mark=False)
    assert "kbit/s" in run("stats", stream).out
    report = json.loads(run("stats", "--json", stream).out)
    assert report["intra_planes"] == 2
    bits = 2 * report["intra_bits_mean"] + 48 * report["predicted_bits_mean"]
    assert 1 <= 8 * report["size"] - bits - 32 - 32 <= 8  # all but object start code, end code, alignment
    assert report["peak_bits_per_second"] >= report["bits_per_second"] / 2


def test_bench(run: Run, tmp_path: Path, face: Animation) -> None:
    stream = tmp_path / "face.fba"
    fba.write(stream, face)
    report = json.loads(run("bench", stream, "--rounds", 1, "--json").out)
    assert report["symbols"] == 100
    assert report["decode"]["symbols_per_second"] > 0


def test_conformance(run: Run, tmp_path: Path) -> None:
    out = run("conformance", "--only", "times", "--only", "jaw").out
    assert "17 of 17 vectors pass: 17 decoded, 15 encoded" in out
    assert "index.json" in run("conformance", tmp_path, code=1).err
    from fba_conformance.suite.index import SHIPPED_VECTORS

    entries = [
        entry
        for entry in json.loads((SHIPPED_VECTORS / "index.json").read_text())
        if entry["stream"] in {"valid/skips.fba", "damaged/zeros.fba"}
    ]
    for entry in entries:
        target = tmp_path / entry["stream"]
        target.parent.mkdir()
        target.write_bytes((SHIPPED_VECTORS / entry["stream"]).read_bytes())
        entry["values"] = "0" * 64
    (tmp_path / "index.json").write_text(json.dumps(entries))
    out = run("conformance", tmp_path, code=1).out
    assert "valid/skips.fba: decoded WRONG, encoded -: the decoded values differ" in out
    assert "0 of 2 vectors pass" in out


def test_conformance_of_programs(run: Run, tmp_path: Path) -> None:
    silent = f"{shlex.quote(sys.executable)} -c pass {{in}} {{out}}"
    report = tmp_path / "report.xml"
    out = run("conformance", "--only", "jaw", "--decoder", silent, "--junit", report, code=1).out
    assert "valid/jaw.fba: decoded WRONG, encoded -: wrote no file" in out
    (case,) = ElementTree.parse(report).getroot()
    assert (case.attrib["name"], case[0].attrib["message"]) == ("valid/jaw.fba", "wrote no file")
    out = run("conformance", "--only", "jaw", "--encoder", silent, "--json", code=1).out
    assert [(one["encoded"], one["message"]) for one in json.loads(out)] == [(False, "wrote no file")]
    for arguments, text in (
        (("--decoder", "mydecoder {in}"), "the command needs {out}"),
        (("--encoder", "myencoder {in} {out} {fps}"), "nothing is put in place of {fps}"),
        (("--decoder", "'open {in} {out}"), "No closing quotation"),
        (("--only", "jow"), "there is no vector or group 'jow'"),
        (("--zip", tmp_path / "suite.zip", tmp_path), "leave the folder out"),
    ):
        assert text in run("conformance", *arguments, code=2).err


def test_an_interrupted_write_leaves_the_old_file(
    run: Run, tmp_path: Path, face_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stream = tmp_path / "x.fba"
    stream.write_bytes(b"old")

    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("fba.planning.encode_stream", interrupted)
    run("encode", face_file, "-o", stream, code=130)
    assert stream.read_bytes() == b"old"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["face.fap", "x.fba"]


def test_options_contradict_an_epf_file(run: Run, tmp_path: Path, face_file: Path) -> None:
    stream = tmp_path / "a.fba"
    run("encode", face_file, "-o", stream)
    run("decode", stream, "--epf", tmp_path / "a.epf")
    epf = ("--epf", tmp_path / "a.epf")
    for option in (("--quant", 1), ("--intra-period", 2), ("--start-codes",), ("--no-clamp",)):
        err = run("encode", face_file, "-o", tmp_path / "b.fba", *epf, *option, code=2).err
        assert "and --epf contradict each other" in " ".join(err.split())
    run("encode", face_file, "-o", tmp_path / "b.fba", *epf, "--bap-steps", "visage")


def test_a_face_from_gltf(run: Run, tmp_path: Path, face: Animation) -> None:
    """Nothing is said of BAPs where there are none, and another rate keeps the FAPs."""
    fba.write(tmp_path / "face.glb", face)
    assert run("encode", tmp_path / "face.glb", "-o", tmp_path / "a.fba").err == ""
    assert fba.read(tmp_path / "a.fba").face == face.face
    assert run("encode", tmp_path / "face.glb", "-o", tmp_path / "b.fba", "--fps", 50).err == ""
    back = fba.read(tmp_path / "b.fba")
    assert back.rate == 50
    err = run("encode", tmp_path / "face.glb", "-o", tmp_path / "c.fba", "--report", code=2).err
    assert "there is no body" in err
    assert np.array_equal(back.face.values[::2, 2], face.face.values[:, 2])  # type: ignore[union-attr]
