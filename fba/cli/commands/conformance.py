"""`fba conformance`: check this codec, or other programs, against test vectors."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fba.atomic import atomic
from fba.cli import options
from fba.cli.command import Command, examples
from fba.cli.option_fields import option, with_options
from fba.cli.outputs import Output, Outputs, display_name, further_output_option
from fba.cli.printing import Progress

if TYPE_CHECKING:
    from fba_conformance.suite.index import Vector
    from fba_conformance.suite.programs import Program
    from fba_conformance.suite.result import Result


@dataclass(frozen=True, kw_only=True)
class _Programs:
    """Command lines of the programs to test, None for this codec."""

    decoder: str | None = option(
        metavar="COMMAND",
        help="Test this decoder: it reads the stream {in} and writes values to {out}; {bap_steps}: iso, "
        "visage.",
    )
    encoder: str | None = option(
        metavar="COMMAND",
        help="Test this encoder: it reads values from {in} and writes a stream to {out}, with {rate}, "
        "{fap_quant}, {bap_quant} and {bap_steps}.",
    )
    timeout: float = option(
        type=options.FloatRange(min=0, min_open=True),
        default=20.0,
        metavar="SECONDS",
        help="How long a program may take for a vector.",
    )

    @property
    def name(self) -> str:
        """The tested program."""
        return self.decoder or self.encoder or "fba"

    def checks(self) -> list[Callable[[Vector], Result]]:
        """Return the checks of each vector."""
        from fba_conformance.suite import programs
        from fba_conformance.suite.runner import check

        made: list[Callable[[Vector], Result]] = []
        if self.decoder is not None:
            decoder = _program("--decoder", self.decoder, programs.DECODER_PLACES, self.timeout)
            made.append(lambda vector: programs.check_decoder(decoder, vector))
        if self.encoder is not None:
            encoder = _program("--encoder", self.encoder, programs.ENCODER_PLACES, self.timeout)
            made.append(lambda vector: programs.check_encoder(encoder, vector))
        return made or [check]


@dataclass(frozen=True, kw_only=True)
class _Report:
    """Forms of the results."""

    junit: Path | None = further_output_option("FILE", "Write JUnit XML, too.")
    verbose: bool = option(
        "--verbose", "-v", default=False, help="Print a line for every vector, not only for failures."
    )
    as_json: bool = options.json_option

    def write(self, results: list[Result], outputs: Outputs, name: str) -> None:
        """Print the results. name: of the tested program."""
        from fba_conformance.suite.result import junit, summary, table

        if self.junit is not None:
            outputs.write(self.junit, junit(results, name))
        if self.as_json:
            outputs.print_json([result.to_dict() for result in results])
            return
        for result in results if self.verbose else [result for result in results if not result.exact]:
            outputs.say(result.line())
        for line in table(results):
            outputs.say(line)
        outputs.say(summary(results))


@click.command(
    cls=Command,
    epilog=examples(
        "fba conformance                                   # this codec, the vectors that come with it",
        "fba conformance --decoder 'mydecoder {in} {out}'  # another decoder",
        "fba conformance --zip fba-conformance.zip         # the vectors, for use without Python",
        "fba conformance ../vectors                        # a folder with an index.json",
    ),
)
@click.argument("folder", required=False, type=options.ExistingPath(file_okay=False))
@with_options
def command(
    folder: Path | None,
    programs: _Programs,
    report: _Report,
    only: tuple[str, ...] = option(
        default=(), metavar="NAME", help="Only vectors or groups of this name; may be repeated."
    ),
    archive: Path | None = further_output_option(
        "FILE",
        "Write the vectors that come with fba as a zip, with all values as text, and test nothing.",
        "--zip",
    ),
    no_clobber: bool = options.no_clobber_option,
) -> None:
    """Check this codec, or the programs of --decoder and --encoder, against test vectors.

    Decoded values must be exact; what encodes to the same bytes again must do so. Exits with 1 if a
    vector fails.
    """
    if archive is not None:
        _write_archive(archive, folder, no_clobber=no_clobber)
        return
    written = [] if report.junit is None else [Output("--junit", report.junit, text=True)]
    outputs = Outputs(written, no_clobber=no_clobber)
    from fba_conformance.suite.index import read_vectors

    checks = programs.checks()
    vectors = _chosen(read_vectors(folder), only)
    results: list[Result] = []
    with Progress("checking", len(vectors) * len(checks)) as step:
        for check in checks:
            for vector in vectors:
                results.append(check(vector))
                step.advance()
    report.write(results, outputs, programs.name)
    if not all(result.passed for result in results):
        raise click.exceptions.Exit(1)


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
        text = f"nothing is put in place of {unknown[0]}; there are {known}"
        raise click.BadParameter(text, param_hint=option)
    if shutil.which(program.words[0]) is None:
        text = f"there is no program {program.words[0]!r} here; give its path, or a name on PATH"
        raise click.BadParameter(text, param_hint=option)
    return program


def _chosen(vectors: Sequence[Vector], names: Sequence[str]) -> Sequence[Vector]:
    """Return the vectors of these names or groups, all without names; a usage error for unknown names."""
    if not names:
        return vectors

    def names_of(vector: Vector) -> set[str]:
        return {vector.name, Path(vector.name).stem, vector.group}

    chosen = [vector for vector in vectors if names_of(vector) & set(names)]
    for name in names:
        if not any(name in names_of(vector) for vector in chosen):
            raise click.BadParameter(f"there is no vector or group {name!r}", param_hint="--only")
    return chosen


def _write_archive(path: Path, folder: Path | None, *, no_clobber: bool) -> None:
    """Write the suite as a zip."""
    from fba_conformance.suite.archive import write_archive
    from fba_conformance.suite.index import read_vectors

    if folder is not None:
        raise click.UsageError("--zip writes the vectors that come with fba; leave the folder out")
    outputs = Outputs([Output("--zip", path)], no_clobber=no_clobber)
    with outputs.file(path) as name, atomic(name) as file:
        count = write_archive(file, read_vectors())
    outputs.say(f"{display_name(path)}: {count} vectors")
