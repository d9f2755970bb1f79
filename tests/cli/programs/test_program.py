"""Hints and usage lines begin with what the user typed; options come from the fields of dataclasses."""

import os
import subprocess
import sys
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

import click
import pytest
from click.testing import CliRunner

from fba import EncoderOptions
from fba.cli.command import program_words, with_program
from fba.cli.main import _COMMANDS
from fba.cli.option_fields import documented, group, option, option_like, with_options

HINT = "use it with `fba encode IN.fap -o OUT.fba --epf FILE`"
EPF = "FFR 0\n"
SCRIPT = Path(sys.executable).with_name("fba")


@pytest.fixture
def epf(tmp_path: Path) -> Path:
    path = tmp_path / "plan.epf"
    path.write_text(EPF)
    return path


def ran(*command: object, cwd: Path | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
    surroundings = {name: value for name, value in os.environ.items() if name != "FBA_DEV"} | environment
    words = [str(word) for word in command]
    return subprocess.run(words, capture_output=True, text=True, check=False, cwd=cwd, env=surroundings)


@pytest.mark.parametrize(
    ("typed", "program"),
    [("./dev", "./dev"), ("../my files/dev", "'../my files/dev'"), ("/opt/fba/dev", "/opt/fba/dev")],
)
def test_started_by_dev(epf: Path, typed: str, program: str) -> None:
    error = ran(sys.executable, "-m", "fba", "info", epf, FBA_DEV=typed)
    assert error.returncode == 1
    assert f"use it with `{program} fba encode IN.fap" in error.stderr
    assert "fba: error: " in error.stderr
    usage = ran(sys.executable, "-m", "fba", "info", "--jsno", FBA_DEV=typed)
    assert usage.stderr.startswith(
        f"Usage: {program} fba info [OPTIONS] FILE...\nTry '{program} fba info --help'"
    )
    shown = ran(sys.executable, "-m", "fba", "play", "--help", FBA_DEV=typed).stdout
    assert f"\n    {program} fba play talk.fba\n" in shown
    assert f"\n    nc host 7000 | {program} fba play -\n" in shown
    assert f"`{program} fba render`" in " ".join(shown.split())


def test_started_as_a_module(epf: Path) -> None:
    error = ran(sys.executable, "-m", "fba", "info", epf, PATH=os.devnull)
    assert f"use it with `{sys.executable} -m fba encode IN.fap" in error.stderr
    folder = os.path.dirname(sys.executable)
    on_path = ran("python", "-m", "fba", "info", epf, PATH=f"{folder}{os.pathsep}{os.environ['PATH']}")
    assert "use it with `python -m fba encode IN.fap" in on_path.stderr


@pytest.mark.skipif(not SCRIPT.exists(), reason="fba is not installed")
def test_started_as_a_script(epf: Path) -> None:
    elsewhere = ran(SCRIPT, "info", epf, PATH="/usr/bin:/bin")
    assert f"use it with `{SCRIPT} encode IN.fap" in elsewhere.stderr
    relative = ran(Path("bin") / "fba", "info", epf, cwd=SCRIPT.parent.parent, PATH="/usr/bin:/bin")
    assert "use it with `bin/fba encode IN.fap" in relative.stderr
    installed = ran("fba", "info", epf, PATH=f"{SCRIPT.parent}{os.pathsep}{os.environ['PATH']}")
    assert HINT in installed.stderr


def test_another_of_the_same_name_on_the_path_is_not_meant(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    for folder in ("one", "other place"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "fba").write_text("#!/bin/sh\n")
        (tmp_path / folder / "fba").chmod(0o755)
    monkeypatch.delenv("FBA_DEV", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path / "one"))
    monkeypatch.setattr(sys, "argv", [str(tmp_path / "one" / "fba")])
    assert program_words() == "fba"
    monkeypatch.setattr(sys, "argv", [str(tmp_path / "other place" / "fba")])
    assert program_words() == f"'{tmp_path}/other place/fba'"


def test_only_commands_are_replaced() -> None:
    text = "fba info x; a defect of fba; see docs/fba info; fba infos; `fba play -`; ./dev fba play"
    changed = (
        "./dev fba info x; a defect of fba; see docs/fba info; fba infos; `./dev fba play -`; ./dev fba play"
    )
    assert with_program(text, "./dev fba", _COMMANDS) == changed
    assert with_program(text, "fba", _COMMANDS) == text


@pytest.mark.slow
def test_the_hint_of_the_demo(tmp_path: Path) -> None:
    out = tmp_path / "my demo"
    done = ran(
        sys.executable,
        "-m",
        "fba",
        "demo",
        "--no-play",
        "--out",
        out,
        FBA_DEV="./dev",
        DISPLAY="",
        WAYLAND_DISPLAY="",
    )
    assert f"other pictures: ./dev fba render '{out}/hello.fba' -o picture.png --time 1.5\n" in done.stdout
    assert "to see it again" not in done.stdout  # where no window can be opened


@dataclass(frozen=True, kw_only=True)
class Size:
    """Width and height."""

    width: int = option(default=4, help="Width.")
    fine: bool = option(default=False)


@dataclass(frozen=True, kw_only=True)
class Request(Size):
    """What is asked for."""

    name: str
    output: str = option("-o", "--output", required=True)
    kind: Literal["a", "b"] = option(default="a")
    clamp: bool | None = option()
    words: tuple[str, ...] = option("--word", default=())
    start_codes: bool = option_like(EncoderOptions, "start_codes")


@click.command()
@click.argument("name")
@with_options
def command(request: Request, seconds: float = option(default=1.0, typed="1"), hidden: int = 3) -> None:
    click.echo(f"{request} {seconds} {hidden}")


def run(*words: str) -> str:
    result = CliRunner().invoke(command, words)
    return result.output.strip()


def test_types_and_defaults_are_those_of_the_fields() -> None:
    plain = Request(name="x", output="y", width=4, fine=False, clamp=None, start_codes=False)
    assert run("x", "-o", "y") == f"{plain} 1.0 3"
    given = Request(
        name="x", output="y", kind="b", clamp=False, words=("p", "q"), width=5, fine=True, start_codes=True
    )
    words = ["--no-clamp", "--word", "p", "--word", "q", "--width", "5", "--fine", "--start-codes"]
    assert run("x", "-o", "y", "--kind", "b", *words, "--seconds", "2") == f"{given} 2.0 3"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("x",), "Missing option '-o'"),
        (("x", "-o", "y", "--kind", "c"), "'c' is not one of 'a', 'b'"),
        (("x", "-o", "y", "--width", "wide"), "'wide' is not a valid integer"),
    ],
)
def test_invalid_values_are_bad_usage(words: tuple[str, ...], said: str) -> None:
    assert said in run(*words)


