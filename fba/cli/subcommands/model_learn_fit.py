"""`fba model learn-fit`: an interpolation table (FIT) from the streams of a performer."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli import options
from fba.cli.coding.tolerance_options import LENGTH
from fba.cli.command import Command, examples
from fba.cli.inputs import Reading, read_input, read_model
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import Output, Outputs, check_glb, display_name, further_output_option, output_option
from fba.cli.printing import Progress
from fba.errors import FbaError

if TYPE_CHECKING:
    from fba.animation import Animation
    from fba.face.learning import LearntFit


@dataclass(frozen=True, kw_only=True)
class _Target:
    """Where the model goes, and its table by itself."""

    output: Path = output_option("OUT.glb", "The model with the table; - for standard output.", required=True)
    no_clobber: bool = options.no_clobber_option
    fit: Path | None = further_output_option(
        "FIT.json", "Write the table by itself, too: the fields of the standard's node FIT."
    )


@dataclass(frozen=True, kw_only=True)
class _Goal:
    """How many FAPs to send: a count, or as many as keep within a tolerance in metres."""

    count: int | None = option(
        "--faps",
        type=click.IntRange(1, 66),
        metavar="N",
        help="FAPs to send, those of the head's rotation among them. Default: 10.",
    )
    tolerance: float | None = option(
        type=LENGTH,
        metavar="1mm",
        help="Send as many FAPs as it takes to keep every vertex this near in 99 % of the frames held out.",
    )


@click.command(
    "learn-fit",
    cls=Command,
    short_help="Learn to compute most FAPs of a performer from a few.",
    epilog=examples(
        "fba model learn-fit monday.fba tuesday.fba -o ada.glb",
        "fba model learn-fit talk.fba --model head.glb --faps 8 -o ada.glb --fit ada.json",
        "fba model learn-fit talk.fba --tolerance 1mm -o ada.glb",
    ),
)
@click.argument("streams", metavar="STREAM...", nargs=-1, required=True, type=options.EXISTING)
@with_options
def command(
    streams: tuple[Path, ...],
    target: _Target,
    goal: _Goal,
    model: Path | None = options.model_option(
        "Model that gets the table, in place of one that it has. Default: the built-in head."
    ),
    reading: Reading = group("format", "salvage", "limit"),
    as_json: bool = options.json_option,
) -> None:
    """Learn an interpolation table (FIT) from streams of a performer, and store it with a face model.

    A stream then needs to send only a few FAPs; `fba play --model OUT.glb` computes the others. The printed
    errors are those on each stream while the table is learned from the others (of one stream, on fifths of
    it). Streams may be of any format with FAPs, captured faces too.
    """
    if goal.count is not None and goal.tolerance is not None:
        raise click.UsageError(
            "--faps and --tolerance contradict each other: each says how many FAPs to send"
        )
    output, fit = target.output, target.fit
    written = [Output("--output", output), *([Output("--fit", fit)] if fit is not None else [])]
    outputs = Outputs(written, [*streams, model], no_clobber=target.no_clobber)
    check_glb(output)
    from fba.face import FaceModel
    from fba.face.learning import learn_fit
    from fba.face.learning.learn import FAPS

    head = read_model(model) or FaceModel.default()
    animations = []
    with Progress("reading", len(streams)) as step:
        for path in streams:
            animations.append(read_input(path, reading))
            step.advance()
    tracks = [_face(animation, path) for animation, path in zip(animations, streams, strict=True)]
    with Progress("learning", None):
        millimetres = goal.tolerance and 1000 * goal.tolerance
        learnt = learn_fit(tracks, head, count=goal.count or FAPS, tolerance=millimetres)
    with outputs.file(output) as file:
        replace(head, fit=learnt.table).save(file)
    if fit is not None:
        outputs.write(fit, (json.dumps(learnt.table.to_node(), indent=1) + "\n").encode())
    if as_json:
        outputs.print_json({"output": str(output), **_values(learnt)})
        return
    outputs.say(
        f"{display_name(output)}: {head.name or 'a face'} with a FIT learned from {learnt.frames} frames"
        f"{', in place of its own' if head.fit is not None else ''}"
    )
    for line in _lines(learnt):
        outputs.say(f"  {line}")


def _face(animation: Animation, path: Path) -> Any:
    if animation.face is None:
        raise FbaError(f"{path}: there is no face in it; a FIT is learned from streams with FAPs")
    return animation.face


def _lines(learnt: LearntFit) -> list[str]:
    from fba.parameters import faps

    names = [fap.name for fap in faps()]
    error = learnt.held_out
    source = "the stream held out" if learnt.streams > 1 else "the fifth of the stream held out"
    lines = [
        f"{len(learnt.sent)} FAPs to send: {', '.join(f'{n} {names[n - 1]}' for n in learnt.sent)}",
        f"{len(learnt.computed)} FAPs computed; errors on {source}:",
        f"worst vertex of each frame {error.millimetres.text()}",
        f"{100 * error.explained:.1f} % of the motion of these FAPs explained",
    ]
    for computed in error.faps:
        spread = computed.steps
        lines.append(
            f"  {computed.fap:2} {names[computed.fap - 1]:22} {spread.mean:6.1f} {spread.percentile_99:7.1f} "
            f"{spread.largest:7.1f} steps, at most {computed.millimetres:.2f} mm"
        )
    return lines


def _values(learnt: LearntFit) -> dict[str, Any]:
    """Return what was learned for programs; lengths in mm."""
    return {
        "sent": list(learnt.sent),
        "computed": list(learnt.computed),
        "frames": learnt.frames,
        "streams": learnt.streams,
        "held_out": asdict(learnt.held_out),
    }
