"""Results of `fba emote`, `fba emotion` and `fba express`: pictures, films, tables and records."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli.command import usage_errors
from fba.cli.inputs import read_model
from fba.cli.outputs import STANDARD, Outputs
from fba.cli.printing import Progress, print_json
from fba.parameters import FAP_COUNT, faps

if TYPE_CHECKING:
    from fba.animation import Animation
    from fba.emotion import Blend, Reading, Readings

OUTPUT_TEXT = (
    "File to write: .fba, .fap or another format of animations, .png, .jpg, .mp4, .gif. - for standard "
    "output."
)
"""Help of --output."""
PICTURES = ("png", "jpg", "jpeg")
FILMS = ("mp4", "gif")


def picture_kind(output: Path, to: str | None) -> str:
    """Return the kind of the picture or film, "" for a format of animations."""
    kind = to.lower() if to is not None else output.suffix.lower().removeprefix(".")
    if output == STANDARD and to is None:
        return ""
    return kind if kind in PICTURES + FILMS else ""


def draw(
    animation: Animation,
    output: Path,
    outputs: Outputs,
    kind: str,
    model: Path | None,
    size: tuple[int, int] | None,
) -> None:
    """Draw a picture or a film of an animation into one of the outputs."""
    from fba_player.export.render import render
    from fba_player.scene.scene import Scene

    scene = Scene(animation, read_model(model))
    with outputs.file(output, f".{kind}") as file, Progress("rendering", None) as step, usage_errors():
        render(scene, file, size=size, progress=step.show)


def print_expressions(as_json: bool) -> None:
    """Print the named expressions: family, activation, evaluation, other names, what is seen."""
    from fba import emotion

    named = emotion.expressions()
    if as_json:
        print_json(
            [
                {
                    "name": one.name,
                    "family": one.family or None,
                    "activation": one.activation,
                    "evaluation": one.evaluation,
                    "fap2": one.select or None,
                    "aliases": list(one.aliases),
                    "recipe": dict(one.recipe) or None,
                    "about": one.about,
                }
                for one in named
            ]
        )
        return
    width = max(len(one.name) for one in named)
    click.echo(f"{'name':{width}}  family    act.  eval.  what is seen")
    for one in named:
        point = "           " if one.point is None else f"{one.point[0]:4.1f}  {one.point[1]:5.1f}"
        click.echo(f"{one.name:{width}}  {one.family or '-':8}  {point}  {one.about}")


def print_blend(blend: Blend, as_json: bool) -> None:
    """Print a mixture: its parts, its point, and the FAPs that it moves."""
    if as_json:
        print_json(blend_record(blend))
        return
    click.echo(f"{blend}: activation {blend.activation:.1f}, evaluation {blend.evaluation:.1f}")
    for one, value in zip(faps(), blend.faps.tolist(), strict=True):
        if round(value):
            click.echo(f"{one.number:4} {one.name:22} {round(value):7}  {one.unit}")


def blend_record(blend: Blend) -> dict[str, Any]:
    """Return a mixture for programs: names, intensities, point, FAPs by name."""
    named = zip(faps(), blend.faps.tolist(), strict=True)
    return {
        "expressions": {one.name: round(intensity, 3) for one, intensity in blend.parts},
        "activation": round(blend.activation, 3),
        "evaluation": round(blend.evaluation, 3),
        "faps": {one.name: round(value) for one, value in named if round(value)},
    }


def reading_record(time: float, reading: Reading) -> dict[str, Any]:
    """Return the reading of a frame for programs."""
    point = {"activation": reading.activation, "evaluation": reading.evaluation}
    return {
        "time": round(time, 4),
        "label": reading.label,
        "probability": round(reading.probability, 4),
        "intensity": round(reading.intensity, 1),
        **{name: None if value is None else round(value, 3) for name, value in point.items()},
        "nearest": [
            {
                "name": near.name,
                "intensity": round(near.intensity, 1),
                "probability": round(near.probability, 4),
            }
            for near in reading.nearest
        ],
    }


def summary_text(readings: Readings) -> str:
    """Return "joy 62 % (mean 54), neutral 38 %": shares of frames, with mean intensities."""
    parts = []
    for row in readings.summary()["shares"]:
        mean = f" (mean {row['intensity']:.0f})" if row["intensity"] else ""
        parts.append(f"{row['label']} {100 * row['share']:.0f} %{mean}")
    return ", ".join(parts)


def reading_lines(readings: Readings, *, every: bool) -> Iterator[str]:
    """Yield the lines of a table of every frame, or of the frames at which the label changes."""
    yield f"{'time':>8}  {'shown':11}  {'int.':>4}  {'act.':>4}  {'eval.':>5}  nearest expressions"
    before = ""
    for time, one in zip(readings.times.tolist(), readings.readings, strict=True):
        if every or one.label != before:
            point = ["-" if value is None else f"{value:.1f}" for value in (one.activation, one.evaluation)]
            intensity = f"{one.intensity:.0f}" if one.intensity else "-"
            nearest = ", ".join(f"{near.name} {near.intensity:.0f}" for near in one.nearest)
            line = f"{time:7.2f}s  {one.label:11}  {intensity:>4}  {point[0]:>4}  {point[1]:>5}  {nearest}"
            yield line.rstrip()
        before = one.label
    if readings.baseline != "none":
        yield f"the face at rest is subtracted (--baseline {readings.baseline})"
    if readings.unsent:
        count = len(readings.unsent)
        yield f"FAPs that are never sent, or always 0, and say nothing: {count} of {FAP_COUNT - 2}"
