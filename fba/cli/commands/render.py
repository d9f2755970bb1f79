"""`fba render`: pictures and films without a window."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from fba.cli import options, scenes
from fba.cli.command import Command, examples, usage_errors
from fba.cli.inputs import read_input, read_model
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import STANDARD, Output, Outputs, OutputType, display_name
from fba.cli.pose_options import Pose, still_animation
from fba.cli.printing import Progress
from fba.cli.scenes import SceneOptions, SoundOptions, check_files

if TYPE_CHECKING:
    from fba_player.export.image_files import Numbered
    from fba_player.view.protocols import Showable

SHEETS = ("faps", "visemes", "expressions", "all")


def _parse_sheet(text: str) -> str | int:
    if text in SHEETS:
        return text
    if not text.isdecimal() or not 0 < int(text[:9]) <= 10_000:
        kinds = ", ".join(f"{kind!r}" for kind in SHEETS)
        raise ValueError(f"{text!r} is neither a number of frames nor one of {kinds}")
    return int(text)


SHEET = options.TextType("sheet", _parse_sheet)
"""The content of a contact sheet: one of the kinds, or a count of frames of a file."""


@dataclass(frozen=True, kw_only=True)
class _Moment:
    """The frames that are drawn: of a picture, a frame by number or time; of a film, a span."""

    frame: int | None = option(help="For a picture: number of the frame; -1 is the last.")
    time: float | None = option(type=options.MOMENT, metavar="SECONDS", help="For a picture: its time.")
    start: float | None = option(
        type=options.MOMENT, metavar="SECONDS", help="For a film or a sheet: start time."
    )
    end: float | None = option(
        type=options.MOMENT, metavar="SECONDS", help="For a film or a sheet: end time."
    )

    @property
    def is_one(self) -> bool:
        """Whether a single frame is named."""
        return self.frame is not None or self.time is not None


@dataclass(frozen=True, kw_only=True)
class _Writing:
    """How files are written."""

    to: Literal["png", "jpg", "mp4", "gif"] | None = option(
        help="Output format, if OUT is - or its suffix does not show it."
    )
    no_clobber: bool = options.no_clobber_option
    replace: bool = option(default=False, help="Overwrite numbered pictures that exist.")


@dataclass(frozen=True, kw_only=True)
class _Request:
    """What the command line asks for."""

    files: tuple[Path, ...]
    output: str = option(
        "-o", "--output", required=True, metavar="OUT.png|.jpg|.mp4|.gif|FOLDER/%05d.png",
        help="A picture, a film, or numbered pictures (also: a folder with a slash at its end). - for "
        "standard output.",
    )  # fmt: skip
    writing: _Writing
    pose: Pose
    sheet: str | int | None = option(
        "--contact-sheet",
        type=SHEET,
        metavar="N|" + "|".join(SHEETS),
        help="With a file: N of its frames, at even intervals, on one sheet. Without: all FAPs, visemes or "
        "expressions. --size is that of one picture.",
    )
    size: tuple[int, int] | None = options.size_option()
    moment: _Moment
    rate: Fraction | None = options.rate_option(
        "Frame rate of the film; default: the input's own, or a whole fraction of it, at most 60 (GIF: 25)."
    )
    transparent: bool = option(default=False, help="PNG without a background.")
    sound: SoundOptions = group(
        audio=option(
            type=options.FILE,
            metavar="FILE",
            help="Sound of an MP4, from the first frame. Default: that of an MP4 file, else the WAV file of "
            "the same name beside the input.",
        )
    )
    how: SceneOptions


@click.command(
    cls=Command,
    epilog=examples(
        "fba render talk.fba -o talk.mp4",
        "fba render talk.fba -o talk.mp4 --audio voice.wav",
        "fba render walk.fba -o walk.png --frame 40 --size 800x600",
        "fba render walk.bvh -o part.gif --start 2 --end 5 --camera front",
        "fba render walk.bvh -o frames/%05d.png --transparent",
        "fba render walk.bvh -o sheet.png --contact-sheet 12",
        "fba render original.fap decoded.fba -o both.mp4",
        "fba render --fap open_jaw=800 --viseme 4 --expression joy=50 -o face.png",
        "fba render --contact-sheet expressions -o expressions.png",
        "fba render talk.fba -o - --to gif > talk.gif",
    ),
)
@scenes.files_argument
@with_options
def command(request: _Request) -> None:
    """Render files, or a face in a given pose, to a picture, numbered pictures, or a film (MP4 or GIF).

    Needs OpenGL through EGL, but no display.
    """
    target = _plan(request)
    if isinstance(request.sheet, str):
        _draw_kinds(request, target)
    else:
        _draw_scene(request, target)


def _plan(request: _Request) -> _Target:
    """Return where pictures go; click.UsageError for options that contradict each other."""
    files, sheet, how, sound = request.files, request.sheet, request.how, request.sound
    given = request.pose.given + (["--contact-sheet"] if isinstance(sheet, str) else [])
    if files and given:
        what = f"{given[0]} {sheet}" if given == ["--contact-sheet"] else given[0]
        raise click.UsageError(f"{what} makes a picture without a file; leave out {files[0]}")
    if not files:
        _check_still(request, given)
    check_files(files, how, sound, "picture")
    target = _Target.parse(request.output, request.writing.to)
    if request.writing.no_clobber and request.writing.replace:
        raise click.UsageError("--no-clobber and --replace contradict each other")
    if target.suffix != ".mp4" and (sound.audio is not None or sound.audio_offset):
        name = "--audio" if sound.audio is not None else "--audio-offset"
        raise click.UsageError(f"{name} goes into an .mp4 alone")
    if isinstance(sheet, str):
        if given != ["--contact-sheet"] or how.camera is not None or how.view != "figure" or how.shows:
            raise click.UsageError("--contact-sheet has poses and cameras of its own; leave the others out")
        if target.film:
            raise click.UsageError(f"--contact-sheet {sheet} makes one picture, .png or .jpg")
        return target
    if sheet is not None and (target.film or request.transparent or request.moment.is_one):
        raise click.UsageError(
            f"--contact-sheet {sheet} makes one picture, .png or .jpg, of frames between --start and --end"
        )
    if not files and target.film:
        raise click.UsageError("a face in one pose is a picture: write it to a .png")
    return target


def _check_still(request: _Request, given: list[str]) -> None:
    """Raise click.UsageError for options that need a file. given: the options that describe a face."""
    how, moment = request.how, request.moment
    if isinstance(request.sheet, int):
        raise click.UsageError(f"--contact-sheet {request.sheet} shows frames of a file: give one")
    if how.body is not None and how.model is None and not given:
        raise click.UsageError("--body goes with a file, which says how the body moves")
    if not given and how.model is None and how.figure is None:
        raise click.UsageError(
            "give a file, or a face by --fap, --viseme, --expression or --contact-sheet; a --model or "
            "--figure alone is shown at rest"
        )
    moments = {f"--{name}": value for name, value in asdict(moment).items()}
    for name, value in {**moments, "--fps": request.rate, "--audio": request.sound.audio}.items():
        if value is not None:
            shown = given[0] if given else "--model alone"
            raise click.UsageError(f"{name} goes with a file; {shown} makes a single picture")


def _draw_kinds(request: _Request, target: _Target) -> None:
    """Write a sheet of FAPs, visemes or expressions."""
    outputs = target.outputs([request.how.model], request.writing)
    with target.file(outputs) as name:
        made = _sheet(request, Path(name))
    outputs.say(f"{display_name(target.path)}: {made}")


def _draw_scene(request: _Request, target: _Target) -> None:
    """Write a picture, a film, or a sheet of frames, of the files or of a face in a pose."""
    files, how, sound = request.files, request.how, request.sound
    mp4 = target.suffix == ".mp4"
    audio = scenes.find_sound(files, sound, "the film has no sound") if mp4 else None
    outputs = target.outputs([*files, how.model, how.body, audio], request.writing)
    with Progress("preparing", None):
        animations = [read_input(file, how) for file in files]
        names = scenes.display_names(files) or [""]
        scene = scenes.build_scene(animations or [still_animation(request.pose)], names, how)
    with target.file(outputs) as name:
        if isinstance(request.sheet, int):
            made = _sheet(request, Path(name), scene)
        else:
            made = _picture(scene, name, request, audio, film=target.film)
    heard = f", with the sound of {audio}" if audio is not None else ""
    outputs.say(f"{display_name(target.path)}: {made}{heard}")


def _picture(scene: Showable, output: str, request: _Request, audio: Path | None, *, film: bool) -> str:
    """Write a picture or a film; return its size and, if a film has not the rate of its file, its rate."""
    from fba_player.export.render import picture_size, render

    wide, high = picture_size(request.size, output)
    made = f"{wide}x{high}{_rate_text(scene, output) if film and request.rate is None else ''}"
    with Progress("rendering", None) as step, usage_errors():
        render(
            scene,
            output,
            size=request.size,
            rate=request.rate if film else None,
            camera=request.how.camera,
            **asdict(request.moment),
            audio=audio,
            audio_offset=scenes.find_offset(audio, request.files, request.sound),
            transparent=request.transparent,
            replace=request.writing.replace,
            progress=step.show,
        )
    return made


@dataclass(frozen=True)
class _Target:
    """The target of a picture, a film or numbered pictures.

    given: on the command line. path: the file, or the folder of numbered pictures. suffix: of the file, in
    lower case; "" for numbered pictures, whose names have it.
    """

    given: str
    path: Path
    suffix: str
    pictures: Numbered | None = None

    @staticmethod
    def parse(output: str, to: str | None) -> _Target:
        """Return the target that `--output` and `--to` name."""
        from fba_player.export.image_files import Numbered, is_sequence

        if is_sequence(output):
            if to is not None:
                raise click.UsageError(f"--to {to} is for one file; {output} means numbered pictures")
            pictures = Numbered(output)
            return _Target(output, pictures.folder, "", pictures)
        path = OutputType().convert(output, None, None)
        if path == STANDARD and to is None:
            raise click.UsageError("name the format for standard output with --to: png, jpg, mp4, gif")
        return _Target(output, path, f".{to}" if to is not None else path.suffix.lower())

    @property
    def film(self) -> bool:
        """Whether there are many pictures."""
        from fba_player.export.image_files import is_film

        return self.pictures is not None or is_film(f"film{self.suffix}")

    def outputs(self, inputs: Iterable[Path | None], writing: _Writing) -> Outputs:
        """Return the files to write; of numbered pictures, the files that are replaced."""
        if self.pictures is None:
            return Outputs([Output("--output", self.path)], inputs, no_clobber=writing.no_clobber)
        numbers = self.pictures.existing() if writing.replace else []
        return Outputs([Output("--output", self.pictures.path(number)) for number in numbers], inputs)

    @contextmanager
    def file(self, outputs: Outputs) -> Iterator[str]:
        """Give the name to write to, for a `with` statement."""
        if self.pictures is not None:
            yield self.given
            return
        with outputs.file(self.path, self.suffix) as file:
            yield str(file)


def _rate_text(scene: Showable, output: str) -> str:
    """Return the frame rate of a film as text, if it is not that of the file; else ""."""
    from fba_player.export.render import film_rate

    source, rate = scene.timeline.rate, film_rate(scene.timeline.rate, output)
    if rate == source:
        return ""
    return f", {float(rate):.5g} frames/s, {float(source):.5g} in the file (another rate: --fps)"


def _sheet(request: _Request, output: Path, scene: Showable | None = None) -> str:
    """Write a sheet of frames of a scene, or of FAPs, visemes or expressions; return its size as text."""
    from fba_player.export.contact_sheet import contact_sheet
    from fba_player.export.film_sheet import film_sheet
    from fba_player.export.image_files import check_picture, write_picture

    sheet, moment = request.sheet, request.moment
    check_picture(output, transparent=False)
    with Progress("rendering", None) as step, usage_errors():
        if isinstance(sheet, int):
            assert scene is not None  # a count is that of its frames
            camera, size = request.how.camera, request.size
            pixels = film_sheet(
                scene, sheet, tile=size, camera=camera, start=moment.start, end=moment.end, progress=step.show
            )
        else:
            pixels = contact_sheet(
                str(sheet), read_model(request.how.model, request.how.figure), tile=request.size
            )
    write_picture(output, pixels)
    return f"{pixels.shape[1]}x{pixels.shape[0]}"
