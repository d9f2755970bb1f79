"""Mistakes of users: what the program then says names options that exist, and files that are meant."""

import json
import re
from pathlib import Path

import click
import numpy as np
import pytest

import fba
from command_line import Run, pipe_in
from fba import Animation
from fba.cli.main import _COMMANDS, group
from fba.errors import FormatError, Remedy
from small_people import BONES, write_person

SAMPLE = Path(fba.__file__).parent / "samples" / "hello.bvh"


@pytest.fixture
def headless(tmp_path: Path, face: Animation) -> Path:
    """A FAP file without a header."""
    path = tmp_path / "headless.fap"
    fba.write(path, face)
    lines = [line for line in path.read_text().splitlines() if not line.startswith(("2.2", "#"))]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def cut(tmp_path: Path, face: Animation) -> Path:
    """A FAP file whose last frame lacks its values."""
    path = tmp_path / "cut.fap"
    fba.write(path, face)
    path.write_text("\n".join(path.read_text().splitlines()[:-1]) + "\n")
    return path


@pytest.fixture
def streams(tmp_path: Path, face: Animation) -> list[Path]:
    """A good stream, a BVH file named as one, and another good one."""
    paths = [tmp_path / name for name in ("one.fba", "two.fba", "three.fba")]
    for path in paths:
        fba.write(path, face)
    paths[1].write_bytes(SAMPLE.read_bytes())
    return paths


@pytest.mark.parametrize(
    "command",
    [["info"], ["encode", "-o", "{out}.fba"], ["convert", "{file}", "{out}.fap"], ["gait", "--find"]],
)
def test_a_rate_can_be_given_wherever_one_is_asked_for(
    run: Run, tmp_path: Path, headless: Path, command: list[str]
) -> None:
    words = [word.format(file=headless, out=tmp_path / "out") for word in command]
    if str(headless) not in words:
        words.append(str(headless))
    assert run(*words, code=1).err.endswith("its frame rate is unknown; give one with --source-fps 25\n")
    code, _, err = run(*words, "--source-fps", "25", code=None)
    if command[0] == "gait":
        assert "has no body" in err  # it was read
    else:
        assert (code, err) == (0, "")


@pytest.mark.parametrize(
    "command",
    [
        ["info", "hedless.fap"],
        ["render", "headless.fpa", "-o", "a.png"],
        ["play", "headles.fap"],
        ["emote", "Headless.fap", "-o", "a.fap"],
        ["render", "--model", "headless.glb", "-o", "a.png"],
    ],
)
def test_the_nearest_name_of_a_missing_file_is_given(
    run: Run, headless: Path, monkeypatch: pytest.MonkeyPatch, command: list[str]
) -> None:
    monkeypatch.chdir(headless.parent)
    assert "does not exist (did you mean 'headless.fap'?)" in run(*command, code=2).err


def test_a_program_that_does_not_exist_is_one_message(run: Run) -> None:
    _, out, err = run("conformance", "--decoder", "no-such-decoder {in} {out}", code=2)
    assert out == ""
    assert "there is no program 'no-such-decoder' here; give its path, or a name on PATH" in err


def test_info_has_the_salvage_that_it_names(run: Run, cut: Path) -> None:
    assert run("info", cut, code=1).err.endswith("; --salvage reads the frames before it\n")
    _, out, err = run("info", cut, "--salvage")
    assert "49 frames" in out
    assert "salvaged the 49 frames" in err
    assert "--salvage" not in err


def test_an_option_of_another_command_is_named_with_it(run: Run, tmp_path: Path) -> None:
    values, mask = np.zeros((1, 68), dtype=np.int32), np.zeros((1, 68), dtype=bool)
    values[0, 13], mask[0, 13] = 2000, True
    fba.write(tmp_path / "wild.fap", Animation(25, np.arange(1), fba.FaceTrack(values, mask)))
    err = run("convert", tmp_path / "wild.fap", tmp_path / "wild.fba", code=1).err
    assert err.endswith("or send the nearest value that fits with --clamp of `fba encode`\n")


def test_joints_that_names_do_not_tell_can_be_given(run: Run, bvh: Path, tmp_path: Path) -> None:
    bvh.write_text(re.sub(r"(ROOT|JOINT) (\w+)", lambda m: f"{m[1]} part{m.start()}", bvh.read_text()))
    err = run("info", bvh, code=1).err
    assert err.endswith(
        "name each joint's counterpart in the standard with --map Pelvis=HumanoidRoot of `fba encode`\n"
    )
    names = re.findall(r"(?:ROOT|JOINT) (\w+)", bvh.read_text())
    ends = ("hip", "knee", "ankle")
    joints = ["HumanoidRoot", *(f"{s}_{e}" for s in "lr" for e in ends), "vl5", "vc4", "skullbase"]
    animation = fba.read(bvh, joints=dict(zip(names, joints, strict=True)))
    assert len(animation) == 3
    assert animation.body.mask.any()
    pairs = [word for name, joint in zip(names, joints, strict=True) for word in ("--map", f"{name}={joint}")]
    run("convert", bvh, tmp_path / "out.bap", *pairs)
    assert np.array_equal(fba.read(tmp_path / "out.bap").body.values, animation.body.values)


