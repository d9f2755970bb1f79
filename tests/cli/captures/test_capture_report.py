"""`fba encode` of motion capture and of markers: options, report, limits."""

import json
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

import fba
from command_line import Run, pipe_in
from fba import Animation, BodyTrack, FaceTrack
from fba.body import JointLimits
from fba.capture import preparation
from fba.capture.comparison import Comparison, Difference
from fba.cli.capture_report import CaptureReport, poor_line
from fba.face import FaceModel
from fba.formats.bvh import _reader as reader
from fba.parameters import baps
from tools.captures import marker_files
from tools.captures.marked_actor import Take, perform

BVH = """HIERARCHY
ROOT Hips
{ OFFSET 0 95 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Spine { OFFSET 0 10 0 CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT Neck { OFFSET 0 40 0 CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT Head { OFFSET 0 10 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 15 0 } } } }
  JOINT LeftUpLeg { OFFSET 10 -5 0 CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT LeftLeg { OFFSET 0 -45 0 CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT LeftFoot { OFFSET 0 -40 0 CHANNELS 3 Zrotation Xrotation Yrotation
        End Site { OFFSET 0 -5 12 } } } }
  JOINT RightUpLeg { OFFSET -10 -5 0 CHANNELS 3 Zrotation Xrotation Yrotation
    JOINT RightLeg { OFFSET 0 -45 0 CHANNELS 3 Zrotation Xrotation Yrotation
      JOINT RightFoot { OFFSET 0 -40 0 CHANNELS 3 Zrotation Xrotation Yrotation
        End Site { OFFSET 0 -5 12 } } } }
}
MOTION
Frames: 3
Frame Time: 0.033333
"""


def bvh(tmp_path: Path) -> Path:
    """Legs and a spine; in the last frame, the left thigh is raised by 150 degrees."""
    rows = np.zeros((3, 33))
    rows[:, 1] = 95
    rows[:, 16] = [0, -60, -150]  # X of LeftUpLeg
    path = tmp_path / "kick.bvh"
    path.write_text(BVH + "\n".join(" ".join(f"{n:g}" for n in row) for row in rows) + "\n")
    return path


Encode = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture
def encode(programs: Path) -> Encode:
    """A function that runs `fba encode` as a process of its own."""

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        command = [str(programs / "fba"), "encode", *map(str, arguments)]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    return run


def test_report_and_limits_as_text(encode: Encode, tmp_path: Path) -> None:
    result = encode(
        bvh(tmp_path), "-o", tmp_path / "out.fba", "--bap-steps", "visage", "--report", "--limits", "report"
    )
    assert result.returncode == 0, result.stderr
    assert "kick.bvh: 3 frames beside the source: " in result.stdout
    rows = {line.split("  ")[1] for line in result.stdout.splitlines() if line.startswith("  ")}
    assert rows >= {"direction", "foot", "path", "floor", "jump", "leap"}
    assert "joints that the source lacks:" in result.stdout
    assert "left thigh flexion: beyond -20..120 degrees in 1 frames" in result.stdout


def test_report_as_json(encode: Encode, tmp_path: Path) -> None:
    result = encode(bvh(tmp_path), "-o", tmp_path / "out.fba", "--json", "--report", "--limits", "report")
    said = json.loads(result.stdout)
    (capture,) = said["captures"]
    assert said["verdict"] == capture["verdict"]
    differences = {(one["measure"], one["part"]): one for one in capture["differences"]}
    thigh = differences["direction", "left thigh"]
    assert (thigh["unit"], thigh["grade"]) == ("degrees", "good")
    assert capture["family"] == "collar"
    assert {bone["joint"] for bone in capture["bones"]} >= {"l_hip", "l_knee", "r_knee", "vc7"}
    assert all(bone["mean"] < 1 and bone["worst"] < 5 for bone in capture["bones"])
    thigh = next(limit for limit in said["limits"] if limit["limit"] == "left thigh flexion")
    assert (thigh["frames"], thigh["first"]) == (1, 2)
    assert thigh["worst"] == pytest.approx(30, abs=4)
    assert not said["limits_clamped"]


def test_a_poor_result_is_said_in_one_line_and_shown(run: Run, tmp_path: Path) -> None:
    """A first frame 5 m from the origin is moved; where the origin is asked for, the hips leap by 1.3 m."""
    path, page = tmp_path / "far.bvh", tmp_path / "report.html"
    rows = np.zeros((3, 33))
    rows[:, 0], rows[:, 1] = 500, 95
    path.write_text(BVH + "\n".join(" ".join(f"{n:g}" for n in row) for row in rows) + "\n")
    near = run("encode", path, "-o", tmp_path / "out.fba", "--report", page)
    assert "it is moved to begin at the default place" in near.err
    assert "poor" not in near.err
    text = page.read_text()
    assert text.count("<tr class=") > 10
    assert '<img alt="Source and result in the worst frames" src="data:image/png;base64,' in text
    far = run("encode", "--report", path, "-o", tmp_path / "out.fba", "--origin", "source")
    (line,) = [line for line in far.err.splitlines() if line.startswith("fba: poor: ")]
    assert "HumanoidRoot_tr_lateral is sent 1344 mm off in frame 0, and 1 more" in line
    leap = next(line for line in far.out.splitlines() if line.startswith("  leap"))
    assert leap.split() == ["leap", "hips", "0.0", "1344.0", "mm", "1", "poor"]
    assert "\x1b" not in far.err + far.out  # colours are for terminals
    silent = run("encode", path, "-o", tmp_path / "out.fba", "--origin", "source")
    assert "--report FILE.html shows it" in silent.err
    wrong = run("encode", path, "-o", tmp_path / "out.fba", "--report=table.txt", code=2)
    assert "a page, .html, or a picture, .png" in wrong.err


