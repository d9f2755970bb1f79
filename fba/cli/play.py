"""`fba play`: a window that shows files, or a stream while it arrives."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli import options

if TYPE_CHECKING:
    from player.showable import Showable

MOST = 8
"""Files in one window."""


@click.command(
    epilog=options.examples(
        "fba play talk.fba",
        "fba play talk.fba --audio voice.mp3",
        "fba play walk.bvh --loop --speed 0.5",
        "fba play original.fap decoded.fba --compare",
        "nc host 7000 | fba play -",
        "fba play --model face.glb",
    )
)
@click.argument("files", type=options.EXISTING, nargs=-1, metavar="[FILE...]")
@click.option(
    "--compare",
    is_flag=True,
    help="Two files or more: the others as drawings over the first, and by how much each parameter differs.",
)
@click.option(
    "--arrange",
    type=click.Choice(["side", "over"]),
    help="Several files: side by side (default), or over each other (default with --compare).",
)
@options.model_option
@options.body_option
@click.option(
    "--audio",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Sound from the first frame on. Default: the WAV of the same name beside the file.",
)
@click.option("--no-audio", is_flag=True, help="No sound.")
@options.fps_option("Frame rate of a file without a header.")
@click.option(
    "--speed", type=click.FloatRange(0.1, 4.0), default=1.0, show_default=True, help="1: as recorded."
)
@click.option("--loop", is_flag=True, help="Start again at the end.")
@click.option("--start", type=float, metavar="SECONDS", help="From when, in the file's own times.")
@click.option("--paused", is_flag=True, help="Wait for the space key.")
@click.option(
    "--interpolate/--no-interpolate",
    default=True,
    show_default=True,
    help="Smooth motion between frames, or frame by frame.",
)
@click.option("--size", type=options.SizeType(), default="1280x720", show_default=True, metavar="WxH")
@options.camera_option
@options.view_option
@options.show_option
@options.deform_option
@options.axes_option
@options.bap_steps_option
@options.salvage_option
def command(
    files: tuple[Path, ...],
    compare: bool,
    arrange: str | None,
    model: Path | None,
    body: Path | None,
    audio: Path | None,
    no_audio: bool,
    fps: Fraction | None,
    speed: float,
    loop: bool,
    start: float | None,
    paused: bool,
    interpolate: bool,
    size: tuple[int, int],
    camera: str | None,
    view: str,
    shows: tuple[tuple[str, object], ...],
    axes: str,
    bap_steps: str,
    salvage: bool,
) -> None:
    """Play files in a window: space plays and pauses, arrows step, F1 shows all keys.

    - is standard input: an FBA stream is shown while it arrives, as it is from a FIFO. Several files are
    shown together. Without a file, --model or --body opens a neutral figure with sliders to move it by hand.
    Without a display, use `fba render`.
    """
    if not files:
        if model is None and body is None:
            raise click.UsageError("give a file to play, or a --model or --body to move by hand")
        _check(files, compare=compare, arrange=arrange, audio=audio, no_audio=no_audio)
        _puppet(model, body, axes=axes, view=view, shows=shows, size=size, camera=camera)
        return
    _check(files, compare=compare, arrange=arrange, audio=audio, no_audio=no_audio)
    import player
    from fba.cli import showing

    sound = audio
    if sound is not None:
        from player.sound import check

        check(sound)
    elif not no_audio:
        sound = showing.voice(files)
    face, figure = options.read_model(model), showing.read_body(body)
    streams = []
    try:
        scenes = []
        for file in files:
            animation, growing = showing.opened(file, bap_steps=bap_steps, fps=fps, salvage=salvage)
            if growing:
                streams.append(animation)
            scenes.append(showing.scene_of(animation, growing, model=face, body=figure, axes=axes, view=view))
        names = [
            scene.title if str(file) == "-" else file.name for scene, file in zip(scenes, files, strict=True)
        ]
        scene: Any = scenes[0]
        if len(scenes) > 1:
            from player.compare import CompareScene

            scene = CompareScene(scenes, arrangement=arrange or ("over" if compare else "side"), names=names)
        for switch, state in shows:
            scene.show(switch, state)
        _check_start(scene, start, growing=bool(streams))
        one = len(files) == 1 and not streams and str(files[0]) != "-" and not showing.is_pipe(files[0])
        player.play(
            scene,
            title=" | ".join(names),
            size=size,
            camera=camera,
            loop=loop,
            speed=speed,
            start=start,
            paused=paused,
            interpolate=interpolate,
            audio=sound,
            file=files[0] if one else None,
            bap_steps=bap_steps,
            panels=("differences",) if compare else (),
        )
    finally:
        for stream in streams:
            if stream.details:  # type: ignore[union-attr]
                click.echo(f"fba: warning: {stream.name}: {stream.details}", err=True)  # type: ignore[union-attr]
            stream.close()  # type: ignore[union-attr]


def _puppet(
    model: Path | None, body: Path | None, *, shows: tuple[tuple[str, object], ...], **how: Any
) -> None:
    """A window with a neutral figure and the sliders that move it."""
    import player
    from fba.cli import showing
    from player.performing import neutral

    face, figure = options.read_model(model), showing.read_body(body)
    scene = showing.scene_of(
        neutral(body=body is not None),
        False,
        model=face,
        body=figure,
        axes=how.pop("axes"),
        view=how.pop("view"),
    )
    for switch, state in shows:
        scene.show(switch, state)
    title = " ".join(file.name for file in (model, body) if file is not None)
    player.play(scene, title=title, loop=True, paused=True, panels=("puppet",), **how)


def _check(
    files: tuple[Path, ...], *, compare: bool, arrange: str | None, audio: Path | None, no_audio: bool
) -> None:
    """Raises click.UsageError for options that contradict each other or the files."""
    if audio is not None and no_audio:
        raise click.UsageError("--audio and --no-audio contradict each other")
    if len(files) < 2 and (compare or arrange):
        option = "--compare" if compare else "--arrange"
        raise click.UsageError(f"{option} needs two files or more{f'; {files[0]} is one' if files else ''}")
    if not files and audio is not None:
        raise click.UsageError("--audio goes with a file to play")
    if len(files) > MOST:
        raise click.UsageError(f"{len(files)} files are too many for one window; at most {MOST}")
    if [str(file) for file in files].count("-") > 1:
        raise click.UsageError("standard input (-) can be shown once")


def _check_start(scene: Showable, start: float | None, *, growing: bool) -> None:
    if start is None or growing:
        return
    first, last = float(scene.timeline.start), float(scene.timeline.end)
    if not first <= start < last:
        raise click.UsageError(f"--start {start:g}: the performance goes from {first:g} s to {last:g} s")
