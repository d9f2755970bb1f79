"""Options that `fba play` and `fba render` share: which files are shown, how, and with which sound."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import click

from fba.cli import inputs, options
from fba.cli.inputs import Reading
from fba.cli.joint_options import Maps, MapType
from fba.cli.option_fields import option

MOST = 8
"""Files shown at once."""


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


files_argument = click.argument("files", type=options.EXISTING, nargs=-1, metavar="[FILE...]")


@dataclass(frozen=True, kw_only=True)
class SceneOptions(Reading):
    """How files are read and shown."""

    model: Path | None = options.model_option(
        "The face: a .glb of this project, or another that can be imported. Default: the built-in head."
    )
    body: Path | None = option(
        type=options.FILE,
        metavar="FILE",
        help="The body: one of this project, or any skinned person (.glb, .vrm) with its own head. Default: "
        "the built-in person.",
    )
    maps: Maps = option(
        "--map",
        default=(),
        type=MapType(),
        multiple=True,
        metavar="JOINT=JOINT|FILE",
        help="With --body: which joint of the standard a joint of its skeleton is, Pelvis=HumanoidRoot; "
        "none: Hat=. Repeatable. Or a TOML file of such pairs.",
    )
    arrange: Literal["side", "over"] | None = option(
        help="Several files: side by side (default), or the others as drawings over the first."
    )
    camera: Literal["front", "three-quarter", "profile", "body"] | None = option(
        help="Default: one that suits the content."
    )
    view: Literal["figure", "points"] = option(
        default="figure", help="A person, or the face as its feature points and the body as its bones."
    )
    shows: tuple[tuple[str, object], ...] = option(
        "--show",
        default=(),
        type=ShowType(),
        multiple=True,
        metavar="SWITCH[=VALUE]",
        help="What else is shown; repeatable: wireframe, points, influence=FAP, skeleton[=only], grid, "
        "normals; shadows, wrinkles, eyes, teeth, hair=off; background=grey or transparent.",
    )
    axes: Literal["iso", "vreng"] = option(
        default="iso", help="Which way BAPs turn: as the standard says, or as in some old files."
    )


@dataclass(frozen=True, kw_only=True)
class SoundOptions:
    """Which sound is played, and when."""

    audio: Path | None = option(
        type=options.FILE,
        metavar="FILE",
        help="Sound, from the first frame. Default: the WAV file of the same name beside the input.",
    )
    no_audio: bool = option(default=False, help="No sound.")
    audio_offset: float = option(
        default=0.0,
        type=options.MomentType(),
        metavar="SECONDS",
        help="Delay of the sound; negative: it begins earlier.",
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
