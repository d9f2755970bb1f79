"""`fba play`: a window that shows a file."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import click

from fba.cli import options


@click.command(
    epilog=options.examples(
        "fba play talk.fba",
        "fba play walk.bvh --loop",
        "fba play talk.fap --fps 25 --speed 0.5",
    )
)
@click.argument("file", type=options.EXISTING)
@options.fps_option("Frame rate of a file without a header.")
@click.option(
    "--speed", type=click.FloatRange(0.1, 4.0), default=1.0, show_default=True, help="1: as recorded."
)
@click.option("--loop", is_flag=True, help="Start again at the end.")
@click.option("--size", type=options.SizeType(), default="1280x720", show_default=True, metavar="WxH")
@options.model_option
@options.camera_option
@options.view_option
@options.show_option
@options.axes_option
@options.bap_steps_option
@options.salvage_option
def command(
    file: Path,
    fps: Fraction | None,
    speed: float,
    loop: bool,
    size: tuple[int, int],
    model: Path | None,
    camera: str | None,
    view: str,
    shows: tuple[tuple[str, object], ...],
    axes: str,
    bap_steps: str,
    salvage: bool,
) -> None:
    """Play a file in a window: space plays and pauses, arrows step, F1 shows all keys.

    Without a display, use `fba render`.
    """
    import player

    animation = options.read_input(file, bap_steps=bap_steps, header_fps=fps, salvage=salvage)
    scene = player.Scene(animation, options.read_model(model), axes=axes, view=view)
    for switch, state in shows:
        scene.show(switch, state)
    player.play(
        scene,
        size=size,
        speed=speed,
        loop=loop,
        camera=camera,
        title=file.name,
        file=file,
        bap_steps=bap_steps,
    )
