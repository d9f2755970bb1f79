"""`fba find`: which performance, frame and side the outline of a figure in a picture shows."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fba.cli import options
from fba.cli.command import Command, examples
from fba.cli.inputs import Reading, check_clip, read_body, read_input, read_model
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import Output, Outputs, OutputType, display_name, find_writer, output_option
from fba.cli.printing import Progress, seconds_text, table_lines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fba.arrays import Bool
    from fba.outlines import Hit, Index

PICTURES = (".png", ".jpg", ".jpeg")
DEFAULT_RATE = Fraction(25)
SHOWN_STREAM = 40
"""Most letters of a performance's name in the table."""


@dataclass(frozen=True, kw_only=True)
class _Building:
    """What is drawn for an index."""

    build: Path | None = option(
        metavar="INDEX",
        type=OutputType(),
        help="Make this index of the silhouettes of IN..., which are files of any format.",
    )
    views: int = option(
        default=24,
        type=click.IntRange(1, 360),
        metavar="N",
        help="With --build: sides, evenly around the figure.",
    )
    every: int = option(
        default=5, type=click.IntRange(1), metavar="N", help="With --build: draw every Nth frame."
    )
    pitches: tuple[float, ...] = option(
        "--pitch",
        default=(),
        type=options.FloatRange(-89, 89),
        multiple=True,
        metavar="DEGREES",
        help="With --build: draw from this far above; repeatable. Default: 0.",
    )
    model: Path | None = options.model_option("With --build: the face; default: the built-in head.")
    body: Path | None = option(
        type=options.FILE, metavar="FILE", help="With --build: the body; default: the built-in person."
    )


@dataclass(frozen=True, kw_only=True)
class _Finding:
    """What is made of what was found."""

    output: Path | None = output_option(
        "OUT.png|.bap|.fap|.fba",
        "A picture of the nearest silhouettes; or an animation of the poses that were found, one a picture.",
    )
    count: int = option(default=10, type=click.IntRange(1, 100), metavar="N", help="Silhouettes to list.")
    in_order: bool = option(
        default=False,
        help="The pictures follow each other in time: pose and side change little between them.",
    )
    rate: Fraction | None = options.rate_option(f"Frame rate of the animation; default: {DEFAULT_RATE}.")


@click.command(
    cls=Command,
    epilog=examples(
        "fba find --build walks.npz walk.fba run.bvh",
        "fba find picture.png walks.npz",
        "fba find picture.png walks.npz -o best.png",
        "fba find 1.png 2.png 3.png walks.npz --in-order -o motion.bap --fps 10",
    ),
)
@click.argument("files", metavar="PICTURE... INDEX | --build INDEX IN...", nargs=-1, type=options.FILE)
@with_options
def command(
    files: tuple[Path, ...],
    building: _Building,
    finding: _Finding,
    reading: Reading = group(),
    no_clobber: bool = options.no_clobber_option,
    as_json: bool = options.json_option,
) -> None:
    """Find what the outline of a figure in a picture shows: the performance, the frame and the side.

    The figure stands before a plain background or a transparent one. INDEX holds silhouettes of performances,
    which --build draws from all sides. An outline does not tell left from right: the best silhouette from
    another side is named, too.
    """
    used = [name for name in ("output", "count", "in_order", "rate") if options.is_given(name)]
    if building.build is not None:
        if used:
            raise click.UsageError(f"--{used[0].replace('_', '-')} goes with pictures, not with --build")
        if not files:
            raise click.UsageError("--build needs the files of performances: fba find --build INDEX IN...")
        _build(files, building.build, building, reading, as_json, no_clobber)
        return
    unused = [name for name in ("views", "every", "pitches", "model", "body") if options.is_given(name)]
    if unused:
        raise click.UsageError(f"--{'pitch' if unused[0] == 'pitches' else unused[0]} goes with --build")
    if len(files) < 2:
        raise click.UsageError("give a picture and an index: fba find PICTURE... INDEX")
    _find(files[:-1], files[-1], finding, reading, as_json, no_clobber)


