"""`fba emotion`: which expressions a face shows, frame by frame."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fba.choices import Baseline
from fba.cli import emotion_results as results
from fba.cli import options
from fba.cli.command import Command, examples
from fba.cli.inputs import Reading, read_input, read_model
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import Output, Outputs, display_name, output_option
from fba.cli.printing import print_json
from fba.errors import FormatError

if TYPE_CHECKING:
    from fba.emotion import Readings


@dataclass(frozen=True, kw_only=True)
class _Target:
    """Where readings go: a table; else they are printed."""

    frames: bool = option(default=False, help="Print a row a frame, not only the summary and the changes.")
    output: Path | None = output_option("OUT.csv", "Write a row a frame as CSV. - for standard output.")
    no_clobber: bool = options.no_clobber_option
    as_json: bool = options.json_option


@click.command(
    cls=Command,
    epilog=examples(
        "fba emotion talk.fba",
        "fba emotion talk.fba --frames",
        "fba emotion talk.fba -o talk.csv",
        "fba emotion face.csv --baseline median --json",
    ),
)
@click.argument("file", type=options.EXISTING)
@with_options
def command(
    file: Path,
    target: _Target,
    baseline: Baseline = option(
        default="none",
        help="The face at rest: none: as FAPs count from it; start: the first half second, for films that "
        "begin at rest; median: of each FAP, where a face is mostly at rest.",
    ),
    model: Path | None = options.model_option(
        "The face whose visemes and expressions a stream shows; default: the built-in head."
    ),
    reading: Reading = group("format", "source_rate", "salvage", "limit"),
) -> None:
    """Read the expressions of a face: families, named expressions, intensities, activation, evaluation.

    FILE: any file with a face, streams as well as captures. "neutral": nothing is shown, or too little to
    count. "unknown": something is shown that is like no expression. FAPs that a file never sends say nothing.
    """
    output = target.output
    if output is not None and (target.frames or target.as_json):
        raise click.UsageError("-o writes a table; --frames and --json print one: give one of them")
    outputs = None
    if output is not None:
        outputs = Outputs(
            [Output("--output", output, text=True)], [file, model], no_clobber=target.no_clobber
        )
    animation = read_input(file, reading)
    if animation.face is None:
        raise FormatError("has no face: it sends no FAPs, from which expressions are read", path=file)
    from fba.emotion import read_expressions

    readings = read_expressions(animation, read_model(model), baseline=baseline)
    if outputs is not None and output is not None:
        outputs.write(output, _csv(readings).encode())
        outputs.say(f"{display_name(output)}: {len(readings)} frames; {results.summary_text(readings)}")
    elif target.as_json:
        print_json(
            {
                **readings.summary(),
                "baseline": baseline,
                "unsent": readings.unsent,
                "frames": list(_rows(readings)),
            }
        )
    else:
        click.echo(f"{file}: {len(readings)} frames; {results.summary_text(readings)}")
        for line in results.reading_lines(readings, every=target.frames):
            click.echo(line)


def _rows(readings: Readings) -> list[dict[str, object]]:
    return [
        results.reading_record(time, one)
        for time, one in zip(readings.times.tolist(), readings.readings, strict=True)
    ]


def _csv(readings: Readings) -> str:
    """Return the table: time, label, its probability and intensity, activation, evaluation, nearest."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time", "label", "probability", "intensity", "activation", "evaluation", "nearest"])
    for time, one in zip(readings.times.tolist(), readings.readings, strict=True):
        nearest = " ".join(f"{near.name.replace(' ', '_')}={near.intensity:.0f}" for near in one.nearest)
        point = ["" if value is None else f"{value:.2f}" for value in (one.activation, one.evaluation)]
        writer.writerow(
            [f"{time:.4f}", one.label, f"{one.probability:.3f}", f"{one.intensity:.1f}", *point, nearest]
        )
    return text.getvalue()
