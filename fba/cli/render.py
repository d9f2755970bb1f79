"""`fba render`: pictures and films without a window."""

from __future__ import annotations

import warnings
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli import options
from fba.errors import FbaWarning, FormatError

if TYPE_CHECKING:
    from fba.animation import Animation
    from player.showable import Showable

MOST = 8
"""Files in one picture."""
SHEETS = ("faps", "visemes", "expressions", "all")


class SheetType(click.ParamType[str | int]):
    """What is on a contact sheet: one of the kinds, or how many frames of a file."""

    name = "sheet"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str | int:
        if value in SHEETS:
            return str(value)
        if not str(value).isdecimal() or not 0 < int(str(value)[:9]) <= 10_000:
            kinds = ", ".join(f"{kind!r}" for kind in SHEETS)
            self.fail(f"{value!r} is neither a number of frames nor one of {kinds}", param, ctx)
        return int(value)


@click.command(
    epilog=options.examples(
        "fba render talk.fba -o talk.mp4",
        "fba render talk.fba -o talk.mp4 --audio voice.wav",
        "fba render walk.fba -o walk.png --frame 40 --size 800x600",
        "fba render walk.fba -o part.gif --start 2 --end 5 --camera front",
        "fba render walk.fba -o frames/%05d.png --transparent",
        "fba render walk.fba -o sheet.png --contact-sheet 12",
        "fba render original.fap decoded.fba -o both.mp4",
        "fba render --fap open_jaw=800 --viseme 4 --expression joy=50 -o face.png",
        "fba render --contact-sheet expressions -o expressions.png",
    )
)
@click.argument("files", type=options.EXISTING, nargs=-1, metavar="[FILE...]")
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="OUT.png|.jpg|.mp4|.gif|FOLDER/%05d.png",
    help="A picture, a film, or numbered pictures (also: a folder with a slash at its end).",
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
    type=SheetType(),
    metavar="N|" + "|".join(SHEETS),
    help="With a file: N of its frames, at even distances, on one sheet. Without: all FAPs, visemes or "
    "expressions. --size is that of one picture.",
)
@options.model_option
@options.body_option
@click.option(
    "--arrange",
    type=click.Choice(["side", "over"]),
    help="Several files: side by side (default), or the others as drawings over the first.",
)
@click.option("--size", type=options.SizeType(), metavar="WxH", help="Default: 1280x720; of a GIF, 480x270.")
@options.fps_option("Frame rate of the film; default: the input's own, or a part of it.")
@click.option("--frame", type=int, help="For a picture: which frame; -1 is the last.")
@click.option("--time", type=float, metavar="SECONDS", help="For a picture: at what time.")
@click.option("--start", type=float, metavar="SECONDS", help="For a film or a sheet: from when.")
@click.option("--end", type=float, metavar="SECONDS", help="For a film or a sheet: until when.")
@click.option(
    "--audio",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE",
    help="For an MP4: its sound. Default: the WAV of the same name beside the file, where there is one.",
)
@click.option("--no-audio", is_flag=True, help="For an MP4: no sound.")
@click.option("--transparent", is_flag=True, help="PNG without a background.")
@click.option("--replace", is_flag=True, help="Numbered pictures that exist are overwritten.")
@options.camera_option
@options.view_option
@options.show_option
@options.deform_option
@options.axes_option
@options.bap_steps_option
@options.salvage_option
def command(
    files: tuple[Path, ...],
    output: str,
    faps: tuple[str, ...],
    visemes: tuple[str, ...],
    expressions: tuple[str, ...],
    sheet: str | int | None,
    model: Path | None,
    body: Path | None,
    arrange: str | None,
    size: tuple[int, int] | None,
    fps: Fraction | None,
    frame: int | None,
    time: float | None,
    start: float | None,
    end: float | None,
    audio: Path | None,
    no_audio: bool,
    transparent: bool,
    replace: bool,
    camera: str | None,
    view: str,
    shows: tuple[tuple[str, object], ...],
    axes: str,
    bap_steps: str,
    salvage: bool,
) -> None:
    """Render files, or a face in a given pose, to a picture, numbered pictures, or a film (MP4 or GIF).

    Needs OpenGL through EGL, but no display.
    """
    from player.sequence import is_film

    given = [name for name, value in (("--fap", faps), ("--viseme", visemes), ("--expression", expressions),
                                      ("--contact-sheet", isinstance(sheet, str))) if value]  # fmt: skip
    if files and given:
        what = f"{given[0]} {sheet}" if given == ["--contact-sheet"] else given[0]
        raise click.UsageError(f"{what} makes a picture without a file; leave out {files[0]}")
    if not files and isinstance(sheet, int):
        raise click.UsageError(f"--contact-sheet {sheet} shows frames of a file: give one")
    if not files and not given:
        raise click.UsageError("give a file, or a face by --fap, --viseme, --expression or --contact-sheet")
    moments = {"--frame": frame, "--time": time, "--start": start, "--end": end, "--fps": fps}
    for name, value in (*moments.items(), ("--audio", audio)):
        if not files and value is not None:
            raise click.UsageError(f"{name} goes with a file; {given[0]} makes a single picture")
    if len(files) > MOST or (arrange is not None and len(files) < 2):
        raise click.UsageError(
            f"{len(files)} files are too many for one picture; at most {MOST}"
            if len(files) > MOST
            else "--arrange goes with several files"
        )
    film = is_film(output)
    if audio is not None and (no_audio or not output.lower().endswith(".mp4")):
        raise click.UsageError(
            "--audio and --no-audio contradict each other" if no_audio else "--audio goes into an .mp4 alone"
        )
    if isinstance(sheet, str):
        if given != ["--contact-sheet"] or camera is not None or view != "figure" or shows:
            raise click.UsageError("--contact-sheet has poses and cameras of its own; leave the others out")
        _kinds_sheet(sheet, Path(output), model, size)
        return
    if sheet is not None and (film or transparent or frame is not None or time is not None):
        raise click.UsageError(
            f"--contact-sheet {sheet} makes one picture, .png or .jpg, of frames between --start and --end"
        )
    if not files and film:
        raise click.UsageError("a face in one pose is a picture: write it to a .png")
    from fba.cli.still import still
    from player.recording import render

    animations = [
        options.read_input(file, bap_steps=bap_steps, header_fps=fps, salvage=salvage) for file in files
    ] or [still(faps, visemes, expressions)]
    scene = _scene(animations, files, arrange or "side", model=model, body=body, axes=axes, view=view)
    for switch, on in shows:
        scene.show(switch, on)
    if sheet is not None:
        _frames_sheet(scene, sheet, Path(output), tile=size, camera=camera, start=start, end=end)
        return
    if audio is None and not no_audio and output.lower().endswith(".mp4"):
        audio = _voice(files)
    with options.progress("rendering", None) as step, options.usage_errors():
        written = render(
            scene,
            output,
            size=size,
            fps=fps if film else None,
            camera=camera,
            frame=frame,
            time=time,
            start=start,
            end=end,
            audio=audio,
            transparent=transparent,
            replace=replace,
            progress=step.of,
        )
    sound = f", with the sound of {audio}" if audio is not None else ""
    click.echo(f"{written}: {_size(size, output)}{sound}")


