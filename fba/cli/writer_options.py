"""Options of the writers of other formats than FBA."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from fba.cli import options
from fba.cli.inputs import read_body, read_model
from fba.cli.option_fields import option

if TYPE_CHECKING:
    from fba.formats import Format

UNITS_PER_METRE = {"cm": 100.0, "m": 1.0, "mm": 1000.0, "in": 1 / 0.0254}


@dataclass(frozen=True, kw_only=True)
class WriterOptions:
    """Options of the writers of files, by the names of their keywords."""

    joints: Literal["all", "moving"] | None = option(
        help="BVH: all joints of the standard (default), or only what moves, and the limbs."
    )
    unit: str | None = option(
        type=click.Choice(list(UNITS_PER_METRE)), help="BVH: unit of lengths; default: cm."
    )
    mesh: bool | None = option(help="glTF: the person (default), or the skeleton alone.")
    model: Path | None = options.model_option("glTF: the face; default: the built-in head.")
    body: Path | None = option(
        type=options.FILE, metavar="FILE.glb", help="glTF: the body; default: the built-in person."
    )
    axes: Literal["iso", "vreng"] | None = option(
        help="BAP, BVH, glTF: which way the BAPs of the input turn: as the standard says (default), or as in "
        "old files."
    )

    @property
    def given(self) -> dict[str, Any]:
        """The options that were given, by name."""
        return {name: value for name, value in vars(self).items() if value is not None}


def settings(
    target: Path, writing: Format, asked: WriterOptions, joints: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Return keywords for the writer of a format. joints: of the body, as for `read_body`.

    Raises click.UsageError for an option that the format does not have, ModelError or FormatError for a
    model that cannot be read.
    """
    given = asked.given
    for name in given:
        if name not in writing.write_options:
            raise click.UsageError(_misplaced_text(name, target, writing))
    converters: dict[str, Callable[[Any], Any]] = {
        "unit": UNITS_PER_METRE.__getitem__,
        "model": read_model,
        "body": lambda path: read_body(path, joints),
    }
    return {name: converters[name](value) if name in converters else value for name, value in given.items()}


def flag(name: str) -> str:
    """Return the option for a keyword of the writers, as the user types it."""
    return "--mesh/--no-mesh" if name == "mesh" else f"--{name}"


def _misplaced_text(name: str, target: Path, writing: Format) -> str:
    from fba.formats import formats

    able = [entry.name.upper() for entry in formats() if name in entry.write_options]
    takers = " and ".join(filter(None, [", ".join(able[:-1]), *able[-1:]]))
    taken = [flag(each.name) for each in fields(WriterOptions) if each.name in writing.write_options]
    return (
        f"{flag(name)} is an option for {takers}, and {target} becomes "
        f"{writing.name.upper()}, which takes {', '.join(taken) or 'none of these options'}"
    )
