"""Pictures and films of animations that emotion commands make, and their errors."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fba.cli.command import usage_errors
from fba.cli.inputs import read_model
from fba.cli.outputs import STANDARD, Outputs
from fba.cli.printing import Progress
from fba.errors import OptionError

if TYPE_CHECKING:
    from fba.animation import Animation

OUTPUT_TEXT = (
    "File to write: .fba, .fap or another format of animations, .png, .jpg, .mp4, .gif. - for standard "
    "output."
)
"""Help of --output."""
PICTURES, FILMS = ("png", "jpg", "jpeg"), ("mp4", "gif")


def picture_kind(output: Path, to: str | None) -> str:
    """Return which kind of picture or film is asked for, "" for a format of animations."""
    kind = to.lower() if to is not None else output.suffix.lower().removeprefix(".")
    if output == STANDARD and to is None:
        return ""
    return kind if kind in PICTURES + FILMS else ""


@contextmanager
def option_errors() -> Iterator[None]:
    """What the library says about values that were typed is bad usage."""
    try:
        yield
    except OptionError as error:
        raise click.UsageError(str(error)) from error


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
    suffix = f".{kind}"
    with outputs.file(output, suffix) as file, Progress("rendering", None) as step, usage_errors():
        render(scene, file, size=size, progress=step.show)
