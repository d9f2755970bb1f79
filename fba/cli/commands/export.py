"""`fba export`: a page that plays streams in any browser, or the figure for other pages."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from fba.cli import inputs, options, scenes
from fba.cli.coding.coded_streams import encode_stream
from fba.cli.coding.size_options import Size
from fba.cli.command import Command, examples
from fba.cli.inputs import ReadFile, Reading, check_clip, read_file
from fba.cli.map_options import MAP, Maps, read_body_joints
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import Output, Outputs, display_name, output_option
from fba.cli.recordings.inputs import Inputs
from fba.cli.scenes import MOST_FILES, SoundOptions
from fba.encoder_options import EncoderOptions
from fba.errors import FormatError
from fba.limits import Limits
from fba.source import naming_file

if TYPE_CHECKING:
    from fba_player.export.page import PageStream


FIGURE_SUFFIX = ".fbam"


@dataclass(frozen=True, kw_only=True)
class _Look:
    """How the page shows its streams."""

    model: Path | None = options.model_option(
        "The face: a .glb of this project, or another that can be imported. Default: the built-in head."
    )
    body: Path | None = option(
        type=options.FILE, metavar="FILE", help="The body, .glb or .vrm. Default: the built-in person."
    )
    maps: Maps = option(
        "--map",
        default=(),
        type=MAP,
        multiple=True,
        metavar="JOINT=JOINT|FILE",
        help="With --body: which joint of the standard a joint of its skeleton is. Repeatable.",
    )
    figure: options.Figure | None = options.figure_option
    title: str = option(
        default="", metavar="TEXT", help="Title of the page. Default: the names of the files."
    )
    view: Literal["front", "three-quarter", "profile", "body"] | None = option(
        help="Default: one that suits the content."
    )
    loop: bool = option(default=False, help="Start again at the end.")


@click.command(
    cls=Command,
    epilog=examples(
        "fba export talk.fba -o talk.html",
        "fba export talk.fba -o talk.html --audio voice.mp3",
        "fba export walk.bvh -o walk.html --view body --loop",
        "fba export original.fap decoded.fba -o both.html",
        "fba export talk.fba -o - --model head.glb > talk.html",
        "fba export --model head.glb -o head.fbam",
    ),
)
@click.argument("files", type=options.EXISTING, nargs=-1, metavar="[FILE...]")
@with_options
def command(
    files: tuple[Path, ...],
    look: _Look,
    output: Path = output_option(
        "OUT.html|OUT.fbam", "The page, or a figure. - for standard output.", required=True
    ),
    no_clobber: bool = options.no_clobber_option,
    sound: SoundOptions = group(
        audio=option(
            type=options.FILE,
            metavar="FILE",
            help="Sound, from the first frame. Default: that of an MP4 file, else the WAV file of the same "
            "name beside the input.",
        )
    ),
    reading: Reading = group(),
) -> None:
    """Make a page that plays files in any browser, from disk and without a network.

    The page holds the streams, the figure and the player. Streams go into it as they are; other files as
    `fba encode` makes them without options. Several files are shown side by side.

    With OUT.fbam, only the figure of --model and --body is written, for <fba-player model="OUT.fbam"> in
    other pages.
    """
    if output.suffix.lower() == FIGURE_SUFFIX:
        _write_figure(files, look, output, no_clobber=no_clobber, limits=reading.limit)
        return
    if not files:
        raise click.UsageError("give a file to show")
    if len(files) > MOST_FILES:
        raise click.UsageError(f"{len(files)} files are too many for one page; at most {MOST_FILES}")
    outputs = Outputs(
        [Output("-o", output, text=True)], [*files, look.model, look.body, sound.audio], no_clobber=no_clobber
    )
    check_clip(reading, files)
    audio = scenes.find_sound(files, sound, "exported without sound")
    names = scenes.display_names(files)
    read = [read_file(file, reading, name=name) for file, name in zip(files, names, strict=True)]
    for file, each in zip(files, read, strict=True):
        if not len(each.animation):
            raise FormatError("holds no frames; a page needs one", path=file)
    joints = read_body_joints(look.maps, look.body, reading.limit)
    with_body = any(each.animation.body is not None for each in read)
    from fba_player.export.page import make_page

    page = make_page(
        [_stream(each, name) for each, name in zip(read, names, strict=True)],
        model=inputs.read_model(look.model, look.figure),
        body=inputs.read_body(look.body, joints, look.figure if with_body else None),
        with_body=with_body,
        with_head=any(each.animation.body is None for each in read),
        audio=audio,
        audio_offset=scenes.find_offset(audio, files, sound),
        title=look.title,
        view=look.view or "",
        loop=look.loop,
    ).encode()
    outputs.write(output, page)
    outputs.say(f"{display_name(output)}: {len(page):,} bytes, {', '.join(names)}")


def _write_figure(
    files: tuple[Path, ...], look: _Look, output: Path, *, no_clobber: bool, limits: Limits
) -> None:
    if files:
        raise click.UsageError(f"{output} is a figure without a stream; leave out {files[0]}")
    outputs = Outputs([Output("-o", output)], [look.model, look.body], no_clobber=no_clobber)
    joints = read_body_joints(look.maps, look.body, limits)
    from fba_player.export.page import pack_figure

    model = inputs.read_model(look.model, look.figure)
    data = pack_figure(model, inputs.read_body(look.body, joints, look.figure))
    outputs.write(output, data)
    outputs.say(f"{display_name(output)}: {len(data):,} bytes")


def _stream(read: ReadFile, name: str) -> PageStream:
    """Return what goes into the page for a file."""
    from fba_player.export.page import PageStream

    if read.stream is not None:
        return PageStream(name, read.stream, read.table)
    animation = read.animation
    taken = Inputs(animation, None, None, (read,), False)
    with naming_file(read.path):
        table = read.table or ("visage" if taken.is_captured else "iso")
        coded = encode_stream(animation, EncoderOptions(bap_steps=table), Size(), taken)
    return PageStream(f"{name}.fba", coded.data, table if animation.body is not None else None)
