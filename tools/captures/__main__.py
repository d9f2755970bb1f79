"""Writes captures whose FAPs are known, or measures how many of these come back.

python -m tools.captures write FOLDER [--seconds 10] [--head HEAD]
python -m tools.captures measure [--seconds 10] [--head HEAD]... [--faps FILE]...
python -m tools.captures correlate RECORDING...
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import warnings
from collections.abc import Mapping
from pathlib import Path

import click

import fba
from fba.animation import Animation
from fba.arrays import Float64
from fba.errors import FbaError, FbaWarning
from fba.face import FaceModel
from tools.captures import measurement, report
from tools.captures.heads import load_head, other_head
from tools.captures.marked_actor import as_animation, as_face, record
from tools.captures.marker_files import MAKERS, write
from tools.captures.performances import perform_track, speech
from tools.captures.point_files import LAYOUTS
from tools.captures.shaped_face import FACE_FILES, encode_file
from tools.captures.tracked_actor import film

RATE, FILM_RATE = 100, 30
"""Frames a second of the markers, and of films."""


def main(arguments: list[str] | None = None) -> None:
    """Does what the command line says."""
    parser = argparse.ArgumentParser(prog="python -m tools.captures", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    writing = commands.add_parser("write", help="write captures in all formats, and their FAPs")
    writing.add_argument("folder", type=Path)
    writing.add_argument(
        "--head", type=Path, help="a face model, or MakeHuman's folder; default: another head"
    )
    measuring = commands.add_parser("measure", help="encode captures; print how far their FAPs are off")
    measuring.add_argument("--head", type=Path, action="append", default=[], help="another head, too")
    measuring.add_argument("--faps", type=Path, action="append", default=[], help="what else is performed")
    correlating = commands.add_parser(
        "correlate", help="shapes of recordings to FAPs and back; print their correlations"
    )
    correlating.add_argument("recordings", type=Path, nargs="+", help="tables or datagrams of Live Link Face")
    for each in (writing, measuring):
        each.add_argument("--seconds", type=float, default=10.0)
    options = parser.parse_args(arguments)
    warnings.simplefilter("ignore", FbaWarning)
    try:
        if options.command == "write":
            write_captures(options.folder, options.seconds, options.head)
        elif options.command == "correlate":
            click.echo(report.shapes_table(options.recordings))
        else:
            click.echo(measure_all(options.seconds, options.head, options.faps))
    except FbaError as error:
        sys.exit(str(error))


def write_captures(folder: Path, seconds: float, head: Path | None) -> None:
    """Write captures of all kinds to a folder, and the FAPs of each beside it, as `NAME.truth.fba`."""
    model = other_head() if head is None else load_head(head)
    folder.mkdir(parents=True, exist_ok=True)
    take = record(model, speech(round(seconds * RATE), RATE), RATE)
    truth = as_animation(take)
    for name in MAKERS:
        write(folder, name, take.motion)
        save_truth(folder, name, truth)
    for name in LAYOUTS:
        save_points(folder, name, model, seconds)
    for name in FACE_FILES:
        save_truth(folder, name, encode_file(folder, name, seconds)[1])
    click.echo(
        f"{folder}: {len(MAKERS) + len(LAYOUTS) + len(FACE_FILES)} captures of {seconds:g} s, and their FAPs"
    )


def save_truth(folder: Path, name: str, truth: Animation) -> None:
    """Write the FAPs of a capture beside it."""
    fba.write(folder / f"{name}.truth.fba", truth, clamp=True)


def save_points(folder: Path, name: str, head: FaceModel, seconds: float) -> None:
    """Write tracked points in one layout, and the FAPs of it beside it."""
    seen = film(head, 478, frames=round(seconds * FILM_RATE), rate=FILM_RATE, share=True)
    (folder / f"points_{name}").write_bytes(LAYOUTS[name](seen.motion))
    save_truth(folder, f"points_{name}", as_face(seen.faps, FILM_RATE))


def measure_all(seconds: float, heads: list[Path], performances: list[Path]) -> str:
    """Return tables of how far FAPs are off, in Markdown: markers by FAP, then files by format."""
    models = {"reshaped": other_head()} | {path.stem: load_head(path) for path in heads}
    performed: dict[str, Float64] = {"made up": speech(round(seconds * RATE), RATE)}
    for path in performances:
        performed[path.name] = perform_track(fba.read(path), RATE)
    parts = []
    for what, values in performed.items():
        errors: dict[str, Mapping[int, float | None]] = {
            f"{head}, {way}": each
            for head, model in models.items()
            for way, each in measurement.measure_markers(model, values, rate=RATE).items()
        }
        errors |= measurement.measure_points(other_head(), values, RATE)
        errors["ARKit"] = measurement.measure_shapes(values, RATE)
        errors["AU"] = dict.fromkeys(measurement.told_by_units())
        parts += [f"### FAPs: {what}", report.faps_table(errors)]
    with tempfile.TemporaryDirectory() as folder:
        parts += ["### Files", report.files_table(Path(folder), other_head(), seconds)]
    return "\n\n".join(parts)


if __name__ == "__main__":
    main()
