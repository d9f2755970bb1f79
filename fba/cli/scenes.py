"""The scenes of `fba play` and `fba render`: options, and loading from files and from streams that arrive."""

from __future__ import annotations

import contextlib
import os
import stat
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Literal, cast

import click

from fba.animation import Animation
from fba.cli import inputs, live_streams, options
from fba.cli.inputs import Reading
from fba.cli.live_streams import Receiving
from fba.cli.map_options import MAP, Maps, read_body_joints
from fba.cli.option_fields import option
from fba.errors import FbaError, FormatError, warn
from fba.source import read_head, read_whole

if TYPE_CHECKING:
    from io import BufferedReader

    from fba.body import BodyModel
    from fba.carriage.mp4 import Mp4Track
    from fba.face import FaceModel
    from fba_player.playback.live import LiveAnimation
    from fba_player.scene.scene import Scene

MOST_FILES = 8
"""Files that are shown at once."""
STREAM_STARTS = (b"\0\0\1\xba", b"\0\0\1\x01", b"\0\0\1\xb0", b"\0\0\1\xb5")
"""Beginnings of an FBA stream: the object, or the layers around it."""


def _parse_show(text: str) -> tuple[str, Any]:
    from fba_player.view.switches import parse_switch

    return parse_switch(text)


def _parse_camera(text: str) -> Any:
    from fba.player import Camera

    if text in Camera.presets:
        return text
    camera = Camera.parse(text)
    return camera if Camera.has_place(text) else text  # which fits what is shown


CAMERA = options.TextType("camera", _parse_camera)
"""A camera: the name of a view, or its place in numbers."""
SHOW = options.TextType("switch", _parse_show)
"""A switch of the player: wireframe, influence=open_jaw, shadows=off."""
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
        type=MAP,
        multiple=True,
        metavar="JOINT=JOINT|FILE",
        help="With --body: which joint of the standard a joint of its skeleton is, Pelvis=HumanoidRoot; "
        "none: Hat=. Repeatable. Or a TOML file of such pairs.",
    )
    figure: options.Figure | None = options.figure_option
    arrange: Literal["side", "over", "colour", "wipe"] | None = option(
        help="Several files: side by side (default); the others as drawings over the first; side by side, "
        "coloured by their distance from the first; or two in one place, on either side of a line (wipe)."
    )
    root: Literal["own", "common"] | None = option(
        help="Several bodies: each moves through its own places (default), or all through the first's."
    )
    camera: Any = option(
        type=CAMERA,
        metavar="VIEW",
        help="Of the face: front, three-quarter, profile or face; of the whole figure: body, side, back or "
        "top; or turn=35,tilt=5,distance=1.2,at=0:1.6:0,angle=24 in degrees and metres (without distance and "
        "at, the figure fits). Default: one that suits the content.",
    )
    follow: Literal["hips", "head", "none"] | None = option(
        help="What the camera follows. Default: the head in views of the face, else a figure that walks away."
    )
    orbit: float | None = option(
        type=options.FloatRange(1.0, 3600.0),
        metavar="SECONDS",
        help="Let the camera turn around the figure, once in this time.",
    )
    view: Literal["figure", "points"] = option(
        default="figure", help="A person, or the face as its feature points and the body as its bones."
    )
    shows: tuple[tuple[str, object], ...] = option(
        "--show",
        default=(),
        type=SHOW,
        multiple=True,
        metavar="SWITCH[=VALUE]",
        help="What else is shown; repeatable: wireframe, points, influence=FAP, skeleton[=only], grid, "
        "normals; shadows, wrinkles, contact, relaxed, eyes, teeth, hair=off; background=grey or "
        "transparent.",
    )
    lod: Literal["auto", "full", "0", "1", "2", "3", "4"] | None = option(
        help="Level of detail of faces: by their size in pixels (default), or one of those that the model "
        "holds, from fine to coarse; 0 or full: all triangles, also of bodies."
    )
    quality: Literal["auto", "fast", "fine"] | None = option(
        help="Edges smooth by four samples a pixel (fine), or only along outlines (fast). Default: fine, but "
        "fast in a window without a graphics card."
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
        help="Sound, from the first frame. Default: that of an MP4 file, else the WAV file of the same name "
        "beside the input.",
    )
    no_audio: bool = option(default=False, help="No sound.")
    audio_offset: float = option(
        default=0.0,
        type=options.MOMENT,
        metavar="SECONDS",
        help="Delay of the sound; negative: it begins earlier.",
    )


