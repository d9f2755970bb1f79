"""`./dev bitrate`: what faces and bodies take as FBA, and in other ways, at the same error."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib.resources import files as package_files
from pathlib import Path
from typing import Literal

import click

from bench.bitrate import (
    Result,
    Subject,
    make_page,
    make_pictures,
    read_results,
    results_csv,
    split_subjects,
    summary_lines,
)
from bench.bitrate.measurement import measure
from bench.bitrate.packages import EXTRA
from bench.bitrate.page import picture_names
from bench.bitrate.rivals import missing_packages
from fba.cli import options
from fba.cli.coding.clamped_values import bring_near
from fba.cli.inputs import Reading, read_file
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import Output, Outputs
from fba.errors import FbaError
from fba.parameters import BAP_STEPS_AUTO, BapTable

SAMPLES = ("hello.fap", "talk.c3d", "hello.bvh")
"""What is measured where no file is given: it comes with fba."""
FINE: BapTable = "visage"
"""The table of BAP steps for files that are not streams."""
TABLE = "results.csv"
PAGE = "bitrate.md"


@click.command(
    "bitrate",
    epilog="Examples: ./dev bitrate --summary; ./dev bitrate talk.fba walk.bvh -o study; "
    "./dev bitrate --results study/results.csv --summary",
)
@click.argument("files", metavar="[FILE...]", nargs=-1, type=options.EXISTING)
@with_options
def command(
    files: tuple[Path, ...],
    folder: Path | None = option(
        "-o",
        metavar="FOLDER",
        type=click.Path(file_okay=False, path_type=Path),
        help="Folder for the page bitrate.md, its pictures, and results.csv.",
    ),
    summary: bool = option(default=False, help="Print the main results as a Markdown table."),
    tables: tuple[Path, ...] = option(
        "--results",
        default=(),
        metavar="FILE.csv",
        type=options.EXISTING,
        help="Results measured before, instead of measuring; repeatable.",
    ),
    only: Literal["face", "body"] | None = option(help="Measure only the faces, or only the bodies."),
    title: str | None = option(
        metavar="TEXT", help="What the files are, for the tables; default: their number."
    ),
    no_clobber: bool = options.no_clobber_option,
    reading: Reading = group("bap_steps", "limit"),
) -> None:
    """Measure bit rates and errors of faces and bodies, beside other ways to send the same.

    FILE: streams, captures, any file with an animation; without one, the samples that come with fba. Each
    is coded by fba at many settings, and the same values by general-purpose compressors, as a file and live.
    Takes about a second for each second of animation; needs the packages of the extra `bench`.
    """
    if tables and files:
        raise click.UsageError("give files to measure or --results, not both")
    if not title:
        title = f"{len(files)} file{'s' * (len(files) > 1)}" if files else "samples of fba"
    measured = _read_results(tables)
    outputs = None
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        titles = dict.fromkeys(one.data for one in measured) or [title]
        names = [TABLE, PAGE, *(name for data in titles for name in picture_names(data))]
        outputs = Outputs(
            [Output("-o", folder / name) for name in names], [*files, *tables], no_clobber=no_clobber
        )
    results = measured or _measure(title, files, only, reading)
    if folder is not None and outputs is not None:
        outputs.write(folder / TABLE, results_csv(results).encode())
        for name, data in make_pictures(results).items():
            outputs.write(folder / name, data)
        outputs.write(folder / PAGE, make_page(results).encode())
        click.echo(f"made {folder / PAGE}", err=True)
    if summary or folder is None:
        click.echo("\n".join(summary_lines(results)))


def _read_results(tables: Sequence[Path]) -> list[Result]:
    return [result for table in tables for result in read_results(table)]


def _measure(title: str, files: Sequence[Path], only: str | None, reading: Reading) -> list[Result]:
    """Return the results of files, or of the samples. title: what they are."""
    for package in missing_packages():
        click.echo(f"fba: {package} is not installed, so its rows are left out: {EXTRA}", err=True)
    subjects: list[Subject] = []
    paths = list(files) or [Path(str(package_files("fba") / "samples" / name)) for name in SAMPLES]
    for path in paths:
        subjects += _subjects_of(path, only, reading)
    return measure(title, subjects, lambda line: click.echo(f"fba: {line}", err=True))


def _subjects_of(path: Path, only: str | None, reading: Reading) -> list[Subject]:
    """Return the face and the body of a file, if they move and are asked for."""
    read = read_file(path, reading)
    animation = read.animation
    steps = read.table or (FINE if reading.bap_steps == BAP_STEPS_AUTO else reading.bap_steps)
    if read.table is None:
        animation = bring_near(animation, steps, 1)
    found = split_subjects(path.name, animation, steps)
    if not found:
        click.echo(f"fba: {path}: nothing moves; left out", err=True)
    return [one for one in found if only in (None, one.kind)]


def main(arguments: list[str] | None = None) -> None:
    """Run the command and exit as `fba` does: 0 done, 1 bad data, 2 bad usage."""
    try:
        command.main(arguments, prog_name="./dev bitrate")
    except FbaError as error:
        click.echo(f"error: {error}", err=True)
        sys.exit(1)


if __name__ == "__main__":
    main()