@pytest.mark.parametrize(("variable", "red"), [("", True), ("1", False)])
def test_poor_is_red_unless_colours_are_refused(
    monkeypatch: pytest.MonkeyPatch, variable: str, red: bool
) -> None:
    """NO_COLOR counts where it is not empty (no-color.org)."""
    monkeypatch.setenv("NO_COLOR", variable)
    monkeypatch.setenv("TERM", "xterm")
    comparison = Comparison(9, (Difference("palm", "left hand", 1.0, 90.0, 4),))
    report = cast(CaptureReport, SimpleNamespace(path=Path("walk.bvh"), comparison=comparison))
    line = poor_line(report, detailed=True)
    assert ("\x1b[31m" in line) == red
    assert "fba: poor: walk.bvh: left hand faces 90 degrees off in frame 4" in line


def test_a_body_beside_a_face_of_a_capture_file(run: Run, tmp_path: Path) -> None:
    """glTF files may hold a face alone: then there is nothing to compare, and no error."""
    face, body, out = tmp_path / "face.glb", tmp_path / "body.bap", tmp_path / "out.fba"
    track = FaceTrack(
        np.full((3, 68), 40, np.int32) * (np.arange(68) == 2), np.tile(np.arange(68) == 2, (3, 1))
    )
    fba.write(face, Animation(30, np.arange(3), track))
    fba.write(body, Animation(30, np.arange(3), body=BodyTrack.empty(3)))
    run("encode", face, body, "-o", out)
    assert fba.read(out).face is not None


def test_limits_clamp(encode: Encode, tmp_path: Path) -> None:
    out = tmp_path / "out.fba"
    path = bvh(tmp_path)
    for limits, beyond in (("off", True), ("clamp", False)):
        result = encode(path, "-o", out, "--bap-steps", "visage", "--bap-quant", "1", "--limits", limits)
        assert result.returncode == 0, result.stderr
        body = fba.decode(out.read_bytes(), bap_steps="visage").body
        excess = {e.limit.name: e.worst for e in JointLimits.human().check(body.values)}
        assert (excess.get("left thigh flexion", 0) > 1) == beyond  # one step of the quantiser is 0.1 degrees


def test_spine_of_the_stream(encode: Encode, tmp_path: Path) -> None:
    path = bvh(tmp_path)
    counts = {}
    for spine in ("spread", "full", "simple", "joints"):
        out = tmp_path / f"{spine}.fba"
        options = ("--spine", spine, "--ground", "source", "--origin", "start", "--preset", "reference")
        assert encode(path, "-o", out, *options).returncode == 0
        body = fba.decode(out.read_bytes()).body
        sent = {baps()[column].joint for column in np.flatnonzero(body.mask[0])}
        counts[spine] = sum(joint.startswith(("vl", "vt", "vc", "skull")) for joint in sent)
    assert counts == {"spread": 10, "full": 25, "simple": 4, "joints": 3}


def test_fps_resamples_by_rotation(encode: Encode, tmp_path: Path) -> None:
    """Half way between -60 and -150 degrees is -105, whatever the BAPs in between are."""
    out = tmp_path / "out.fba"
    assert encode(bvh(tmp_path), "-o", out, "--bap-steps", "visage", "--fps", "60").returncode == 0
    body = fba.decode(out.read_bytes(), bap_steps="visage").body
    flexion = next(b.number - 1 for b in baps() if b.name == "l_hip_flexion")
    assert len(body.values) == 5
    assert np.degrees(body.values[3, flexion] * 1e-5) == pytest.approx(105, abs=4)


def test_legs_that_stay_as_they_are_retargeted(encode: Encode, tmp_path: Path, shared: Path) -> None:
    """This walker's legs have other proportions: planted feet cost directions of bones, and gain ground."""
    out, path = tmp_path / "out.fba", shared / "data" / "vreng" / "cmu_walk.bvh"
    found = {}
    for plant in ("--plant", "--no-plant"):
        result = encode(path, "-o", out, "--bap-steps", "visage", plant, "--report", "--json")
        assert result.returncode == 0, result.stderr
        (capture,) = json.loads(result.stdout)["captures"]
        thigh = next(bone for bone in capture["bones"] if bone["joint"] == "r_hip")
        found[plant] = thigh["mean"], capture["feet"]["within"]
    assert found["--no-plant"][0] < 0.01 < found["--plant"][0] < 2
    assert found["--no-plant"][1] < 0.9 < found["--plant"][1]


