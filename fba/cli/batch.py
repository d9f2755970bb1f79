"""`fba convert --batch`: a folder of files, in several processes or on a cluster."""

from __future__ import annotations

import contextlib
import io
import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePath, PurePosixPath
from typing import Any

import click

from fba.cli import options
from fba.cli.command import NAME
from fba.cli.option_fields import option
from fba.cli.outputs import OutputType, find_writer
from fba.cli.printing import Progress, table_lines
from fba.errors import FormatError

FOLDER = options.ExistingPath(file_okay=False)


def _address(value: Any, ctx: click.Context | None) -> Any:
    """Return the place of an address, as s3://bucket/folder, that stands for a folder; None for paths."""
    if ctx is None or not ctx.params.get("batch") or "://" not in str(value):
        return None
    from fba.archive import find_location

    return find_location(str(value))


class BatchInput(options.InputType):
    """A file to read, "-" for standard input; with --batch, a folder, or its address."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if (place := _address(value, ctx)) is not None:
            return place
        if ctx is not None and ctx.params.get("batch"):
            return FOLDER.convert(value, param, ctx)
        return super().convert(value, param, ctx)


class BatchOutput(OutputType):
    """A file to write, "-" for standard output; with --batch, a folder, or its address."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        if (place := _address(value, ctx)) is not None:
            return place
        if ctx is not None and ctx.params.get("batch"):
            path = Path(value)
            if path.exists() and not path.is_dir():
                self.fail(f"{path} is a file; with --batch, give a folder", param, ctx)
            return path
        return super().convert(value, param, ctx)


@dataclass(frozen=True, kw_only=True)
class Batch:
    """Whether, and where, a folder of files is converted."""

    batch: bool = option(
        default=False,
        is_eager=True,
        help="Convert all files in the folder IN, and below it, into the folder OUT.",
    )
    jobs: int | None = option(
        type=click.IntRange(1, 256),
        metavar="N",
        help="With --batch: processes to use; default: one for each processor.",
    )
    scheduler: str | None = option(
        metavar="ADDRESS",
        help="With --batch: use the workers of this scheduler of dask.distributed, as tcp://host:8786.",
    )

    def check_alone(self) -> None:
        """Raise click.UsageError for options that need --batch."""
        for flag, value in (("--jobs", self.jobs), ("--scheduler", self.scheduler)):
            if value is not None:
                raise click.UsageError(f"{flag} goes with --batch")


def convert_folder(
    source: Any,
    target: Any,
    to: str | None,
    batch: Batch,
    convert: Callable[[Path, Path], None],
    settings: str,
) -> None:
    """Convert a folder of files.

    source, target: paths, or places elsewhere (`fba.archive.find_location`). convert: converts a file, as
    the command does. settings: text that stands for all its settings.

    Exits with 1 if a file failed.
    """
    from fba.archive import RECORD, convert_batch, count_processors, find_sources, for_each, for_each_on

    if to is None:
        raise click.UsageError("--batch needs the format of the results: --to fba, for example")
    if batch.jobs is not None and batch.scheduler is not None:
        raise click.UsageError("--jobs and --scheduler contradict each other: a cluster has its own workers")
    suffix = find_writer(Path("a"), to).suffixes[0]
    inner, outer = _resolved(target), _resolved(source)
    if inner == outer or outer in inner.parents or inner in outer.parents:
        raise click.UsageError("IN and OUT must be two folders, neither of them in the other")
    sources = find_sources([source])
    if not sources:
        raise FormatError("holds no file of a format that is read", path=source)
    mapper: Any = partial(for_each, jobs=batch.jobs or count_processors())
    if batch.scheduler is not None:
        mapper = partial(for_each_on, batch.scheduler)
        source, target = _absolute(source), _absolute(target)  # workers may have another folder
        sources = find_sources([source])
    done = convert_batch(
        sources, target, suffix, partial(_convert_quietly, convert=convert), settings=settings,
        for_each=mapper,
    )  # fmt: skip
    converted = unchanged = 0
    failed: list[list[str]] = []
    warned: Counter[str] = Counter()
    said: dict[str, str] = {}
    with Progress("converting", len(sources), "files") as step:
        for one in done:
            step.advance()
            if one.error:
                failed.append([one.source, one.error])
            else:
                converted, unchanged = converted + (not one.unchanged), unchanged + one.unchanged
            for text in () if one.unchanged else one.warnings:
                kind = re.sub(r"[0-9][0-9.,]*", "#", text)  # the same of another number of frames
                if kind not in said:
                    said[kind] = text
                    click.echo(f"fba: warning: {one.source}: {text}", err=True)
                warned[kind] += 1
    for kind, count in warned.items():
        if count > 1:
            files = "1 more file" if count == 2 else f"{count - 1:,} more files"
            click.echo(f"fba: warning: in {files}, as {RECORD} lists: {said[kind]}", err=True)
    click.echo(
        f"{target}: {converted} converted, {unchanged} there before, {len(failed)} failed; {RECORD} lists all"
    )
    if failed:
        click.echo("\n".join(table_lines(["failed", "why"], failed)))
        raise click.exceptions.Exit(1)


def _resolved(place: Any) -> PurePath:
    """Return a path without links, or the parts of an address, to compare with others."""
    return place.resolve() if isinstance(place, Path) else PurePosixPath(str(place).rstrip("/"))


def _absolute(place: Any) -> Any:
    return place.resolve() if isinstance(place, Path) else place


def _convert_quietly(source: Path, target: Path, *, convert: Callable[[Path, Path], None]) -> None:
    """Convert a file as the command does, without what it prints. Runs in other processes."""
    from fba.cli.main import group

    root = click.Context(group, info_name=NAME)
    command = group.get_command(root, "convert")
    assert command is not None
    silent = io.StringIO()
    try:
        with (
            click.Context(command, parent=root, info_name="convert"),
            contextlib.redirect_stdout(silent),
            contextlib.redirect_stderr(silent),
        ):
            convert(source, target)
    except click.ClickException as error:
        raise FormatError(error.format_message(), path=source) from error