def test_joints_of_a_body_are_given_as_options(run: Run, tmp_path: Path, face: Animation) -> None:
    path = write_person(tmp_path / "p.glb", names={bone: f"n{k}" for k, bone in enumerate(BONES)})
    fba.write(tmp_path / "a.fap", face)
    err = run("render", tmp_path / "a.fap", "-o", tmp_path / "a.png", "--body", path, code=1).err
    assert err.endswith("name each joint's counterpart in the standard with --map Pelvis=HumanoidRoot\n")


def test_remedies_name_options_of_other_commands(run: Run, tmp_path: Path) -> None:
    """A trunk with shoulders alone does not tell how long its unit is."""
    path = tmp_path / "trunk.bvh"
    joints = {
        "Hips": "HumanoidRoot",
        "Spine": "vl5",
        "A": "l_shoulder",
        "B": "r_shoulder",
        "Head": "skullbase",
    }
    channels = "CHANNELS 3 Zrotation Xrotation Yrotation"
    ends = "End Site { OFFSET 0 15 0 } }"
    children = " ".join(
        f"JOINT {name} {{ OFFSET {x} {y} 0 {channels} {ends}"
        for name, x, y in (("A", 18, 30), ("B", -18, 30), ("Head", 0, 45))
    )
    path.write_text(
        f"HIERARCHY\nROOT Hips {{ OFFSET 0 0 0 {channels} JOINT Spine {{ OFFSET 0 12 0 {channels} {children} "
        f"}} }}\nMOTION\nFrames: 1\nFrame Time: 0.04\n{' '.join(['5'] * 15)}\n"
    )
    maps = [word for pair in joints.items() for word in ("--map", "=".join(pair))]
    err = run("convert", path, tmp_path / "a.bap", *maps).err
    assert "give another, in metres, with --scale 0.001 of `fba encode`\n" in err


