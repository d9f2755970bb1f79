"""`fba archive`: many performances in a few Parquet files, for trainers, searches and keeping."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import click

from fba.cli import options
from fba.cli.coding.tolerance_options import LENGTH
from fba.cli.command import Group, examples, option_errors
from fba.cli.inputs import read_model
from fba.cli.option_fields import group, option, with_options
from fba.cli.printing import Progress, print_json, seconds_text, table_lines
from fba.errors import FormatError

FOLDER = click.Path(file_okay=False, path_type=Path)
"""A folder to write into, which need not exist."""


class ArchiveType(click.ParamType[Any]):
    """The folder of an archive: a path, or an address as s3://bucket/archive. exists: as paths must."""

    name = "folder"

    def __init__(self, *, exists: bool) -> None:
        self._path: click.ParamType[Any] = options.ExistingPath(file_okay=False) if exists else FOLDER

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if isinstance(value, str) and "://" in value:
            from fba.archive import find_location

            return find_location(value)
        return self._path.convert(value, param, ctx)


ARCHIVE = ArchiveType(exists=True)
NEW_ARCHIVE = ArchiveType(exists=False)
SHOWN = ("name", "subject", "seconds", "bits_per_second", "blinks", "emotion", "limit_frames", "jump_frames",
         "frozen_frames")  # fmt: skip
"""Columns of an index that a query prints by default."""
MEGABYTE = 1_000_000

jobs_option = option(
    type=click.IntRange(1, 256), metavar="N", help="Processes to use; default: one for each processor."
)


def count_jobs(jobs: int | None) -> int:
    """Return the number of processes. jobs: value of `--jobs`."""
    from fba.archive import count_processors

    return jobs or count_processors()


@dataclass(frozen=True, kw_only=True)
class _Coding:
    """How files become streams."""

    period: Any = option(
        "--i-period",
        type=options.PERIOD,
        metavar="SECONDS",
        help="Seconds from one I plane, where a window can begin, to the next; encodes .fba files, too. "
        "Default: 4 for other files, and .fba files keep their bytes.",
    )
    tolerance: float | None = option(
        type=LENGTH, metavar="0.5mm", help="Encode within this of what is shown; default: keep every value."
    )
    fap_quant: int | None = option(
        "--quant",
        type=click.IntRange(0, 31),
        metavar="Q",
        help="Quantiser of FAPs, in place of exact values.",
    )
    bap_quant: int | None = option(
        type=click.IntRange(0, 31), metavar="Q", help="Quantiser of BAPs, in place of exact values."
    )


@dataclass(frozen=True, kw_only=True)
class _Labels:
    """Whose the performances are, and what is known of them."""

    table: Path | None = option(
        type=options.FILE,
        metavar="LABELS.csv",
        help="Table with the column file, and others: subject, and labels of any name.",
    )
    levels: str | None = option(
        "--folders",
        metavar="subject,emotion",
        help="What the folders below FOLDER are, from the top; default: subject.",
    )
    sound: Literal["none", "reference", "inside"] = option(
        default="reference",
        help="Sound files beside the performances, of the same name: the name alone, the bytes too, or none.",
    )
    model: Path | None = options.model_option(
        "Face whose units (FAPU) are stored; default: the built-in head."
    )


@click.group(
    "archive",
    cls=Group,
    epilog=examples(
        "fba archive make takes/ --folders subject,emotion -o archive",
        "fba archive info archive/",
        "fba archive index archive/",
        'fba archive query archive/ "blinks > 10 and seconds < 60"',
    ),
)
def command() -> None:
    """Keep many performances in a few Parquet files, for trainers, searches and any Parquet reader."""