def _size(size: tuple[int, int] | None, output: str) -> str:
    from player.recording import picture_size

    width, height = picture_size(size, output)
    return f"{width}x{height}"


def _scene(
    animations: list[Animation],
    files: tuple[Path, ...],
    arrange: str,
    *,
    model: Path | None,
    body: Path | None,
    **how: Any,
) -> Any:
    """One scene, or several in one."""
    from player.scene import Scene

    face, figure = options.read_model(model), None
    if body is not None:
        from fba.body.model import BodyModel

        figure = BodyModel.load(body)
    scenes = [Scene(animation, face, body=figure, **how) for animation in animations]
    if len(scenes) == 1:
        return scenes[0]
    from player.compare import CompareScene

    return CompareScene(scenes, arrangement=arrange, names=[file.name for file in files])


def _voice(files: tuple[Path, ...]) -> Path | None:
    """The sound beside the first of the files that has one, where it can be read."""
    from player.sound import beside, check

    found = next((voice for voice in map(beside, files) if voice is not None), None)
    if found is not None:
        try:
            check(found)
        except FormatError as error:
            warnings.warn(f"the film has no sound: {error}", FbaWarning, stacklevel=2)
            return None
    return found


def _kinds_sheet(what: str, output: Path, model: Path | None, size: tuple[int, int] | None) -> None:
    from player.contact_sheet import contact_sheet
    from player.picture_files import write_picture

    with options.usage_errors():
        pixels = contact_sheet(what, options.read_model(model), tile=size)
    write_picture(output, pixels)
    click.echo(f"{output}: {pixels.shape[1]}x{pixels.shape[0]}")


def _frames_sheet(scene: Showable, count: int, output: Path, **how: Any) -> None:
    from player.film_sheet import film_sheet
    from player.picture_files import write_picture

    with options.progress("rendering", None) as step, options.usage_errors():
        pixels = film_sheet(scene, count, progress=step.of, **how)
    write_picture(output, pixels)
    click.echo(f"{output}: {pixels.shape[1]}x{pixels.shape[0]}")