def test_a_format_can_be_named(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "walk.txt"
    path.write_text("\n" + " " * 70_000 + "\n" + SAMPLE.read_text())
    assert run("info", path, code=1).err.endswith("; if it is one of them, name it with --from bvh\n")
    assert f"{path}: BVH" in run("info", path, "--from", "bvh").out
    assert "there is no format 'bhv' (did you mean 'bvh'?)" in run("info", path, "--from", "bhv", code=2).err
    assert "or name it with --to fba" in run("convert", SAMPLE, tmp_path / "walk.xyz", code=1).err


def test_convert_names_the_version_that_it_writes(run: Run, tmp_path: Path, face: Animation) -> None:
    fba.write(tmp_path / "a.fba", face)
    assert (
        run("convert", tmp_path / "a.fba", tmp_path / "a.fap").out
        == f"{tmp_path}/a.fap: 50 frames, ASCII face animation parameters, version 2.2\n"
    )


def test_a_misspelt_command(run: Run) -> None:
    assert "there is no command 'encdoe' (did you mean 'encode'?)" in run("encdoe", "walk.bvh", code=2).err
    assert "there is no command 'xyz'\n" in run("xyz", code=2).err


def test_remedies_in_the_words_of_python(headless: Path, tmp_path: Path) -> None:
    with pytest.raises(FormatError, match=r"; give one with source_rate=25$") as caught:
        fba.read(headless)
    assert caught.value.finding.endswith("its frame rate is unknown")
    assert caught.value.remedies == (Remedy("source_rate", "give one with {}", "25"),)
    (tmp_path / "a.txt").write_text("Hello.\n")
    with pytest.raises(FormatError, match=r"name it with format='bvh'$"):
        fba.read(tmp_path / "a.txt")


def test_messages_of_the_library_name_no_options() -> None:
    """An option exists on some commands only; a `Remedy` knows on which.

    --bap-steps is on every command that reads or writes streams. `./dev fuzz` is one command, with its own.
    """
    found = []
    root = Path(fba.__file__).parents[1]
    for package in ("fba", "player", "conformance"):
        for path in (root / package).rglob("*.py"):
            if {"cli", "fuzz"} & set(path.parts) or "argparse" in path.read_text(encoding="utf-8"):
                continue
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                if re.search(r"[\"' (]--[a-z]{3,}", line) and not re.search("`fba |--bap-steps", line):
                    found.append(f"{path}:{number}: {line.strip()}")
    assert not found


def test_options_for_arguments_exist() -> None:
    from fba.cli.command import OPTIONS

    context = click.Context(group, info_name="fba")
    taken = {param.name for name in _COMMANDS for param in _params(group.get_command(context, name))}
    assert set(OPTIONS.values()) <= taken


def _params(command: click.Command | None) -> list[click.Parameter]:
    found = list(command.params)
    for each in getattr(command, "commands", {}).values():
        found += _params(each)
    return found


@pytest.mark.parametrize("command", ["info", "stats", "bench", "decode"])
def test_one_bad_file_of_several_is_named_and_the_others_go_on(
    run: Run, tmp_path: Path, streams: list[Path], command: str
) -> None:
    streams[1].write_bytes(b"\0\0\1\xba\xff")
    more = {"bench": ["--rounds", "1"], "decode": ["--fap", str(tmp_path)]}.get(command, [])
    _, out, err = run(command, *streams, *more, code=1)
    assert err.startswith(f"fba: error: {streams[1]}: ")
    assert (err.count("two.fba"), err.count("\n")) == (1, 1)
    assert out.count("one.fba") == out.count("three.fba") == 1
    if command == "decode":
        assert sorted(path.name for path in tmp_path.glob("*.fap")) == ["one.fap", "three.fap"]
    out = run(command, *streams, *more, "--json", code=1).out
    assert [Path(row.get("file") or row["input"]).name for row in json.loads(out)] == ["one.fba", "three.fba"]
    _, out, err = run(command, streams[1], *more, code=1)
    assert out == ""
    assert err.startswith(f"fba: error: {streams[1]}: ")
    assert err.count("two.fba") == 1


def test_a_row_of_stats_for_a_program_is_one_line_however_long_the_name(
    run: Run, tmp_path: Path, streams: list[Path]
) -> None:
    folder = tmp_path / ("long " * 40)
    folder.mkdir()
    (folder / "deep.fba").write_bytes(streams[0].read_bytes())
    out = run("stats", folder / "deep.fba", streams[2]).out
    rows = out.splitlines()
    assert len(rows) == 3
    assert rows[1].startswith(f"{folder / 'deep.fba'} ")
    assert rows[2].startswith(f"{streams[2]} ")


@pytest.mark.parametrize("command", ["stats", "bench", "decode", "info --trace"])
def test_errors_about_other_files_name_their_format(
    run: Run, tmp_path: Path, streams: list[Path], command: str
) -> None:
    more = ["--fap", str(tmp_path)] if command == "decode" else []
    err = run(*command.split(), streams[1], *more, code=1).err
    assert err.startswith(f"fba: error: {streams[1]}: ")
    assert "it seems to be BVH motion capture" in err


def test_standard_input_is_called_so(run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    pipe_in(monkeypatch, b"")
    err = run("encode", "-", "-o", tmp_path / "x.fba", code=1).err
    assert err == "fba: error: standard input: is empty (0 bytes); was it fully copied or written?\n"
    pipe_in(monkeypatch, b"2.2 a 25 9\n" + b"1 " * 68 + b"\n")
    assert run("info", "-", code=1).err.startswith("fba: error: standard input:2: the last frame is cut")


@pytest.mark.parametrize(
    ("rate", "text"),
    [
        ("0", "the frame rate must be more than 0"),
        ("-25", "a frame rate is a positive number"),
        ("nan", "a frame rate is a positive number"),
        ("1e9", "a frame rate is a positive number without an exponent"),
        ("1e-9", "a frame rate is a positive number without an exponent"),
        ("1000000000", "1000000000 frames/s are out of reach"),
        ("0.0000001", "0.0000001 frames/s are out of reach"),
        ("25/0", "a frame rate cannot be divided by 0"),
        ("fast", "such as 25, 29.97 or 30000/1001"),
    ],
)
def test_rates_out_of_reach(run: Run, tmp_path: Path, rate: str, text: str) -> None:
    err = run("convert", SAMPLE, tmp_path / "a.bap", "--fps", rate, code=2).err
    assert text in err
    assert "may be 1/3600 to 10000" in err


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (
            ["-o", "a.png", "--time", "99"],
            1,
            "time 99 s is outside the animation, which goes from 0 s to 2 s",
        ),
        (
            ["-o", "a.png", "--time", "-5"],
            1,
            "time -5 s is outside the animation, which goes from 0 s to 2 s",
        ),
        (["-o", "a.png", "--time", "nan"], 2, "'nan' is not a number of seconds"),
        (["-o", "a.png", "--frame", "50"], 1, "there is no frame 50: the animation has 50 (0 to 49)"),
        (["-o", "a.png", "--start", "3"], 1, "start 3 s is outside the animation"),
        (["-o", "a.gif", "--start", "3"], 1, "start 3 s is outside the animation"),
        (["-o", "a.gif", "--start", "-1"], 1, "start -1 s is outside the animation"),
        (["-o", "a.gif", "--end", "50"], 1, "end 50 s is outside the animation, which goes from 0 s to 2 s"),
        (["-o", "a.gif", "--end", "inf"], 2, "'inf' is not a number of seconds"),
        (["-o", "a.png", "--contact-sheet", "4", "--end", "50"], 1, "end 50 s is outside the animation"),
    ],
)
def test_times_outside_the_animation(
    run: Run,
    tmp_path: Path,
    face: Animation,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    code: int,
    text: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    fba.write("face.fap", face)
    assert text in run("render", "face.fap", *arguments, code=code).err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["face.fap"]
