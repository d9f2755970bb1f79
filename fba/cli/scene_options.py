"""Options that `fba play` and `fba render` share: which files are shown, how, and with which sound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any

import click

from fba.cli import inputs, options
from fba.cli.command import Decorated
from fba.cli.inputs import EXISTING, ExistingPath, Reading
from fba.cli.joint_options import Pair, body_map_option

MOST = 8
"""Files shown at once."""


@dataclass(frozen=True, kw_only=True)
class SceneOptions(Reading):
    """How files are read and shown: the options' values."""

    model: Path | None
    body: Path | None
    maps: tuple[Path | Pair, ...]
    arrange: str | None
    fps: Fraction | None
    camera: str | None
    view: str
    shows: tuple[tuple[str, object], ...]
    axes: str


@dataclass(frozen=True)
class SoundOptions:
    """Which sound is played, and when."""

    audio: Path | None
    no_audio: bool
    audio_offset: float


class ShowType(click.ParamType[tuple[str, Any]]):
    """A switch of the player: wireframe, influence=open_jaw, shadows=off."""

    name = "switch"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> tuple[str, Any]:
        from fba_player.view.switches import parse_switch

        try:
            return parse_switch(str(value))
        except ValueError as error:
            self.fail(str(error), param, ctx)


files_argument = click.argument("files", type=EXISTING, nargs=-1, metavar="[FILE...]")


def scene_options(*, fps: str, arrange: str) -> Callable[[Decorated], Decorated]:
    """Return a decorator that gives a command `how`, a `SceneOptions`. fps, arrange: the help of these."""
    return _gathered(
        "how",
        SceneOptions,
        click.option(
            "--model",
            type=ExistingPath(),
            metavar="FILE",
            help="The face: a .glb of this project, or another that can be imported. "
            "Default: the built-in head.",
        ),
        click.option(
            "--body",
            type=ExistingPath(dir_okay=False),
            metavar="FILE",
            help="The body: one of this project, or any skinned person (.glb, .vrm) with its own head. "
            "Default: the built-in person.",
        ),
        body_map_option,
        click.option("--arrange", type=click.Choice(["side", "over"]), help=arrange),
        options.fps_option(fps),
        options.from_option,
        options.clip_option,
        click.option(
            "--camera",
            type=click.Choice(["front", "three-quarter", "profile", "body"]),
            help="Default: one that suits the content.",
        ),
        options.choice_option(
            "--view",
            "A person, or the face as its feature points and the body as its bones.",
            "figure",
            "points",
        ),
        click.option(
            "--show",
            "shows",
            type=ShowType(),
            multiple=True,
            metavar="SWITCH[=VALUE]",
            help="What else is shown; repeatable: wireframe, points, influence=FAP, skeleton[=only], grid, "
            "normals; shadows, wrinkles, eyes, teeth, hair=off; background=grey or transparent.",
        ),
        options.choice_option(
            "--axes", "Which way BAPs turn: as the standard says, or as in some old files.", "iso", "vreng"
        ),
        options.bap_steps_option,
        options.salvage_option,
        options.limit_option,
    )


def sound_options(kind: str = "Sound") -> Callable[[Decorated], Decorated]:
    """Return a decorator that gives a command `sound`, a `SoundOptions`. kind: what the help calls it."""
    return _gathered(
        "sound",
        SoundOptions,
        click.option(
            "--audio",
            type=ExistingPath(dir_okay=False),
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
    """Raise click.UsageError for options that contradict each other or the files.

    what: shows the files, for messages.
    """
    if sound.audio is not None and sound.no_audio:
        raise click.UsageError("--audio and --no-audio contradict each other")
    if sound.audio_offset and sound.no_audio:
        raise click.UsageError("--audio-offset and --no-audio contradict each other")
    inputs.check_clip(how, files)
    if len(files) > MOST:
        raise click.UsageError(f"{len(files)} files are too many for one {what}; at most {MOST}")
    if len(files) < 2 and how.arrange is not None:
        one = f"; {files[0]} is one" if files else ""
        raise click.UsageError(f"--arrange needs two files or more{one}")


def _gathered(
    name: str, kind: type, *given: Callable[[Decorated], Decorated]
) -> Callable[[Decorated], Decorated]:
    """Return a decorator that adds options whose values reach the command as one object of a kind."""

    def decorate(command: Decorated) -> Decorated:
        for option in (options.gather(**{name: kind}), *reversed(given)):
            command = option(command)
        return command

    return decorate