@command.command(
    "make",
    short_help="Make an archive of the files in folders, or add to it.",
    epilog=examples(
        "fba archive make takes/ -o archive",
        "fba archive make takes/ --folders subject,emotion --tolerance 0.5mm -o archive",
        "fba archive make streams/ --table labels.csv --sound inside -o archive",
    ),
)
@click.argument("folders", metavar="FOLDER...", nargs=-1, required=True, type=options.ExistingPath())
@with_options
def make_command(
    folders: tuple[Path, ...],
    target: Any = option(
        "-o",
        "--output",
        metavar="DIR",
        type=NEW_ARCHIVE,
        required=True,
        help="Folder of the archive, or its address, as s3://bucket/archive.",
    ),
    coding: _Coding = group(),
    labels: _Labels = group(),
    shard_size: int = option(
        type=click.IntRange(1, 2000),
        default=64,
        metavar="MB",
        help="Megabytes from which a new shard begins.",
    ),
    jobs: int | None = jobs_option,
    as_json: bool = options.json_option,
) -> None:
    """Make an archive of the animations in folders, or in files: any format that `fba convert` reads.

    Run again after an interruption, it goes on where it stopped; files that are in the archive already stay.
    Files that cannot be read are listed, and the exit code is 1.
    """
    from fba.archive import (
        Coding,
        check_levels,
        find_sources,
        label_by_folders,
        label_by_table,
        make_archive,
        units_of,
    )

    with option_errors("--folders "):
        levels = check_levels(labels.levels or "subject")
    table = [] if labels.table is None else [labels.table]
    sources = label_by_folders(find_sources(folders, leave_out=table), levels)
    if labels.table is not None:
        sources = label_by_table(sources, labels.table)
    if not sources:
        raise FormatError("holds no file of a format that is read", path=folders[0])
    model = read_model(labels.model)
    period = None if coding.period is None else float(coding.period)
    reports = make_archive(
        sources, target, sound=labels.sound, jobs=count_jobs(jobs), shard_bytes=shard_size * MEGABYTE,
        coding=Coding(period, coding.tolerance, coding.fap_quant, coding.bap_quant),
        units=None if model is None else units_of(model),
    )  # fmt: skip
    added = unchanged = rounded = 0
    failed = []
    with Progress("archive", len(sources), "files") as step:
        for report in reports:
            step.advance()
            if report.error:
                failed.append((report.source.shown, report.error))
            else:
                added, unchanged = added + (not report.unchanged), unchanged + report.unchanged
                rounded += report.rounded
            for text in report.warnings:
                click.echo(f"fba: warning: {report.source.shown}: {text}", err=True)
    if as_json:
        listed = [{"file": name, "error": error} for name, error in failed]
        print_json({"added": added, "unchanged": unchanged, "rounded": rounded, "failed": listed})
    else:
        text = f"{target}: {added} performances added, {unchanged} there before, {len(failed)} failed"
        click.echo(text + (f"; {rounded} values rounded to quantiser steps" if rounded else ""))
        print_failures(failed)
    if failed:
        raise click.exceptions.Exit(1)


def print_failures(failed: Iterable[tuple[str, str]]) -> None:
    """Print a table of files and why they failed; nothing without any."""
    rows = list(failed)
    if rows:
        click.echo("\n".join(table_lines(["failed", "why"], rows)))


@command.command("info", epilog=examples("fba archive info archive/"))
@click.argument("folder", metavar="DIR", type=ARCHIVE)
@with_options
def info_command(folder: Any, as_json: bool = options.json_option) -> None:
    """Show what an archive holds: performances, hours, subjects, labels, bytes."""
    from fba.archive import Archive, describe_archive

    about = describe_archive(Archive(folder))
    if as_json:
        print_json(about)
        return
    rates = ", ".join(f"{rate:g}" for rate in about["rates"])
    click.echo(
        f"{folder}: {about['performances']} performances in {about['shards']} shards, "
        f"{about['bytes']} bytes\n"
        f"{seconds_text(about['seconds'])}, {about['frames']} frames at {rates} frames/s\n"
        f"{about['faces']} faces, {about['bodies']} bodies, {about['subjects']} subjects\n"
        f"{about['starts']} I planes at which a window can begin"
    )
    for name, count in about["labels"].items():
        click.echo(f"label {name}: {count} values")


@command.command(
    "extract",
    epilog=examples(
        "fba archive extract archive/ -o streams", "fba archive extract archive/ anna/joy/take1 -o streams"
    ),
)
@click.argument("folder", metavar="DIR", type=ARCHIVE)
@click.argument("names", metavar="[NAME...]", nargs=-1)
@with_options
def extract_command(
    folder: Any,
    names: tuple[str, ...],
    target: Path = option(
        "-o", "--output", metavar="FOLDER", type=FOLDER, required=True, help="Folder for the files."
    ),
) -> None:
    """Write performances of an archive as .fba files, byte for byte, and the sounds that it holds."""
    from fba.archive import Archive, extract

    archive = Archive(folder)
    count = 0
    with Progress("extracting", len(names) or len(archive), "files") as step:
        for _ in extract(archive, names, target):
            step.advance()
            count += 1
    click.echo(f"{target}: {count} files")


