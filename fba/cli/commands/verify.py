"""`fba verify`: whether streams are complete and undamaged, and their values unchanged."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import click

from fba.cli import options, step_tables
from fba.cli.command import Command, EachFile, examples
from fba.cli.inputs import Reading, input_file, read_stream
from fba.cli.option_fields import group, option, with_options
from fba.cli.printing import Progress, print_json, print_table
from fba.errors import FormatError

_DIGITS = 16
"""Digits of a digest in the table; --json has all 64."""


@click.command(
    cls=Command,
    epilog=examples(
        "fba verify archive/*.fba",
        "fba verify --json archive/*.fba > archive.json     # to be kept with the archive",
        "fba verify archive/*.fba --against archive.json    # a year later",
    ),
)
@click.argument("files", metavar="FILE.fba...", nargs=-1, required=True, type=options.EXISTING)
@with_options
def command(
    files: tuple[Path, ...],
    against: Path | None = option(
        type=options.EXISTING,
        metavar="REPORT.json",
        help="Also compare the digests with those of an earlier --json report.",
    ),
    reading: Reading = group("bap_steps", "limit", "track"),
    as_json: bool = options.json_option,
) -> None:
    """Check FBA streams: end code, damage, frames lost and in doubt, and a digest of the decoded values.

    The digest depends on frame rate, times and values alone, not on how they are coded. It also finds
    changes that leave the syntax of a stream intact. Exits with 1 if a stream is damaged, cut off or changed.
    """
    from fba.codec import verify_stream

    digests = _read_digests(against) if against is not None else {}
    reports: list[dict[str, Any]] = []
    each = EachFile(files)
    with Progress("checking", len(files)) as step:
        for path in files:
            with each.file(path), input_file(path) as file:
                data = read_stream(file, reading)
                table = step_tables.table_to_read(path, data, reading.bap_steps, reading.limit)
                verification = verify_stream(data, bap_steps=table, limits=reading.limit)
                report = {"file": str(path), **verification.to_dict()}
                if against is not None:
                    earlier = digests.get(str(path))
                    report["unchanged"] = None if earlier is None else earlier == verification.digest
                reports.append(report)
            step.advance()
    if as_json:
        print_json(reports if len(files) > 1 else reports[0])
    elif reports:
        columns = ("frames", "seconds", "end code", "damage", "lost", "in doubt", "result", "digest")
        print_table(columns, [_row(report) for report in reports])
        for report in reports:
            for damage in report["damage"]:
                click.echo(f"{report['file']}: {damage['text']}")
            for warning in report["warnings"]:
                click.echo(f"{report['file']}: warning: {warning}")
    each.finish()
    if not all(report["intact"] and report.get("unchanged") is not False for report in reports):
        raise click.exceptions.Exit(1)


def _read_digests(report: Path) -> dict[str, str]:
    """Return the digests of an earlier report by file; FormatError for other files."""
    with input_file(report) as file:
        try:
            entries = json.loads(file.read_bytes())
            entries = entries if isinstance(entries, list) else [entries]
            return {str(entry["file"]): str(entry["digest"]) for entry in entries}
        except (ValueError, TypeError, KeyError) as error:
            raise FormatError(f"this is no report of fba verify --json: {error}", path=report) from error


def _row(report: dict[str, Any]) -> list[str]:
    """Return the cells of a report."""
    result = "intact" if report["intact"] else "DAMAGED"
    if report.get("unchanged") is False:
        result = f"{result}, CHANGED"
    elif "unchanged" in report:
        result = f"{result}, {'unchanged' if report['unchanged'] else 'not in the report'}"
    lost = "?" if report["frames_lost"] is None else str(report["frames_lost"])
    return [
        report["file"],
        str(report["frames"]),
        f"{report['duration']:.2f}",
        "yes" if report["ended"] else "NO",
        str(len(report["damage"])),
        lost,
        str(report["doubtful"]),
        result,
        report["digest"][:_DIGITS],
    ]
