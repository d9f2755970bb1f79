"""decode --output and convert: files for other programs, and the options of their writers."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import fba
from command_line import Run
from fba import Animation, BodyTrack
from fba.body import BodyModel
from fba.gltf import read_gltf
from fba.parameters import BAP_COUNT, bap_numbers


@pytest.fixture
def stream(tmp_path: Path, face: Animation, body: Animation) -> Path:
    """Face and body."""
    path = tmp_path / "both.fba"
    fba.write(path, Animation(25, np.arange(50), face.face, body.body, "both"), bap_steps="visage")
    return path


def joints(path: Path) -> list[str]:
    return re.findall(r"(?:ROOT|JOINT) (\w+)", path.read_text())


def test_a_stream_becomes_a_person(run: Run, tmp_path: Path, stream: Path) -> None:
    target = tmp_path / "person.glb"
    assert run("decode", stream, "-o", target, "--bap-steps", "visage")[1:] == (
        f"{stream}: 50 frames to {target}\n",
        "",
    )
    both, back = fba.read(stream, bap_steps="visage"), fba.read(target)
    assert back.face == both.face
    assert np.abs(back.body.values[:, 183] - both.body.values[:, 183]).max() <= 1


def test_a_stream_becomes_bvh(run: Run, tmp_path: Path, stream: Path) -> None:
    target = tmp_path / "all.bvh"
    assert "BVH holds no face; only the body was written" in run("decode", stream, "-o", target).err
    assert len(joints(target)) == 87
    run("decode", stream, "-o", tmp_path / "few.bvh", "--joints", "moving", "--unit", "m")
    few = joints(tmp_path / "few.bvh")
    assert "l_knee" in few
    assert len(few) < 20
    hips = [float(line.split()[1]) for line in (target, tmp_path / "few.bvh") for line in heights(line)]
    assert hips[0] == pytest.approx(100 * hips[1])  # centimetres and metres
    assert 0.8 < hips[1] < 1.1  # of an adult


def heights(path: Path) -> list[str]:
    """The first line of motion."""
    lines = path.read_text().splitlines()
    return [lines[[line.startswith("Frame Time") for line in lines].index(True) + 1]]


def test_convert_takes_the_same_options(run: Run, tmp_path: Path, stream: Path) -> None:
    run("convert", stream, tmp_path / "a.bvh", "--joints", "moving")
    assert len(joints(tmp_path / "a.bvh")) < 20
    run("convert", stream, tmp_path / "a.glb", "--no-mesh")
    assert read_gltf(tmp_path / "a.glb").meshes == ()
    assert fba.read(tmp_path / "a.glb").face == fba.read(stream).face


def test_another_body_and_axes(run: Run, tmp_path: Path, stream: Path) -> None:
    person = BodyModel.default()
    person.save(tmp_path / "body.glb")
    target = tmp_path / "a.glb"
    assert (
        run("convert", stream, target, "--body", tmp_path / "body.glb", "--axes", "vreng").err
        == f"fba: {stream}: BAP steps visage: the stream says so\n"
    )
    assert {part.name for part in person.parts if part.kind != "neck"} <= {
        mesh.name for mesh in read_gltf(target).meshes
    }
    assert "body.glb" in run("convert", stream, target, "--model", tmp_path / "body.glb", code=1).err


def test_knees_that_bend_forward_are_told_and_mended(run: Run, tmp_path: Path) -> None:
    values = np.zeros((3, BAP_COUNT), dtype=np.int32)
    values[:, bap_numbers()["l_knee_flexion"] - 1] = 50_000
    old, new, stream = tmp_path / "old.bap", tmp_path / "new.bap", tmp_path / "old.fba"
    fba.write(old, Animation(25, np.arange(3), None, BodyTrack(values, values != 0)))
    finding = "knees bend forward in 3 of 3 frames, by up to 29 degrees"
    assert f"fba: warning: {old}: {finding}" in run("encode", old, "-o", stream).err
    assert finding in run("convert", old, tmp_path / "old.bvh").err
    assert finding in run("decode", stream, "-o", new).err
    for path in (old, stream):
        assert f"  found    {finding}" in run("info", path).out
        assert finding in json.loads(run("info", "--json", path).out)["findings"][0]
    for command in (("decode", stream, "-o", new), ("convert", old, new)):
        assert finding not in run(*command, "--axes", "vreng").err
        assert run("info", new).out.count("found") == 0
        assert (fba.read(new).body.values[:, 9] < -49_000).all()
    shown = ("-o", tmp_path / "a.png", "--size", "32x32")
    assert finding in run("render", old, *shown).err
    assert finding not in run("render", old, *shown, "--axes", "vreng").err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["-o", "a.glb", "--joints", "moving"],
            "--joints is an option for BVH, and a.glb becomes GLTF, which takes --mesh/--no-mesh, --model, "
            "--body, --axes",
        ),
        (["-o", "a.bvh", "--no-mesh"], "a.bvh becomes BVH, which takes --joints, --unit, --axes"),
        (["-o", "a.fap", "--axes", "vreng"], "BAP, BVH and GLTF, and a.fap becomes FAP, which takes none"),
        (["--fap", "a.fap", "--unit", "m"], "--unit says how to write --output; give that too"),
        (["--fap", "a.fap", "--to", "bvh"], "--to says how to write --output"),
        (["-o", "a.fba"], "fba convert and fba encode write them"),
        (["-o", "."], "name the format with --to"),
        ([], "--fap, --bap, --epf, --visemes, --output"),
    ],
)
def test_options_that_do_not_fit(
    run: Run,
    tmp_path: Path,
    stream: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert message in " ".join(run("decode", stream.name, *arguments, code=2).err.split())
    assert [path.name for path in tmp_path.iterdir()] == ["both.fba"]


def test_convert_names_a_misplaced_option(run: Run, tmp_path: Path, stream: Path) -> None:
    err = run("convert", stream, tmp_path / "a.bap", "--mesh", code=2).err
    assert "--mesh/--no-mesh is an option for GLTF" in err
    assert not (tmp_path / "a.bap").exists()


def test_a_folder_of_files(run: Run, tmp_path: Path, stream: Path, face: Animation) -> None:
    other = tmp_path / "talk.fba"
    fba.write(other, face)
    (tmp_path / "out").mkdir()
    run("decode", stream, other, "-o", tmp_path / "out", "--to", "glb")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["both.glb", "talk.glb"]
    err = run("decode", other, "-o", tmp_path / "talk.bvh", "--fap", tmp_path / "talk.fap", code=2).err
    assert "carries no BAPs; leave --output out" in err
    assert not (tmp_path / "talk.fap").exists()  # nothing is half done


def test_a_missing_part_matters_only_if_it_is_to_be_written(run: Run, tmp_path: Path, stream: Path) -> None:
    assert run("decode", stream, "--fap", tmp_path / "a.fap").err == ""
    assert (
        run("decode", stream, "--fap", tmp_path / "a.fap", "--bap", tmp_path / "a.bap").err
        == f"fba: {stream}: BAP steps visage: the stream says so\n"
    )
