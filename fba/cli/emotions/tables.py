"""Tables and records of expressions, which `fba express` and `fba emotion` print."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from fba.cli.printing import print_json

if TYPE_CHECKING:
    from fba.emotion import Blend


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
    """Print the parts of a mixture, its point, and the FAPs that it moves."""
    from fba.parameters import faps

    if as_json:
        print_json(blend_record(blend))
        return
    click.echo(f"{blend}: activation {blend.activation:.1f}, evaluation {blend.evaluation:.1f}")
    for one, value in zip(faps(), blend.faps.tolist(), strict=True):
        if round(value):
            click.echo(f"{one.number:4} {one.name:22} {round(value):7}  {one.unit}")


def blend_record(blend: Blend) -> dict[str, Any]:
    """Return a mixture for programs: names, intensities, point, FAPs by name."""
    from fba.parameters import faps

    named = zip(faps(), blend.faps.tolist(), strict=True)
    return {
        "expressions": {one.name: round(intensity, 3) for one, intensity in blend.parts},
        "activation": round(blend.activation, 3),
        "evaluation": round(blend.evaluation, 3),
        "faps": {one.name: round(value) for one, value in named if round(value)},
    }
