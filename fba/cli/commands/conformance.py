"""`fba conformance`: checks this codec, or other programs, against test vectors."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fba.atomic import atomic
from fba.cli import options
from fba.cli.command import Command, examples
from fba.cli.inputs import ExistingPath
from fba.cli.outputs import Output, Outputs, OutputType, display_name
from fba.cli.printing import Progress

if TYPE_CHECKING:
    from fba_conformance.suite.index import Vector
    from fba_conformance.suite.programs import Program
    from fba_conformance.suite.result import Result


@click.command(
    cls=Command,
    epilog=examples(
        "fba conformance                                   # this codec, the vectors that come with it",
        "fba conformance --decoder 'mydecoder {in} {out}'  # another decoder",
        "fba conformance --zip fba-conformance.zip         # the vectors, for use without Python",
        "fba conformance ../vectors                        # a folder with an index.json",
    ),
)
@click.argument("folder", required=False, type=ExistingPath(file_okay=False))
@click.option(
    "--decoder",
    metavar="COMMAND",
    help="Test this decoder: it reads the stream {in} and writes values to {out}; {bap_steps}: iso, visage.",
)
@click.option(
    "--encoder",
    metavar="COMMAND",
    help="Test this encoder: it reads values from {in} and writes a stream to {out}, with {rate}, "
    "{fap_quant}, {bap_quant} and {bap_steps}.",
)
@click.option(
    "--timeout",
    type=click.FloatRange(min=0, min_open=True),
    default=20.0,
    show_default=True,
    metavar="SECONDS",
    help="How long a program may take for a vector.",
)
@click.option(
    "--only", multiple=True, metavar="NAME", help="Only vectors or groups of this name; may be repeated."
)
@click.option("--junit", type=OutputType(), metavar="FILE", help="Write JUnit XML, too.")
@click.option(
    "--zip",
    "archive",
    type=OutputType(),
    metavar="FILE",
    help="Write the vectors that come with fba as a zip, with all values as text, and test nothing.",
)
@click.option("--verbose", "-v", is_flag=True, help="Print a line for every vector, not only for failures.")
@options.no_clobber_option
@options.json_option
def command(
    folder: Path | None,
    decoder: str | None,
    encoder: str | None,
    timeout: float,
    only: Sequence[str],
    junit: Path | None,
    archive: Path | None,
    verbose: bool,
    no_clobber: bool,
    as_json: bool,
) -> None:
    """Check this codec, or the programs of --decoder and --encoder, against test vectors.

    Decoded values must be exact; what encodes to the same bytes again must do so. Exits with 1 if a
    vector fails.
    """
    if archive is not None:
        _write_archive(archive, folder, no_clobber=no_clobber)
        return
    written = [] if junit is None else [Output("--junit", junit, text=True)]
    outputs = Outputs(written, no_clobber=no_clobber)
    from fba_conformance.suite import result as results_module
    from fba_conformance.suite.index import read_vectors

    checks = _checks(decoder, encoder, timeout)
    vectors = _chosen(read_vectors(folder), only)
    results: list[Result] = []
    with Progress("checking", len(vectors) * len(checks)) as step:
        for check in checks:
            for vector in vectors:
                results.append(check(vector))
                step.advance()
    if junit is not None:
        outputs.write(junit, results_module.junit(results, decoder or encoder or "fba"))
    failed = [result for result in results if not result.passed]
    if as_json:
        outputs.print_json([result.to_dict() for result in results])
    else:
        for result in results if verbose else [one for one in results if not one.exact]:
            outputs.say(result.line())
        for line in results_module.table(results):
            outputs.say(line)
        outputs.say(results_module.summary(results))
    if failed:
        raise click.exceptions.Exit(1)


def _checks(decoder: str | None, encoder: str | None, timeout: float) -> list[Callable[[Vector], Result]]:
    """Return what is done with each vector."""
    from fba_conformance.suite import programs
    from fba_conformance.suite.runner import check

    made: list[Callable[[Vector], Result]] = []
    if decoder is not None:
        tested = _program("--decoder", decoder, programs.DECODER_PLACES, timeout)
        made.append(lambda vector: programs.check_decoder(tested, vector))
    if encoder is not None:
        tested_encoder = _program("--encoder", encoder, programs.ENCODER_PLACES, timeout)
        made.append(lambda vector: programs.check_encoder(tested_encoder, vector))
    return made or [check]


def _program(option: str, text: str, places: Sequence[str], timeout: float) -> Program:
    """Return the program of an option; a usage error if its command line is wrong."""
    from fba_conformance.suite.programs import parse_program, unknown_places

    try:
        program = parse_program(text, seconds=timeout)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint=option) from error
    unknown = unknown_places(program, places)
    if unknown:
        known = ", ".join(f"{{{name}}}" for name in places)
        raise click.BadParameter(
            f"nothing is put in place of {unknown[0]}; there are {known}", param_hint=option
        )
    if shutil.which(program.words[0]) is None:
        raise click.BadParameter(
            f"there is no program {program.words[0]!r} here; give its path, or a name on PATH",
            param_hint=option,
        )
    return program


def _chosen(vectors: Sequence[Vector], names: Sequence[str]) -> Sequence[Vector]:
    """Return the vectors of these names or groups, all without names; a usage error for unknown names."""
    if not names:
        return vectors
    chosen = [one for one in vectors if {one.name, Path(one.name).stem, one.group} & set(names)]
    known = {name for one in chosen for name in (one.name, Path(one.name).stem, one.group)}
    for name in names:
        if name not in known:
            raise click.BadParameter(f"there is no vector or group {name!r}", param_hint="--only")
    return chosen


def _write_archive(path: Path, folder: Path | None, *, no_clobber: bool) -> None:
    """Write the suite as a zip."""
    from fba_conformance.suite.archive import write_archive
    from fba_conformance.suite.generate import made_vectors

    if folder is not None:
        raise click.UsageError("--zip writes the vectors that come with fba; leave the folder out")
    outputs = Outputs([Output("--zip", path)], no_clobber=no_clobber)
    with outputs.file(path) as name, atomic(name) as file:
        count = write_archive(file, made_vectors())
    outputs.say(f"{display_name(path)}: {count} vectors")
