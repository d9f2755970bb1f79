"""`fba play`: a window with files, or with a stream while it arrives."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from fba.cli import options, scenes
from fba.cli.command import Command, examples
from fba.cli.inputs import ReadFile, read_file
from fba.cli.live_streams import SOURCE, Receiving, is_from_network
from fba.cli.option_fields import group, option, with_options
from fba.cli.scenes import MOST_FILES, SceneOptions, SoundOptions, check_files
from fba.parameters import BAP_STEPS_DEFAULT

if TYPE_CHECKING:
    from fba.animation import Animation
    from fba_player.playback.live import LiveAnimation
    from fba_player.view.protocols import Showable
    from fba_player.window.surface import Surface


@dataclass(frozen=True, kw_only=True)
class _Window:
    """Options of the window, which dropped files keep."""

    speed: float = option(type=options.FloatRange(0.1, 4.0), default=1.0, help="1: as recorded.")
    loop: bool = option(default=False, help="Start again at the end.")
    interpolate: bool = option(default=True, help="Smooth motion between frames, or frame by frame.")
    size: tuple[int, int] = options.size_option(default=(1280, 720), typed="1280x720", show_default=True)
    life: bool = option(
        default=False,
        help="Blink, look about and breathe where the file does not move the figure; only in the window, not "
        "in films and pictures.",
    )


@click.command(
    cls=Command,
    epilog=examples(
        "fba play talk.fba",
        "fba play talk.fba --audio voice.mp3",
        "fba play walk.fba",
        "fba play walk.bvh --loop --speed 0.5",
        "fba play original.fap decoded.fba --compare",
        "fba play rtp://0.0.0.0:5004",
        "nc host 7000 | fba play -",
        "fba play",
        "fba play --model face.glb",
    ),
)
@click.argument("files", type=SOURCE, nargs=-1, metavar="[FILE...]")
@with_options
def command(
    files: tuple[Path, ...],
    sound: SoundOptions,
    window: _Window,
    receiving: Receiving,
    compare: bool = option(
        default=False,
        help="Two files or more: the others as drawings over the first, and by how much each parameter "
        "differs.",
    ),
    start: float | None = option(
        type=options.MOMENT, metavar="SECONDS", help="Start time, in the file's own times."
    ),
    paused: bool = option(default=False, help="Start paused; the space key plays."),
    how: SceneOptions = group(
        arrange=option(
            help="Several files: side by side (default), over each other (default with --compare), side by "
            "side in colours of their distance from the first (colour), or two with a line between (wipe)."
        )
    ),
) -> None:
    """Play files in a window: space plays and pauses, arrows step, F1 shows all keys.

    - is standard input: an FBA stream is shown while it arrives, as it is from a FIFO, and as one that is
    sent to an address of this computer, rtp://HOST:PORT, or to that of a description, FILE.sdp. Several
    files are shown together. Without a file, a neutral figure opens with sliders to move it by hand:
    the built-in person, or that of --model or --body. Without a display, use `fba render`.
    """
    if len(files) < 2 and compare:
        single = f"; {files[0]} is one" if files else ""
        raise click.UsageError(f"--compare needs two files or more{single}")
    check_files(files, how, sound, "window")
    receiving.check(files)
    if [str(file) for file in files].count("-") > 1:
        raise click.UsageError("standard input (-) can be shown once")
    if not files and sound.audio is not None:
        raise click.UsageError("--audio goes with a file to play")
    from fba import player

    player.check_display()  # before work that takes long
    with player.Surface(window.size) as surface:
        surface.read = partial(read_file, reading=how)
        shown = _Shown(surface, window, receiving)
        if not files:
            dropped = _puppet(how, shown)
        else:
            dropped = _play(files, how, sound, shown, compare=compare, start=start, paused=paused)
        while dropped:
            again = surface.resumed is not None
            beside = sound if again else SoundOptions(no_audio=sound.no_audio)
            dropped = _play(dropped[:MOST_FILES], how if again else replace(how, arrange=None), beside, shown)


@dataclass(frozen=True)
class _Shown:
    """The window that scenes are shown in, one after the other, and how."""

    surface: Surface
    window: _Window
    receiving: Receiving


def _play(
    files: tuple[Path, ...],
    how: SceneOptions,
    sound: SoundOptions,
    shown: _Shown,
    *,
    compare: bool = False,
    start: float | None = None,
    paused: bool = False,
) -> tuple[Path, ...]:
    """Play files in a window; return the files that were dropped onto it."""
    from fba import player

    window, receiving = shown.window, shown.receiving
    audio = scenes.find_sound(files, sound, "played without sound")
    streams: list[LiveAnimation] = []
    whole: list[ReadFile] = []
    receivers = ExitStack()
    try:
        animations: list[Animation | LiveAnimation] = []
        for file in files:
            opened = scenes.open_file(file, how, receiving, receivers)
            if isinstance(opened, ReadFile):
                animations.append(opened.animation)
                whole.append(opened)
            else:
                animations.append(opened)
                streams.append(opened)
        names = [
            animation.name if name == "-" or is_from_network(file) else name
            for file, name, animation in zip(files, scenes.display_names(files), animations, strict=True)
        ]

        title = " | ".join(names)
        shown.surface.open(title)  # before imports that take long

        def build() -> Showable:
            scene: Showable = scenes.build_scene(animations, names, how, over=compare)
            _check_start(scene, start, growing=bool(streams))
            return scene

        tables = [read.table for read in whole if read.table is not None]
        doubts = [read.doubt for read in whole if read.doubt is not None]
        single = len(files) == 1 and not streams and str(files[0]) != "-" and not scenes.is_pipe(files[0])
        return player.play(
            build,
            title=title,
            camera=how.camera,
            start=start,
            audio=audio,
            audio_offset=scenes.find_offset(audio, files, sound),
            file=files[0] if single else None,
            bap_steps=tables[0] if tables else BAP_STEPS_DEFAULT,
            warnings=tuple(doubts),
            panels=("differences",) if compare else (),
            paused=paused,
            size=window.size,
            loop=window.loop,
            speed=window.speed,
            interpolate=window.interpolate,
            life=window.life,
            surface=shown.surface,
        )
    finally:
        for stream in streams:
            for text in filter(None, (stream.details, stream.doubt)):
                click.echo(f"fba: warning: {stream.name}: {text}", err=True)
            stream.close()
        receivers.close()


def _puppet(how: SceneOptions, shown: _Shown) -> tuple[Path, ...]:
    """Open a window with a neutral figure and sliders that move it; return the files dropped onto it."""
    from fba import player

    given = [file.name for file in (how.model, how.body) if file is not None]
    title = " ".join(filter(None, [how.figure, *given])) or "puppet"
    shown.surface.open(title)  # before imports that take long
    from fba_player.session.performer import neutral

    person = how.body is not None or how.model is None
    return player.play(
        lambda: scenes.build_scene([neutral(body=person)], [title], how),
        title=title,
        size=shown.window.size,
        camera=how.camera,
        loop=True,
        paused=True,
        panels=("puppet",),
        surface=shown.surface,
    )


def _check_start(scene: Showable, start: float | None, *, growing: bool) -> None:
    if start is None or growing:
        return
    first, last = float(scene.timeline.start), float(scene.timeline.end)
    if not first <= start < last:
        raise click.UsageError(f"--start {start:g}: the performance goes from {first:g} s to {last:g} s")
