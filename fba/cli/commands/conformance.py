"""`fba conformance`: checks this codec against test vectors."""

from __future__ import annotations

from pathlib import Path

import click

from fba.cli import options
from fba.cli.command import Command, examples
from fba.cli.printing import Progress, print_json


@click.command(
    cls=Command,
    epilog=examples(
        "fba conformance                 # the vectors that come with fba",
        "fba conformance ../vectors      # a folder with an index.json",
    ),
)
@click.argument("folder", required=False, type=click.Path(exists=True, file_okay=False, path_type=Path))
@click.option("--verbose", "-v", is_flag=True, help="Print a line for every vector, not only for failures.")
@options.json_option
def command(folder: Path | None, verbose: bool, as_json: bool) -> None:
    """Check this codec against test vectors: decoded values and encoded bytes, both exact.

    Exits with 1 if a vector fails.
    """
    from fba_conformance.runner import check, vectors

    checked = vectors(folder)
    results = []
    with Progress("checking", len(checked)) as step:
        for vector in checked:
            results.append(check(vector))
            step.advance()
    failed = [result for result in results if not result.passed]
    if as_json:
        print_json([result.to_dict() for result in results])
    else:
        for result in results if verbose else failed:
            click.echo(result.line())
        encoded = sum(result.encoded is not None for result in results)
        click.echo(
            f"{len(results) - len(failed)} of {len(results)} vectors pass: {len(results)} decoded, "
            f"{encoded} encoded again to the same bytes"
        )
    if failed:
        raise click.exceptions.Exit(1)