def _build(
    files: tuple[Path, ...],
    target: Path,
    building: _Building,
    reading: Reading,
    as_json: bool,
    no_clobber: bool,
) -> None:
    from fba.outlines import Choice, build_index

    outputs = Outputs(
        [Output("--build", target)], [*files, building.model, building.body], no_clobber=no_clobber
    )
    check_clip(reading, files)
    names = [file.name for file in files]
    shown = [str(file) if names.count(file.name) > 1 else file.name for file in files]
    animations = [read_input(file, reading) for file in files]
    with Progress("drawing", None, "silhouettes") as progress:
        index = build_index(
            zip(shown, animations, strict=True),
            Choice(building.views, building.every, building.pitches or (0.0,)),
            model=read_model(building.model),
            body=read_body(building.body),
            progress=progress.show,
        )
    with outputs.file(target) as path:
        index.save(path)
    poses = len(index) // len(index.views)
    report = {"file": display_name(target), "silhouettes": len(index), "poses": poses, "performances": shown}
    if as_json:
        outputs.print_json(report)
    else:
        outputs.say(
            f"{display_name(target)}: {len(index)} silhouettes, {poses} poses from {len(index.views)} sides, "
            f"of {', '.join(shown)}"
        )


def _find(
    pictures: tuple[Path, ...],
    file: Path,
    finding: _Finding,
    reading: Reading,
    as_json: bool,
    no_clobber: bool,
) -> None:
    from fba.outlines import Index, read_mask

    target = finding.output
    drawn = target is not None and target.suffix.lower() in PICTURES
    if finding.rate is not None and (target is None or drawn):
        raise click.UsageError("--fps goes with -o and an animation")
    listed: list[Output] = []
    if target is not None:
        name = "--output"
        listed = [
            Output(name, target) if drawn else Output.of_format(name, target, find_writer(target, None))
        ]
    outputs = Outputs(listed, [*pictures, file], no_clobber=no_clobber)
    index = Index.load(file, limits=reading.limit)
    masks = [read_mask(picture, limits=reading.limit) for picture in pictures]
    found = [index.search(mask, finding.count) for mask in masks]
    chosen = [hits[0] for hits in found]
    if finding.in_order:
        chosen = index.search_sequence(masks)
    others = [
        next(iter(index.search(mask, 1, away_from=hit.view)), None)
        for mask, hit in zip(masks, chosen, strict=True)
    ]
    if target is not None and drawn:
        _draw(index, masks, found, target, outputs)
    elif target is not None:
        animation = index.animation(chosen, finding.rate or DEFAULT_RATE)
        outputs.write_animation(target, animation, find_writer(target, None))
    if as_json:
        report = [
            {
                "picture": str(picture),
                "found": _record(hit),
                "other_side": None if other is None else _record(other),
                "nearest": [_record(each) for each in hits],
            }
            for picture, hit, other, hits in zip(pictures, chosen, others, found, strict=True)
        ]
        outputs.print_json(report)
        return
    for picture, hit, other, hits in zip(pictures, chosen, others, found, strict=True):
        outputs.say(f"{picture}: {_text(hit)}")
        if other is not None:
            outputs.say(f"  from another side: {_text(other)}")
        if len(pictures) == 1:
            outputs.say("\n".join(_table(hits)))
    if target is not None:
        outputs.say(
            f"{display_name(target)}: {'the nearest silhouettes' if drawn else f'{len(chosen)} frames'}"
        )


def _draw(
    index: Index, masks: Sequence[Bool], found: Sequence[Sequence[Hit]], target: Path, outputs: Outputs
) -> None:
    from PIL import Image

    from fba.atomic import atomic
    from fba.outlines import draw_sheet

    kind = "PNG" if target.suffix.lower() == ".png" else "JPEG"
    with outputs.file(target) as path, atomic(path) as file:
        Image.fromarray(draw_sheet(index, masks, found)).save(file, kind)


def _record(hit: Hit) -> dict[str, Any]:
    return {
        "stream": hit.stream, "frame": hit.frame, "seconds": round(hit.seconds, 3), "yaw": hit.view.yaw,
        "pitch": hit.view.pitch, "side": hit.view.side, "distance": round(hit.distance, 4),
    }  # fmt: skip


def _text(hit: Hit) -> str:
    return (
        f"{hit.stream}, frame {hit.frame} ({seconds_text(hit.seconds)}), from its {hit.view.side} "
        f"({hit.view.yaw:g} degrees), distance {hit.distance:.3f}"
    )


def _table(hits: Sequence[Hit]) -> list[str]:
    rows = [
        [hit.stream[:SHOWN_STREAM], str(hit.frame), f"{hit.view.yaw:g}", hit.view.side, f"{hit.distance:.3f}"]
        for hit in hits
    ]
    return table_lines(["performance", "frame", "yaw", "side", "distance"], rows, to_right=(1, 2, 4))