def test_help_shows_inherited_options_last() -> None:
    text = run("--help")
    assert text.index("--output") < text.index("--width")
    assert "[default: 4]" in text
    assert " ".join(documented(EncoderOptions, "start_codes").split()[:6]) in " ".join(text.split())


def test_a_command_may_take_some_options_of_a_dataclass() -> None:
    @click.command()
    @with_options
    def some(size: Size = group(width=option(default=7))) -> None:
        click.echo(str(size))

    @click.command()
    @with_options
    def one(size: Size = group("fine")) -> None:
        click.echo(str(size))

    assert CliRunner().invoke(some, []).output.strip() == str(Size(width=7, fine=False))
    assert CliRunner().invoke(one, ["--fine"]).output.strip() == str(Size(width=4, fine=True))
    assert CliRunner().invoke(one, ["--width", "3"]).exit_code == 2


def test_every_encoder_option_has_a_text() -> None:
    for one in fields(EncoderOptions):
        assert len(documented(EncoderOptions, one.name)) > len(one.name)


def test_importing_the_options_does_not_import_the_codec() -> None:
    import subprocess
    import sys

    code = (
        "import sys; import fba.cli.commands.encode, fba.cli.commands.render, fba.cli.commands.express; "
        "sys.exit(bool({'numba', 'scipy'} & set(sys.modules)))"
    )
    assert (
        subprocess.run([sys.executable, "-c", code], cwd=Path(__file__).parent, check=False).returncode == 0
    )
