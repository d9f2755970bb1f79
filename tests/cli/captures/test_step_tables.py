"""The table of BAP steps: which one is written and read, and what users are told about it."""

import json
import shlex
from pathlib import Path
from typing import Any

import pytest

import fba
from command_line import Run, pipe_in
from fba import Animation, player
from fba.body import gait
from fba.codec import marked_table

CHOSEN = "BAP steps visage (likely): the stream does not say, and with iso the root goes "
WARNED = "BAPs look implausible with the BAP steps 'iso' (the root goes "
ASKED = "; made with --bap-steps visage?\n"


@pytest.fixture(autouse=True)
def a_display(monkeypatch: pytest.MonkeyPatch) -> None:
    """No window is opened here: `play` need not find a display for one."""
    monkeypatch.setattr(player, "check_display", lambda: None)


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    """A walk, made with the table that is not the default, as other encoders make it: without a mark."""
    path = tmp_path / "a walk.fba"
    fba.write(path, gait.walk(), bap_steps="visage", mark=False)
    return path


def files_with_a_body(folder: Path) -> dict[str, Path]:
    paths = {"bap": folder / "walk.bap", "iso": folder / "iso.fba"}
    fba.write(paths["bap"], gait.walk())
    fba.write(paths["iso"], gait.walk(), clamp=True, mark=False)
    return paths


