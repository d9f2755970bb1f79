"""`fba render`: pictures and videos without a window."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import click

from fba.cli import options


@click.command(
    epilog=options.examples(
        "fba render talk.fba -o talk.mp4",
        "fba render walk.fba -o walk.png --frame 40 --size 800x600",
        "fba render walk.fba -o part.mp4 --start 2 --end 5 --fps 30 --camera front",
    )
)
@click.argument("file", type=options.EXISTING)
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="OUT.png|OUT.mp4",
    type=click.Path(dir_okay=False, path_type=Path),
)
@click.option("--size", type=options.SizeType(), default="1280x720", show_default=True, metavar="WxH")
@options.fps_option("Frame rate of the video; default: the input's own, or a part of it.")
@click.option("--frame", type=int, help="For a picture: which frame; -1 is the last.")
@click.option("--time", type=float, metavar="SECONDS", help="For a picture: at what time.")
@click.option("--start", type=float, metavar="SECONDS", help="For a video: from when.")
@click.option("--end", type=float, metavar="SECONDS", help="For a video: until when.")
@options.camera_option
@options.view_option
@options.axes_option
@options.bap_steps_option
@options.salvage_option
def command(
    file: Path,
    output: Path,
    size: tuple[int, int],
    fps: Fraction | None,
    frame: int | None,
    time: float | None,
    start: float | None,
    end: float | None,
    camera: str | None,
    view: str,
    axes: str,
    bap_steps: str,
    salvage: bool,
) -> None:
    """Render a file to a PNG or an MP4 (H.264); needs OpenGL through EGL, but no display."""
    import player

    animation = options.read_input(file, bap_steps=bap_steps, header_fps=fps, salvage=salvage)
    scene = player.Scene(animation, axes=axes, view=view)
    with options.progress("rendering", None) as step:
        try:
            player.render(
                scene,
                output,
                size=size,
                fps=fps if output.suffix.lower() != ".png" else None,
                camera=camera,
                frame=frame,
                time=time,
                start=start,
                end=end,
                progress=step.of,
            )
        except ValueError as error:
            if type(error) is not ValueError:
                raise
            raise click.UsageError(str(error)) from error
    click.echo(f"{output}: {size[0]}x{size[1]}")
