"""The options that `fba play` and `fba render` share: which files are shown, how, and with what sound."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, fields
from fractions import Fraction
from pathlib import Path
from typing import Any

import click

from fba.cli import options

Command = Callable[..., Any]

MOST = 8
"""Files shown at once."""


@dataclass(frozen=True)
class SceneOptions:
    """How files are shown; the fields are named as the options are."""

    model: Path | None
    body: Path | None
    arrange: str | None
    fps: Fraction | None
    format: str | None
    camera: str | None
    view: str
    shows: tuple[tuple[str, object], ...]
    axes: str
    bap_steps: str
    salvage: bool


@dataclass(frozen=True)
class SoundOptions:
    """With what sound."""

    audio: Path | None
    no_audio: bool
    audio_offset: float


def files_argument(command: Command) -> Command:
    return click.argument("files", type=options.EXISTING, nargs=-1, metavar="[FILE...]")(command)


def scene_options(*, fps: str, arrange: str) -> Callable[[Command], Command]:
    """The command gets them as `how`, a `SceneOptions`. fps, arrange: what the help says of those."""
    arrangement = click.option("--arrange", type=click.Choice(["side", "over"]), help=arrange)
    return _gathered(
        "how",
        SceneOptions,
        options.model_option,
        options.body_option,
        arrangement,
        options.fps_option(fps),
        options.from_option,
        options.camera_option,
        options.view_option,
        options.show_option,
        options.axes_option,
        options.bap_steps_option,
        options.salvage_option,
    )


def sound_options(kind: str = "Sound") -> Callable[[Command], Command]:
    """The command gets them as `sound`, a `SoundOptions`. kind: what the help calls it."""

    return _gathered(
        "sound",
        SoundOptions,
        click.option(
            "--audio",
            type=click.Path(exists=True, dir_okay=False, path_type=Path),
            metavar="FILE",
            help=f"{kind}, from the first frame. Default: the WAV file of the same name beside the input.",
        ),
        click.option("--no-audio", is_flag=True, help="No sound."),
        click.option(
            "--audio-offset",
            type=options.MomentType(),
            default=0.0,
            metavar="SECONDS",
            help="Delay of the sound; negative: it begins earlier.",
        ),
    )


def check_files(files: tuple[Path, ...], how: SceneOptions, sound: SoundOptions, what: str) -> None:
    """Raises click.UsageError for options that contradict each other or the files. what: holds them."""
    if sound.audio is not None and sound.no_audio:
        raise click.UsageError("--audio and --no-audio contradict each other")
    if sound.audio_offset and sound.no_audio:
        raise click.UsageError("--audio-offset and --no-audio contradict each other")
    if len(files) > MOST:
        raise click.UsageError(f"{len(files)} files are too many for one {what}; at most {MOST}")
    if len(files) < 2 and how.arrange is not None:
        one = f"; {files[0]} is one" if files else ""
        raise click.UsageError(f"--arrange needs two files or more{one}")


def _gathered(name: str, kind: type, *given: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """Options whose values reach the command as one object."""

    def decorate(command: Command) -> Command:
        @functools.wraps(command)
        def gathering(**values: Any) -> Any:
            own = {field.name: values.pop(field.name) for field in fields(kind)}
            return command(**{name: kind(**own)}, **values)

        wrapped: Command = gathering
        for option in reversed(given):
            wrapped = option(wrapped)
        return wrapped

    return decorate