def test_a_capture_is_read_and_prepared_once(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = []

    def counted(module: Any, name: str) -> None:
        function = getattr(module, name)

        def call(*arguments: Any, **options: Any) -> Any:
            calls.append(name)
            return function(*arguments, **options)

        monkeypatch.setattr(module, name, call)

    counted(reader, "parse")
    counted(preparation, "find_bones")
    said = run("encode", bvh(tmp_path), "-o", tmp_path / "a.fba", "--report", "--json")
    assert calls == ["parse", "find_bones"]
    assert json.loads(said.out)["captures"][0]["frames"] == 3


@cache
def take() -> Take:
    """The built-in head's: half the frames would do, but blinks must be among them."""
    return perform(FaceModel.default(), 200)


@pytest.fixture
def capture(tmp_path: Path) -> Path:
    return marker_files.write(tmp_path, "float.c3d", take().motion)


def test_encode(run: Run, capture: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.fba"
    everything = ("--preset", "reference")
    done = run("encode", capture, "-o", out, "--fps", "25", "--map-out", tmp_path / "a.toml", *everything)
    assert "50 frames, 2.00 s at 25 frames/s" in done.out
    assert "34 markers of" in done.out
    animation = fba.read(out)
    np.testing.assert_allclose(animation.face.values[:, 50], take().faps[::4, 50], atol=8)
    assert animation.body is not None
    text = (tmp_path / "a.toml").read_text()
    (tmp_path / "b.toml").write_text(text.replace('"LCR" = "8.4"\n', ""))
    options = ("--map", tmp_path / "b.toml", "--no-head-path", "--gaze", "camera", *everything)
    run("encode", capture, "-o", out, *options)
    animation = fba.read(out)
    assert animation.body is None
    sent = set(np.flatnonzero(animation.face.mask.any(axis=0)) + 1)
    assert 53 in sent
    assert 54 not in sent
    assert {23, 24, 25, 26} <= sent


def test_pairs(run: Run, capture: Path, tmp_path: Path) -> None:
    out = tmp_path / "a.fba"
    run("encode", capture, "-o", out, "--map", "LCL=", "--map", "CHC=head", "--neutral", "0.0-0.2")
    animation = fba.read(out)
    assert not animation.face.mask[:, 52].any()
    for wrong, message in (
        ("XYZ=2.1", "the capture has no marker 'XYZ'"),
        ("LCL=2.1", None),  # the chin's marker loses its place
        ("LCL=77.1", "there is no place '77.1'"),
        ("LCL=6.1", "no marker can be at feature point 6.1"),
    ):
        done = run("encode", capture, "-o", out, "--map", wrong, code=2 if message else None)
        assert (message or "") in done.err
    assert "two times in seconds" in run("encode", capture, "-o", out, "--neutral", "soon", code=2).err


def test_info(run: Run, capture: Path) -> None:
    done = run("info", capture)
    assert done.out.splitlines() == [
        f"{capture}: C3D, {capture.stat().st_size} bytes",
        "  time     200 frames, 2.00 s at 100 frames/s",
        "  markers  50, in mm, +y up: FHC, FHL, FHR, FHM, FHM2, FHL2, FHR2, BRL1, ...",
        "  gaps     none",
        "  face     34 markers have a place by the names (regions50)",
    ]
    report = json.loads(run("info", "--json", capture).out)
    assert report["markers"]["map"] == "regions50"


def test_no_face(run: Run, tmp_path: Path) -> None:
    names = "".join(f",M{n}_x,M{n}_y,M{n}_z" for n in range(4))
    path = tmp_path / "a.csv"
    path.write_text(f"time{names}\n" + "".join(f"{n / 10}{',1,2,3' * 4}\n" for n in range(9)))
    done = run("info", path)
    assert "face     not found; fba encode --map says which marker is where" in done.out
    done = run("encode", path, "-o", tmp_path / "a.fba", code=1)
    assert "too few to find a face by its shape; say which marker is where with --map Chin=2.1" in done.err
    assert not (tmp_path / "a.fba").exists()


def test_convert(run: Run, capture: Path, tmp_path: Path) -> None:
    run("convert", capture, tmp_path / "a.fap")
    assert len(fba.read(tmp_path / "a.fap").face) == 200


def test_standard_input_gives_the_same_stream(
    run: Run, capture: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Steps of BAPs and clamping go by the content, of which the name "-" says nothing."""
    from_file, from_input = tmp_path / "a.fba", tmp_path / "b.fba"
    run("encode", capture, "-o", from_file)
    pipe_in(monkeypatch, capture.read_bytes())
    run("encode", "-", "-o", from_input)
    assert from_input.read_bytes()[-40:] == from_file.read_bytes()[-40:]
    mine, theirs = fba.read(from_input), fba.read(from_file)
    assert mine == theirs