@command.command("verify", epilog=examples("fba archive verify archive/"))
@click.argument("folder", metavar="DIR", type=ARCHIVE)
@with_options
def verify_command(folder: Any, jobs: int | None = jobs_option, as_json: bool = options.json_option) -> None:
    """Check an archive: decode every stream, compare it with its digest and its row, begin at every I plane.

    Exits with 1 if anything is damaged.
    """
    from fba.archive import verify_archive

    good, bad = 0, []
    with Progress("checking", None) as step:
        for check in verify_archive(folder, jobs=count_jobs(jobs)):
            step.advance()
            good += not check.faults
            bad += [(check.name or check.shard.name, fault) for fault in check.faults]
    if as_json:
        print_json({"intact": good, "faults": [{"name": name, "fault": fault} for name, fault in bad]})
    else:
        click.echo(f"{folder}: {good} performances intact, {len(bad)} faults")
        print_failures(bad)
    if bad:
        raise click.exceptions.Exit(1)


@command.command("index", epilog=examples("fba archive index archive/"))
@click.argument("folder", metavar="DIR", type=ARCHIVE)
@with_options
def index_command(folder: Any, jobs: int | None = jobs_option) -> None:
    """Describe every performance in index.parquet, so that `fba archive query` finds it.

    It has what moves and how much, bits of each group of parameters, doubtful frames (beyond limits, jumps,
    frozen), blinks and expressions. Performances that are described already are left as they are.
    """
    from fba.archive import index_archive

    count, failed = 0, []
    with Progress("describing", None) as step:
        for done in index_archive(folder, jobs=count_jobs(jobs)):
            step.advance()
            count += not done.error
            failed += [(done.name, done.error)] if done.error else []
    click.echo(f"{folder}: {count} performances described")
    print_failures(failed)
    if failed:
        raise click.exceptions.Exit(1)


@command.command(
    "query",
    epilog=examples(
        'fba archive query archive/ "blinks > 10 and seconds < 60"',
        "fba archive query archive/ \"labels['emotion'] = 'joy'\" --columns name,seconds --sort -seconds",
    ),
)
@click.argument("folder", metavar="DIR", type=ARCHIVE)
@click.argument("condition", metavar="[CONDITION]", default="true")
@with_options
def query_command(
    folder: Any,
    condition: str,
    columns: str | None = option(metavar="NAME,NAME", help="Columns to show; all: every column."),
    sort: str | None = option(metavar="NAME", help="Sort by this column; -NAME: the largest first."),
    limit: int | None = option("--limit", type=click.IntRange(0), metavar="N", help="Most rows."),
    as_json: bool = options.json_option,
) -> None:
    """Print the performances of an archive of which a condition is true, as SQL has it.

    The columns are those of `fba archive index`. The condition can read no other file, and write none.
    """
    from fba.archive import query

    chosen = SHOWN if columns is None else None if columns == "all" else tuple(columns.split(","))
    with option_errors():
        table = query(folder, condition, columns=chosen, sort=sort, limit=limit)
    rows = table.to_pylist()
    if as_json:
        print_json([{name: _plain(value) for name, value in row.items()} for row in rows])
    elif rows:
        names = table.column_names
        cells = [[_cell(row[name]) for name in names] for row in rows]
        click.echo("\n".join(table_lines(names, cells)))
    click.echo(f"{len(rows)} performances", err=True)


def _plain(value: Any) -> Any:
    """Return a value for JSON: pairs of a map as an object."""
    if isinstance(value, list) and value and all(isinstance(one, tuple) for one in value):
        return dict(value)
    return value


def _cell(value: Any) -> str:
    value = _plain(value)
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:.2f}"
    if isinstance(value, dict):
        return " ".join(f"{key}={_cell(one)}" for key, one in value.items())
    if isinstance(value, list):
        return " ".join(map(_cell, value))
    return str(value)