def check_files(files: tuple[Path, ...], how: SceneOptions, sound: SoundOptions, what: str) -> None:
    """Raise click.UsageError for options that contradict each other or the files.

    what: "window" or "picture", for messages.
    """
    check_sound_options(sound)
    inputs.check_clip(how, files)
    if len(files) > MOST_FILES:
        raise click.UsageError(f"{len(files)} files are too many for one {what}; at most {MOST_FILES}")
    if len(files) < 2 and how.arrange is not None:
        single = f"; {files[0]} is one" if files else ""
        raise click.UsageError(f"--arrange needs two files or more{single}")
    if how.root is not None and len(files) < 2:
        raise click.UsageError("--root needs two files or more")
    if how.arrange == "wipe" and len(files) != 2:
        raise click.UsageError(f"--arrange wipe needs two files; {len(files)} are given")


def check_sound_options(sound: SoundOptions) -> None:
    """Raise click.UsageError for options of the sound that contradict each other."""
    if sound.audio is not None and sound.no_audio:
        raise click.UsageError("--audio and --no-audio contradict each other")
    if sound.audio_offset and sound.no_audio:
        raise click.UsageError("--audio-offset and --no-audio contradict each other")


def open_file(
    file: Path, how: SceneOptions, receiving: Receiving, stack: contextlib.ExitStack
) -> inputs.ReadFile | LiveAnimation:
    """Return the content of a file, or a growing animation of a stream that arrives.

    That is one on standard input, in a FIFO, or from a network, whose receiver the stack closes.

    Other formats are read to their end first. Raises click.UsageError if standard input is a terminal, and
    what `inputs.read_file` and `LiveAnimation.wait` raise.
    """
    name = "standard input" if str(file) == "-" else file.name
    if live_streams.is_from_network(file):
        from fba_player.playback.live import LiveAnimation

        receiver = live_streams.opened(file, receiving, stack)
        live = LiveAnimation(receiver, name=str(receiver.address), bap_steps=how.bap_steps)
        receiver.say = live.tell
        return _arrived(live)
    if str(file) == "-" and sys.stdin.isatty():
        raise click.UsageError("- reads standard input, which is the keyboard here: pipe a stream into it")
    if str(file) != "-" and not is_pipe(file):
        return inputs.read_file(file, how)
    with contextlib.ExitStack() as opened:
        piped = sys.stdin.buffer if str(file) == "-" else opened.enter_context(_fifo(file))
        source = cast("BufferedReader", piped)
        head = b""
        while len(head) < 4 and (more := source.read1(1 << 16)):
            head += more
        if not head:
            raise FormatError("is empty", path=name)
        if not head.startswith(STREAM_STARTS):
            return _read_other(head, source, name, how)
        from fba_player.playback.live import LiveAnimation

        close = opened.pop_all().close
        live = LiveAnimation(source, head=head, name=name, bap_steps=how.bap_steps, at_end=close)
    return _arrived(live)


def _arrived(live: LiveAnimation) -> LiveAnimation:
    """Wait for the first frames of a stream; return it."""
    from fba_player.playback.live import wait_for

    wait_for(live, lambda text: click.echo(f"fba: {text}", err=True))
    if live.steps_explanation:
        click.echo(f"fba: {live.name}: BAP steps {live.steps_explanation}", err=True)
    return live


def is_pipe(file: Path) -> bool:
    """Whether a file is a FIFO, or a device that can be read only once, such as /dev/stdin."""
    try:
        mode = os.stat(file).st_mode
    except OSError:
        return False
    return stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode)


