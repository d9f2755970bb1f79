"""`fba render`: pictures and videos without a window."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path

import click

from fba.cli import options

SHEETS = ("faps", "visemes", "expressions", "all")


@click.command(
    epilog=options.examples(
        "fba render talk.fba -o talk.mp4",
        "fba render walk.fba -o walk.png --frame 40 --size 800x600",
        "fba render walk.fba -o part.mp4 --start 2 --end 5 --fps 30 --camera front",
        "fba render --fap open_jaw=800 --viseme 4 --expression joy=50 -o face.png",
        "fba render --contact-sheet expressions -o expressions.png",
    )
)
@click.argument("file", type=options.EXISTING, required=False)
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="OUT.png|OUT.jpg|OUT.mp4",
    type=click.Path(dir_okay=False, path_type=Path),
)
@click.option(
    "--fap",
    "faps",
    multiple=True,
    metavar="NAME=VALUE",
    help="Without a file: a FAP of the face, by name or number; again for more. A left or right one alone "
    "moves both sides, as in a stream: give its mate as well.",
)
@click.option(
    "--viseme",
    "visemes",
    multiple=True,
    metavar="NAME[=BLEND]",
    help="Without a file: a viseme by number, name or sound; of two, BLEND (0..63) is the share.",
)
@click.option(
    "--expression",
    "expressions",
    multiple=True,
    metavar="NAME[=INTENSITY]",
    help="Without a file: an expression, 0..63; up to two.",
)
@click.option(
    "--contact-sheet",
    "sheet",
    type=click.Choice(SHEETS),
    help="Without a file: all FAPs, visemes or expressions on a sheet; --size is that of one picture.",
)
@options.model_option
@click.option("--size", type=options.SizeType(), metavar="WxH", help="Default: 1280x720.")
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
    file: Path | None,
    output: Path,
    faps: tuple[str, ...],
    visemes: tuple[str, ...],
    expressions: tuple[str, ...],
    sheet: str | None,
    model: Path | None,
    size: tuple[int, int] | None,
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
    """Render a file, or a face in a given pose, to a picture or an MP4 (H.264).

    Needs OpenGL through EGL, but no display.
    """
    given = [name for name, value in (("--fap", faps), ("--viseme", visemes), ("--expression", expressions),
                                      ("--contact-sheet", sheet)) if value]  # fmt: skip
    if file is not None and given:
        raise click.UsageError(f"{given[0]} makes a picture without a file; leave out {file}")
    if file is None and not given:
        raise click.UsageError("give a file, or a face by --fap, --viseme, --expression or --contact-sheet")
    moments = {"--frame": frame, "--time": time, "--start": start, "--end": end, "--fps": fps}
    for name, value in moments.items():
        if file is None and value is not None:
            raise click.UsageError(f"{name} goes with a file; {given[0]} makes a single picture")
    if sheet is not None:
        if given != ["--contact-sheet"] or camera is not None or view != "figure":
            raise click.UsageError("--contact-sheet has poses and cameras of its own; leave the others out")
        _contact_sheet(sheet, output, model, size)
        return
    import player
    from fba.cli.still import still

    if file is None:
        animation = still(faps, visemes, expressions)
        if output.suffix.lower() == ".mp4":
            raise click.UsageError("a face in one pose is a picture: write it to a .png")
    else:
        animation = options.read_input(file, bap_steps=bap_steps, header_fps=fps, salvage=salvage)
    scene = player.Scene(animation, options.read_model(model), axes=axes, view=view)
    size = size or (1280, 720)
    with options.progress("rendering", None) as step, _usage():
        player.render(
            scene,
            output,
            size=size,
            fps=fps if output.suffix.lower() == ".mp4" else None,
            camera=camera,
            frame=frame,
            time=time,
            start=start,
            end=end,
            progress=step.of,
        )
    click.echo(f"{output}: {size[0]}x{size[1]}")


def _contact_sheet(what: str, output: Path, model: Path | None, size: tuple[int, int] | None) -> None:
    from player.contact_sheet import contact_sheet
    from player.recording import write_picture

    with _usage():
        pixels = contact_sheet(what, options.read_model(model), tile=size)
    write_picture(output, pixels)
    click.echo(f"{output}: {pixels.shape[1]}x{pixels.shape[0]}")


@contextmanager
def _usage() -> Iterator[None]:
    """What is wrong with the options is a usage error."""
    try:
        yield
    except ValueError as error:
        if type(error) is not ValueError:
            raise
        raise click.UsageError(str(error)) from error
