"""`fba demo`: from BVH, FAP and C3D files to streams and a picture, with the samples that come with fba.

Scripts made the samples (tools/make_samples.py, make_face_capture.py); nobody was captured for them.
"""

from __future__ import annotations

import shlex
import tempfile
from importlib.resources import files
from pathlib import Path
from threading import Timer
from typing import TYPE_CHECKING

import click

from fba.animation import Animation
from fba.cli import options
from fba.cli.command import Command, as_typed, examples
from fba.cli.option_fields import option, with_options
from fba.cli.outputs import Output, Outputs
from fba.cli.printing import Progress, rate_text, seconds_text
from fba.encoder_options import EncoderOptions
from fba.errors import DisplayError
from fba.parameters import BapTable

if TYPE_CHECKING:
    from fba_player.window.surface import Surface

BAP_STEPS: BapTable = "visage"
"""The standard's own table moves the root in steps of 64 mm, which is visible."""
SAMPLES = ("hello.bvh", "hello.fap")
"""A body and a face."""
CAPTURE = "talk.c3d"
"""Markers on a face."""
SOUND = "hello.wav"
"""What they say."""
TITLE = "fba demo"
"""Title of the window."""
SECONDS_BEFORE_NOTICE = 4.0
"""Seconds after which a line explains the wait."""
COMPILING = "compiling for this machine, on the first run only: about half a minute in all"


@click.command(cls=Command, epilog=examples("fba demo", "fba demo --no-play --out demo/"))
@with_options
def command(
    out: Path | None = option(
        type=click.Path(file_okay=False, path_type=Path),
        help="Folder for the samples and the files made from them; default: a new temporary one.",
    ),
    no_clobber: bool = options.no_clobber_option,
    play: bool | None = option(help="Open a window; default: where there is a display."),
) -> None:
    """Encode the samples, print their sizes, and play the first.

    hello.bvh (a body) and hello.fap (a face) become one stream, beside their voice, hello.wav; talk.c3d
    (markers on a face) becomes another. Scripts made them, and a program speaks: nobody was captured.
    Without a display, a film and a picture are made instead. The sample files are copied into the folder.
    """
    from fba.codec import probe_stream
    from fba.formats import merge, read
    from fba.planning import encode

    folder = out if out is not None else Path(tempfile.mkdtemp(prefix="fba-demo-"))
    folder.mkdir(parents=True, exist_ok=True)
    stream, video, picture = (folder / f"hello{suffix}" for suffix in (".fba", ".mp4", ".png"))
    sources = [folder / name for name in SAMPLES]
    capture, sound, talk = folder / CAPTURE, folder / SOUND, folder / "talk.fba"
    made = (*sources, capture, sound, stream, talk, video, picture)
    outputs = Outputs([Output("--out", path) for path in made], no_clobber=no_clobber)
    surface = None if play is False else _open_window(asked=play is True)
    compiling = Timer(SECONDS_BEFORE_NOTICE, click.echo, [COMPILING], {"err": True})
    compiling.daemon = True
    compiling.start()
    for source in (*sources, capture, sound):
        outputs.write(source, (files("fba") / "samples" / source.name).read_bytes())
    body, face = (read(source) for source in sources)
    source_bytes = sum(source.stat().st_size for source in sources)
    animation = merge(face, body.resample(face.rate))
    compiling.cancel()
    click.echo(f"samples: {' and '.join(map(str, sources))}, with {sound}")
    click.echo(
        f"animation: {seconds_text(animation.duration)}, body at {rate_text(body.rate)} and "
        f"face at {rate_text(face.rate)} frames/s, {source_bytes} bytes of text"
    )
    data = encode(animation, EncoderOptions(bap_steps=BAP_STEPS))
    outputs.write(stream, data)
    info = probe_stream(data)
    click.echo(
        f"encoded: {stream}: {len(data)} bytes, {info.bits_per_second / 1000:.2f} kbit/s, "
        f"{source_bytes / len(data):.0f} times smaller"
    )
    decoded = read(stream)
    click.echo(f"decoded: {len(decoded)} frames at {rate_text(decoded.rate)} frames/s")
    shown = surface is not None and _play(decoded, surface, sound, asked=play is True)
    _encode_capture(capture, talk, outputs)
    if not shown:
        _render(decoded, video, picture, sound)
    quoted = shlex.quote(str(stream))
    if shown or (play is False and _can_open_a_window()):
        click.echo(f"to see it again: {as_typed(f'fba play {quoted}')}")
    else:
        click.echo(f"other pictures: {as_typed(f'fba render {quoted} -o picture.png --time 1.5')}")


def _encode_capture(capture: Path, stream: Path, outputs: Outputs) -> None:
    """Encode markers on a face, with the path of the head, and print the sizes."""
    from fba.formats import read
    from fba.planning import encode

    face = read(capture, rate=25)
    data = encode(face, EncoderOptions(bap_steps=BAP_STEPS))
    outputs.write(stream, data)
    size = capture.stat().st_size
    click.echo(
        f"markers on a face: {capture}, {seconds_text(face.duration)}, {size} bytes; encoded: {stream}: "
        f"{len(data)} bytes, {size / len(data):.0f} times smaller"
    )


def _open_window(*, asked: bool) -> Surface | None:
    """Open the window, before work that takes some seconds; return None where there is no display."""
    from fba import player

    surface = player.Surface()
    try:
        surface.open(TITLE)
    except DisplayError as error:
        _say_why_not(error, asked=asked)
        return None
    click.echo("opening a window; Esc closes it")
    return surface


def _play(animation: Animation, surface: Surface, sound: Path, *, asked: bool) -> bool:
    """Play an animation, then the files dropped onto the window; return whether that was possible."""
    from fba import player
    from fba.formats import read

    with surface:
        try:
            dropped = player.play(
                animation, title=TITLE, surface=surface, audio=sound, life=True, from_face=True
            )
            while dropped:
                file = dropped[0]
                dropped = player.play(read(file), title=file.name, file=file, surface=surface)
        except DisplayError as error:
            _say_why_not(error, asked=asked)
            return False
    return True


def _say_why_not(error: DisplayError, *, asked: bool) -> None:
    if asked:
        raise error
    click.echo(f"{str(error).splitlines()[0].partition('. ')[0]}; making a film instead")


def _can_open_a_window() -> bool:
    from fba import player

    try:
        player.check_display()
    except DisplayError:
        return False
    return True


def _render(animation: Animation, video: Path, picture: Path, sound: Path) -> None:
    from fba import player

    player.render(animation, picture, time=float(animation.times[0]) + 2.0)
    try:
        with Progress("rendering", None) as step:
            player.render(animation, video, size=(640, 360), audio=sound, progress=step.show)
    except DisplayError as error:  # films need more than pictures
        click.echo(f"rendered: {picture}; no film: {error}")
    else:
        click.echo(f"rendered: {video} and {picture}")