def build_scene(
    animations: Sequence[Animation | LiveAnimation],
    names: list[str],
    how: SceneOptions,
    *,
    over: bool = False,
) -> Any:
    """Return one scene of animations. over: draw them over each other, without `--arrange`."""
    joints = read_body_joints(how.maps, how.body, how.limit)
    face = inputs.read_model(how.model, how.figure)
    figure = inputs.read_body(how.body, joints, how.figure)
    for name, animation in zip(names, animations, strict=True):
        if how.axes == "iso" and isinstance(animation, Animation):
            inputs.warn_of_turned_legs(name, animation)
    scenes = [_build_one(animation, face, figure, how) for animation in animations]
    result: Any = scenes[0]
    if len(scenes) > 1:
        from fba_player.scene.compare import CompareScene

        result = CompareScene(scenes, arrangement=how.arrange or ("over" if over else "side"), names=names)
        result.root = how.root or result.root
    given = [(name, value) for name in ("lod", "quality") if (value := getattr(how, name)) is not None]
    for switch, state in (*how.shows, *given):
        result.show(switch, state)
    result.follow, result.orbit = how.follow, how.orbit
    return result


def display_names(files: tuple[Path, ...]) -> list[str]:
    """Return the names of files that are shown together, with their folders where names are equal."""
    given = [file.name for file in files]
    return [
        f"{file.absolute().parent.name}/{name}" if given.count(name) > 1 and name != "-" else name
        for file, name in zip(files, given, strict=True)
    ]


def find_sound(files: tuple[Path, ...], sound: SoundOptions, without: str) -> Path | None:
    """Return the given sound, else the first readable sound in or beside a file, else None.

    without: begins the warning about an unreadable sound. Raises FormatError if the given sound cannot be
    read, click.UsageError for an offset without a sound.
    """
    path = _choose_sound(files, sound, without)
    if path is None and sound.audio_offset:
        raise click.UsageError("--audio-offset needs a sound: give one with --audio")
    return path


def find_offset(audio: Path | None, files: tuple[Path, ...], sound: SoundOptions) -> float:
    """Return the seconds by which a sound begins after the first frame.

    That is `--audio-offset`, and for the sound of an MP4 file that is shown, also what its tracks say.
    """
    if audio is None or audio not in files:
        return sound.audio_offset
    from fba.audio import SoundFile

    planes = next((float(each.start) for each in _tracks(audio) if each.is_fba), 0.0)
    with SoundFile(audio) as heard:
        return sound.audio_offset + heard.start - planes


def _tracks(file: Path) -> tuple[Mp4Track, ...]:
    """Return the tracks of an MP4 file; none of another file, or of one that cannot be read."""
    from fba.carriage.mp4 import is_mp4, list_tracks

    try:
        return list_tracks(read_whole(file), file) if is_mp4(read_head(file)) else ()
    except FbaError:
        return ()  # its reader says why


def _choose_sound(files: tuple[Path, ...], sound: SoundOptions, without: str) -> Path | None:
    from fba_player.sound.soundtrack import check_sound, find_sound_beside

    if sound.audio is not None:
        check_sound(sound.audio)
        return sound.audio
    if sound.no_audio:
        return None
    for file in files:
        if str(file) == "-" or is_pipe(file):
            continue
        tracks = _tracks(file)
        inside = any(each.is_fba for each in tracks) and any(each.kind == "soun" for each in tracks)
        path = file if inside else find_sound_beside(file)
        if path is None:
            continue
        try:
            check_sound(path)
        except FormatError as error:
            warn(f"{without}: {error}", stacklevel=3)
            continue
        return path
    return None


def _build_one(
    animation: Animation | LiveAnimation, model: FaceModel | None, body: BodyModel | None, how: SceneOptions
) -> Scene:
    from fba_player.scene.scene import Scene

    given: dict[str, Any] = {"body": body, "axes": how.axes, "view": how.view}
    if isinstance(animation, Animation):
        return Scene(animation, model, **given)
    from fba.face import FaceModel
    from fba_player.playback.live import LiveTimeline

    face = model or FaceModel.default()
    timeline = LiveTimeline(animation, face)
    return Scene(animation, face, timeline=timeline, **given)  # type: ignore[arg-type]


def _fifo(file: Path) -> BinaryIO:
    click.echo(f"fba: waiting for a sender to open {file}", err=True)
    return open(file, "rb")


def _read_other(head: bytes, source: BinaryIO, name: str, how: SceneOptions) -> inputs.ReadFile:
    """Return the content of a pipe without an FBA stream. head: the bytes that were read before."""
    with inputs.spooled(source, name, head) as path:
        read = inputs.read_file(path, how, name=name)
    if read.animation.name != path.name:
        return read
    return replace(read, animation=replace(read.animation, name=name))