def test_written_streams_are_read_with_the_right_table(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the mark nothing has to be given; without it, the reminder is a command that works."""
    shown = []
    monkeypatch.setattr(player, "play", lambda build, **_: shown.append(build().animation) or ())
    monkeypatch.setattr(player.Surface, "open", lambda *_: None)
    source, target = files_with_a_body(tmp_path)["bap"], tmp_path / "my walk.fba"
    for arguments in (("encode", source, "-o", target), ("convert", source, target), ("gait", "-o", target)):
        assert run(*arguments, "--bap-steps", "visage").err == ""
        apart = fba.read(target).body.values.astype(int) - gait.walk().body.values  # type: ignore[union-attr]
        assert abs(apart[:, 180:183]).max() <= 1
        done = run(*arguments, "--bap-steps", "visage", "--no-mark")
        assert done.err == f"Play it with: fba play '{target}' --bap-steps visage\n"
    assert run(*shlex.split(done.err.partition(": ")[2])[1:]).err == ""
    apart = shown.pop().body.values.astype(int) - gait.walk().body.values  # type: ignore[union-attr]
    assert abs(apart[:, 180:183]).max() <= 1


def test_which_steps_are_written(run: Run, tmp_path: Path, bvh: Path, walk: Path, face: Animation) -> None:
    """Captures and walks get the finer steps where the stream can say so; other bodies keep theirs."""
    talk, target, paths = tmp_path / "talk.fap", tmp_path / "out.fba", files_with_a_body(tmp_path)
    fba.write(talk, face)
    epf = tmp_path / "walk.epf"
    run("decode", walk, "--epf", epf)
    for arguments, table, marked in (
        (("encode", bvh, "-o", target), "visage", True),
        (("convert", bvh, target), "visage", True),
        (("gait", "-o", target), "visage", True),
        (("encode", bvh, "-o", target, "--no-mark"), "iso", False),
        (("encode", bvh, "-o", target, "--bap-steps", "iso"), "iso", True),
        (("encode", paths["bap"], "-o", target, "--clamp"), "iso", True),
        (("encode", walk, "-o", target, "--preset", "reference"), "visage", True),
        (("convert", walk, target), "visage", True),
        (("encode", paths["iso"], "-o", target), "iso", True),
        (("encode", walk, "-o", target, "--epf", epf), "visage", False),
        (("encode", walk, "-o", target, "--epf", epf, "--mark"), "visage", True),
        (("encode", talk, "-o", target), "iso", False),
    ):
        run(*arguments)
        assert marked_table(target.read_bytes()) == (table if marked else None), arguments
        if table == "visage" and "encode" in arguments and walk in arguments:
            assert fba.read(target, bap_steps=table).body == fba.read(walk, bap_steps=table).body, arguments
    assert "--mark is for streams, and" in run("convert", walk, tmp_path / "out.bap", "--mark", code=2).err


def test_no_reminder_where_no_option_is_needed(run: Run, tmp_path: Path, face: Animation) -> None:
    talk, target = tmp_path / "talk.fap", tmp_path / "out.fba"
    fba.write(talk, face)
    assert run("encode", talk, "-o", target, "--bap-steps", "visage", "--no-mark").err == ""
    paths = files_with_a_body(tmp_path)
    assert "Play it with" not in run("encode", paths["bap"], "-o", target, "--clamp").err
    unquantised = ("--bap-quant", 0, "--clamp", "--bap-steps", "visage", "--no-mark")
    assert run("encode", paths["bap"], "-o", target, *unquantised).err == ""
    assert run("convert", paths["bap"], tmp_path / "out.bvh", "--bap-steps", "visage").err == ""


def test_the_report_has_the_table(run: Run, tmp_path: Path, face: Animation) -> None:
    talk, target = tmp_path / "talk.fap", tmp_path / "out.fba"
    fba.write(talk, face)
    walk = files_with_a_body(tmp_path)["bap"]
    for arguments, table in (
        ((walk, "--bap-steps", "visage"), "visage"),
        ((walk, "--clamp"), "iso"),
        ((talk,), None),
    ):
        done = run("encode", *arguments, "-o", target, "--json")
        assert json.loads(done.out)["bap_steps"] == table
        assert "Play it with" not in done.err


def test_every_writer_warns_that_the_standards_steps_are_coarse(run: Run, tmp_path: Path) -> None:
    paths, target = files_with_a_body(tmp_path), tmp_path / "out.fba"
    coarse = "fba: warning: the standard's BAP steps move the root by 64 mm at a time"
    assert run("encode", paths["bap"], "-o", target, "--clamp").err.startswith(coarse)
    assert run("convert", paths["bap"], target).err.startswith(coarse)
    assert run("gait", "-o", target, "--bap-steps", "iso").err.startswith(coarse)
    assert run("gait", "-o", target, "--no-mark").err.startswith(coarse)
    assert run("gait", "-o", target).err == ""
    # What has these steps already loses nothing by them
    assert "coarse" not in run("convert", paths["iso"], target).err


def test_every_reader_finds_the_steps(run: Run, tmp_path: Path, walk: Path) -> None:
    """In one line, and the same values as with the right option."""
    marked, iso = tmp_path / "marked.fba", files_with_a_body(tmp_path)["iso"]
    fba.write(marked, gait.walk(), bap_steps="visage")
    out = tmp_path / "out.bap"
    for command in (("decode", "--bap", out), ("convert", out), ("verify",)):
        for path, said in (
            (walk, CHOSEN),
            (marked, "BAP steps visage: the stream says so\n"),
            (iso, "BAP steps iso (unsure): the stream does not say, and with these nothing looks wrong\n"),
        ):
            out.unlink(missing_ok=True)
            done = run(command[0], path, *command[1:])
            assert done.err.startswith(f"fba: {path}: {said}"), (command, path)
            assert done.err.count("\n") == 1
            if out.exists():
                table = "iso" if path == iso else "visage"
                assert fba.read(out).body == fba.read(path, bap_steps=table).body
    shown = run("info", walk).out
    assert "  steps    visage (likely): the stream does not say, and with iso the root goes " in shown
    assert "  steps    visage: the stream says so\n" in run("info", marked).out
    assert json.loads(run("info", "--json", marked).out)["bap_steps"] == "visage"


def test_every_reader_warns(run: Run, tmp_path: Path, walk: Path) -> None:
    commands = [
        ("info", walk),
        ("stats", walk),
        ("decode", walk, "--bap", tmp_path / "out.bap"),
        ("convert", walk, tmp_path / "out.bvh"),
        ("encode", walk, "-o", tmp_path / "out.fba", "--clamp"),
        ("gait", "--find", walk),
    ]
    for arguments in commands:
        wrong, right = run(*arguments, "--bap-steps", "iso"), run(*arguments, "--bap-steps", "visage")
        assert (wrong.code, right.code) == (0, 0), arguments
        assert wrong.err.startswith(f"fba: warning: {walk}: {WARNED}"), arguments
        assert ASKED in wrong.err
        assert wrong.err.count("implausible") == 1
        assert "implausible" not in right.err
    assert run("info", files_with_a_body(tmp_path)["iso"], "--bap-steps", "iso").err == ""


@pytest.mark.parametrize("table", ["iso", "visage"])
def test_a_stream_with_a_mark_is_not_doubted(run: Run, tmp_path: Path, table: str) -> None:
    """Whatever its motion looks like; with another table than it names, that is said instead."""
    path, out = tmp_path / "hurried.fba", tmp_path / "out.bap"
    walk = files_with_a_body(tmp_path)["bap"]
    hurried = fba.read(walk)
    values = hurried.body.values.astype(int)
    values[:, 180:183] *= {"iso": 32, "visage": 1}[table]  # a root that runs away under the table it has
    values[:, 180:183] //= {"iso": 1, "visage": 32}[table]
    body = fba.BodyTrack(values, hurried.body.mask)
    odd = fba.Animation(hurried.rate, hurried.index, None, body)
    other = {"iso": "visage", "visage": "iso"}[table]
    fba.write(path, odd, bap_steps=table, clamp=True, mark=False)
    for command in (("info",), ("stats",), ("decode", "--bap", out), ("convert", out)):
        assert "implausible" in run(command[0], path, *command[1:], "--bap-steps", table).err, command
    fba.write(path, odd, bap_steps=table, clamp=True, mark=True)
    for command in (("info",), ("stats",), ("decode", "--bap", out), ("convert", out)):
        assert run(command[0], path, *command[1:], "--bap-steps", table).err == "", command
        err = run(command[0], path, *command[1:], "--bap-steps", other).err
        assert f"the stream says that its BAP steps are {table!r}, but it is read with {other!r}" in err
        assert "implausible" not in err


def test_a_stream_of_iso_steps_read_as_visage(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "iso.fba"
    fba.write(path, gait.walk(), clamp=True, mark=False)
    err = run("decode", path, "--bap", tmp_path / "out.bap", "--bap-steps", "visage").err
    assert "with the BAP steps 'visage' (the root stays where it is while the legs carry it" in err
    assert err.endswith("; made with --bap-steps iso?\n")


def test_the_window_is_told(run: Run, walk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Any] = {}
    monkeypatch.setattr(player, "play", lambda _, **options: given.update(options) or ())
    monkeypatch.setattr(player.Surface, "open", lambda *_: None)
    done = run("play", walk, "--bap-steps", "iso")
    assert given["bap_steps"] == "iso"
    assert given["warnings"] == (done.err.removeprefix("fba: warning: ").strip(),)
    assert WARNED in done.err
    assert run("play", walk, "--bap-steps", "visage").err == ""
    assert given["warnings"] == ()
    assert CHOSEN in run("play", walk).err
    assert (given["bap_steps"], given["warnings"]) == ("visage", ())


def test_a_picture_is_made_with_the_warning(
    run: Run, walk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from fba_player.export import render

    monkeypatch.setattr(render, "render", lambda *_, **__: "the picture")
    assert WARNED in run("render", walk, "-o", tmp_path / "walk.png", "--bap-steps", "iso").err
    assert CHOSEN in run("render", walk, "-o", tmp_path / "walk.png").err


def test_a_stream_that_arrives(run: Run, walk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def play(build: Any, **_: Any) -> tuple[()]:
        assert build().animation.wait_end(300)
        return ()

    monkeypatch.setattr(player, "play", play)
    monkeypatch.setattr(player.Surface, "open", lambda *_: None)
    pipe_in(monkeypatch, walk.read_bytes())
    assert run("play", "-", "--bap-steps", "iso").err.startswith(f"fba: warning: standard input: {WARNED}")
    pipe_in(monkeypatch, walk.read_bytes())
    assert run("play", "-", "--bap-steps", "visage").err == ""
    pipe_in(monkeypatch, walk.read_bytes())
    assert run("play", "-").err.startswith(f"fba: standard input: {CHOSEN}")
