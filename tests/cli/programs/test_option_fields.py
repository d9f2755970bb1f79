"""Options of commands from the fields of dataclasses and of the library's own option classes."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

import click
import pytest
from click.testing import CliRunner

from fba import EncoderOptions
from fba.cli.option_fields import documented, group, option, option_like, with_options


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
