"""Options of the writers of other formats than FBA."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli.command import Decorated
from fba.cli.inputs import ExistingPath, read_body, read_model

if TYPE_CHECKING:
    from fba.body import BodyModel
    from fba.formats import Format

UNITS = {"cm": 100.0, "m": 1.0, "mm": 1000.0, "in": 1 / 0.0254}
"""Lengths in the file for one metre."""
FLAGS = {
    "joints": "--joints",
    "unit": "--unit",
    "mesh": "--mesh/--no-mesh",
    "model": "--model",
    "body": "--body",
    "axes": "--axes",
}
"""The options for the writers' keywords."""
FILE = ExistingPath(dir_okay=False)


def writer_options(command: Decorated) -> Decorated:
    """Add the options; the command takes them as keywords and passes them to `settings`."""
    for option in reversed(
        (
            click.option(
                "--joints",
                type=click.Choice(["all", "moving"]),
                help="BVH: all joints of the standard (default), or only what moves, and the limbs.",
            ),
            click.option("--unit", type=click.Choice(list(UNITS)), help="BVH: unit of lengths; default: cm."),
            click.option(
                "--mesh/--no-mesh",
                default=None,
                help="glTF: the person (default), or the skeleton alone.",
            ),
            click.option(
                "--model",
                type=ExistingPath(),
                metavar="FILE",
                help="glTF: the face; default: the built-in head.",
            ),
            click.option(
                "--body",
                type=FILE,
                metavar="FILE.glb",
                help="glTF: the body; default: the built-in person.",
            ),
            click.option(
                "--axes",
                type=click.Choice(["iso", "vreng"]),
                help="BVH, glTF: which way BAPs turn: as the standard says (default), or as in old files.",
            ),
        )
    ):
        command = option(command)
    return command


def settings(
    target: Path, writing: Format, given: Mapping[str, Any], joints: Mapping[str, str] | None = None
) -> dict[str, Any]:
    """Return keywords for the writer of a format.

    given: values of the options, None if not given. joints: of the body, as for `read_body`.

    Raises click.UsageError for an option that the format does not have, ModelError or FormatError for a
    model that cannot be read.
    """
    given = {name: value for name, value in given.items() if value is not None}
    for name in given:
        if name not in writing.write_options:
            raise click.UsageError(_misplaced_text(name, target, writing))

    def read_person(path: Path) -> BodyModel | None:
        return read_body(path, joints)

    converters: dict[str, Callable[[Any], Any]] = {**_CONVERTERS, "body": read_person}
    return {name: converters[name](value) if name in converters else value for name, value in given.items()}


def _misplaced_text(name: str, target: Path, writing: Format) -> str:
    from fba.formats import formats

    takers = [entry.name.upper() for entry in formats() if name in entry.write_options]
    own = [flag for option, flag in FLAGS.items() if option in writing.write_options]
    return (
        f"{FLAGS[name]} is an option for {' and '.join(takers)}, and {target} becomes "
        f"{writing.name.upper()}, which takes {', '.join(own) or 'none of these options'}"
    )


_CONVERTERS: dict[str, Callable[[Any], Any]] = {
    "unit": UNITS.__getitem__,
    "model": read_model,
}
