"""Load the scenes of `fba play` and `fba render` from files, and from streams that are still arriving."""

from __future__ import annotations

import contextlib
import os
import stat
import sys
import warnings
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import click

from fba.animation import Animation
from fba.cli import inputs
from fba.cli.joint_options import read_body_joints
from fba.cli.scene_options import SceneOptions, SoundOptions
from fba.errors import FbaWarning, FormatError

if TYPE_CHECKING:
    from fba.body import BodyModel
    from fba.face import FaceModel
    from fba_player.playback.live import LiveAnimation
    from fba_player.scene.scene import Scene

STREAMS = (b"\0\0\1\xba", b"\0\0\1\x01", b"\0\0\1\xb0", b"\0\0\1\xb5")
"""How an FBA stream begins: the object, or the layers around it."""


def open_file(file: Path, how: SceneOptions) -> inputs.ReadFile | LiveAnimation:
    """Return what a file holds, or an FBA stream on standard input or in a FIFO, whose animation grows.

    Other formats are read to their end first.
    Raises click.UsageError if standard input is a terminal, and what `inputs.read_file` and
    `LiveAnimation.wait` raise.
    """
    name = "standard input" if str(file) == "-" else file.name
    if str(file) == "-" and sys.stdin.isatty():
        raise click.UsageError("- reads standard input, which is the keyboard here: pipe a stream into it")
    if str(file) != "-" and not is_pipe(file):
        return inputs.read_file(file, how)
    with contextlib.ExitStack() as stack:
        source: BinaryIO = sys.stdin.buffer if str(file) == "-" else stack.enter_context(_fifo(file))
        head = b""
        while len(head) < 4 and (more := source.read1(1 << 16)):  # type: ignore[attr-defined]
            head += more
        if not head:
            raise FormatError("is empty", path=name)
        if not head.startswith(STREAMS):
            return _read_other(head, source, name, how)
        from fba_player.playback.live import LiveAnimation, wait_for

        close = stack.pop_all().close
        live = LiveAnimation(source, head=head, name=name, bap_steps=how.bap_steps, at_end=close)  # type: ignore[arg-type]
    wait_for(live, lambda text: click.echo(f"fba: {text}", err=True))
    if live.steps_explanation:
        click.echo(f"fba: {name}: BAP steps {live.steps_explanation}", err=True)
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
    """Return one scene of animations. over: draws them over each other unless `--arrange` is given."""
    joints = read_body_joints(how.maps, how.body, how.limit)
    face, figure = inputs.read_model(how.model), inputs.read_body(how.body, joints)
    scenes = [_build_one(animation, face, figure, how) for animation in animations]
    result: Any = scenes[0]
    if len(scenes) > 1:
        from fba_player.scene.compare import CompareScene

        result = CompareScene(scenes, arrangement=how.arrange or ("over" if over else "side"), names=names)
    for switch, state in how.shows:
        result.show(switch, state)
    return result


def display_names(files: tuple[Path, ...]) -> list[str]:
    """Return the names under which files are shown together, with their folders if names are the same."""
    given = [file.name for file in files]
    return [
        f"{file.absolute().parent.name}/{name}" if given.count(name) > 1 and name != "-" else name
        for file, name in zip(files, given, strict=True)
    ]


def find_sound(files: tuple[Path, ...], sound: SoundOptions, without: str) -> Path | None:
    """Return the given sound, or a readable one beside the first file that has one.

    without: begins the warning of sounds that cannot be read. Raises FormatError if the given sound cannot be
    read, click.UsageError for an offset without a sound.
    """
    path = _choose_sound(files, sound, without)
    if path is None and sound.audio_offset:
        raise click.UsageError("--audio-offset needs a sound: give one with --audio")
    return path


def _choose_sound(files: tuple[Path, ...], sound: SoundOptions, without: str) -> Path | None:
    from fba_player.sound.soundtrack import check_sound, find_sound_beside

    if sound.audio is not None:
        check_sound(sound.audio)
        return sound.audio
    if sound.no_audio:
        return None
    for file in files:
        path = None if str(file) == "-" or is_pipe(file) else find_sound_beside(file)
        if path is None:
            continue
        try:
            check_sound(path)
        except FormatError as error:
            warnings.warn(f"{without}: {error}", FbaWarning, stacklevel=3)
            continue
        return path
    return None


def _build_one(
    animation: Animation | LiveAnimation,
    model: FaceModel | None,
    body: BodyModel | None,
    how: SceneOptions,
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
    """Return what a pipe holds that carries no FBA stream. head: what was read from it before."""
    with inputs.spooled(source, name, head) as path:
        found = inputs.read_file(path, how, name=name)
    if found.animation.name != path.name:
        return found
    return replace(found, animation=replace(found.animation, name=name))
