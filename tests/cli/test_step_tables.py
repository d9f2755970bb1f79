"""The table of BAP steps, which no stream names: reminders after writing, warnings after reading."""

from __future__ import annotations

import io
import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import fba
from fba import Animation, player
from fba.body import gait

Run = Callable[..., Any]

WARNED = "BAPs look implausible with the BAP steps 'iso' (the root goes "
ASKED = "; made with --bap-steps visage?\n"


@pytest.fixture(autouse=True)
def a_display(monkeypatch: pytest.MonkeyPatch) -> None:
    """No window is opened here: `play` need not find a display for one."""
    monkeypatch.setattr(player, "check_display", lambda: None)


@pytest.fixture
def walk(tmp_path: Path) -> Path:
    """A walk, made with the table that is not the default."""
    path = tmp_path / "a walk.fba"
    fba.write(path, gait.walk(), bap_steps="visage")
    return path


def files_with_a_body(folder: Path) -> dict[str, Path]:
    paths = {"bap": folder / "walk.bap", "iso": folder / "iso.fba"}
    fba.write(paths["bap"], gait.walk())
    fba.write(paths["iso"], gait.walk(), clamp=True)
    return paths


def test_the_reminder_is_a_command_that_works(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = []
    monkeypatch.setattr(player, "play", lambda scene, **_: shown.append(scene.animation) or ())
    source, target = files_with_a_body(tmp_path)["bap"], tmp_path / "my walk.fba"
    written = {
        "encode": ("encode", source, "-o", target),
        "convert": ("convert", source, target),
        "gait": ("gait", "-o", target),
    }
    for arguments in written.values():
        done = run(*arguments, "--bap-steps", "visage")
        assert (done.code, done.err) == (0, f"Play it with: fba play '{target}' --bap-steps visage\n")
        played = run(*shlex.split(done.err.partition(": ")[2])[1:])
        assert (played.code, played.err) == (0, "")
        apart = shown.pop().body.values.astype(int) - gait.walk().body.values  # type: ignore[union-attr]
        assert abs(apart[:, 180:183]).max() <= 1


def test_no_reminder_where_no_option_is_needed(run: Run, tmp_path: Path, face: Animation) -> None:
    talk, target = tmp_path / "talk.fap", tmp_path / "out.fba"
    fba.write(talk, face)
    assert run("encode", talk, "-o", target, "--bap-steps", "visage").err == ""
    paths = files_with_a_body(tmp_path)
    assert "Play it with" not in run("encode", paths["bap"], "-o", target, "--clamp").err
    unquantised = ("--bap-quant", 0, "--clamp", "--bap-steps", "visage")
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
        assert done.code == 0
        assert json.loads(done.out)["bap_steps"] == table
        assert "Play it with" not in done.err


def test_every_writer_warns_that_the_standards_steps_are_coarse(run: Run, tmp_path: Path) -> None:
    paths, target = files_with_a_body(tmp_path), tmp_path / "out.fba"
    coarse = "fba: warning: the standard's BAP steps move the root by 64 mm at a time"
    assert run("encode", paths["bap"], "-o", target, "--clamp").err.startswith(coarse)
    assert run("convert", paths["bap"], target).err.startswith(coarse)
    assert run("gait", "-o", target).err.startswith(coarse)
    # What has these steps already loses nothing by them
    assert run("convert", paths["iso"], target).err == ""


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
        wrong, right = run(*arguments), run(*arguments, "--bap-steps", "visage")
        assert (wrong.code, right.code) == (0, 0), arguments
        assert wrong.err.startswith(f"fba: warning: {walk}: {WARNED}"), arguments
        assert ASKED in wrong.err
        assert wrong.err.count("implausible") == 1
        assert "implausible" not in right.err
    assert run("info", files_with_a_body(tmp_path)["iso"]).err == ""


def test_the_other_way_round(run: Run, tmp_path: Path) -> None:
    path = files_with_a_body(tmp_path)["iso"]
    err = run("decode", path, "--bap", tmp_path / "out.bap", "--bap-steps", "visage").err
    assert "with the BAP steps 'visage' (the root stays where it is while the legs carry it" in err
    assert err.endswith("; made with --bap-steps iso?\n")


def test_the_window_is_told(run: Run, walk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, Any] = {}
    monkeypatch.setattr(player, "play", lambda _, **options: given.update(options) or ())
    done = run("play", walk)
    assert done.code == 0
    assert given["warnings"] == (done.err.removeprefix("fba: warning: ").strip(),)
    assert WARNED in done.err
    assert run("play", walk, "--bap-steps", "visage").err == ""
    assert given["warnings"] == ()


def test_a_picture_is_made_with_the_warning(
    run: Run, walk: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from fba_player.export import render

    monkeypatch.setattr(render, "render", lambda *_, **__: "the picture")
    done = run("render", walk, "-o", tmp_path / "walk.png")
    assert (done.code, WARNED in done.err) == (0, True)


def test_a_stream_that_arrives(run: Run, walk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def play(scene: Any, **_: Any) -> tuple[()]:
        assert scene.animation.wait_end(20)
        return ()

    class Stdin:
        def __init__(self) -> None:
            self.buffer = io.BufferedReader(io.BytesIO(walk.read_bytes()))  # type: ignore[arg-type]

        def isatty(self) -> bool:
            return False

    monkeypatch.setattr(player, "play", play)
    monkeypatch.setattr("sys.stdin", Stdin())
    done = run("play", "-")
    assert done.code == 0
    assert done.err.startswith(f"fba: warning: standard input: {WARNED}")
    monkeypatch.setattr("sys.stdin", Stdin())
    assert run("play", "-", "--bap-steps", "visage").err == ""


def test_only_the_beginning_is_decoded_twice(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from fba.cli import step_tables

    path = tmp_path / "long.fba"
    once = gait.walk(cycles=8)
    rows = [frame % len(once) for frame in range(6000)]
    assert once.body is not None
    body = fba.BodyTrack(once.body.values[rows], once.body.mask[rows])
    fba.write(path, Animation(30, range(6000), None, body), bap_steps="visage")  # type: ignore[arg-type]
    looked = []
    warn = step_tables.warn_of_doubt

    def counting(name: Path, animation: Animation, table: str) -> str | None:
        looked.append(len(animation))
        return warn(name, animation, table)

    monkeypatch.setattr(step_tables, "warn_of_doubt", counting)
    assert WARNED in run("info", path).err
    assert step_tables.FRAMES_CHECKED <= looked[0] < 4000
