"""`fba markers`: virtual markers, by which a capture moves any head."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from fba.choices import Assignment, Gaze, Overlap, UpAxis
from fba.cli import options
from fba.cli.command import Command, examples, option_errors, usage_errors
from fba.cli.inputs import Reading
from fba.cli.map_options import MAP, Maps, Neutral, files_of, neutral_option, split_maps
from fba.cli.option_fields import group, option, with_options
from fba.cli.outputs import STANDARD, Output, Outputs, display_name, further_output_option, output_option
from fba.cli.printing import Progress
from fba.errors import ModelError, warn

if TYPE_CHECKING:
    from fba.capture import MarkerMotion
    from fba.capture.virtual_markers import MarkedHead, MarkerMapping
    from fba_player.scene.marker_editing import MarkerEditing

PICTURES = (".png", ".jpg", ".jpeg")
FILMS = (".mp4", ".gif")
UNDRAWN = (".glb", ".toml")


@dataclass(frozen=True, kw_only=True)
class _Tuning:
    """Changes of a mapping; None keeps a value."""

    assignment: Assignment | None = option(
        help="A vertex belongs to all markers in whose reach it is, or to the nearest alone. Default: as the "
        "mapping says, shared in a new one."
    )
    overlap: Overlap | None = option(
        help="Shared vertices move so that centres meet their markers, or displacements are added. Default: "
        "as the mapping says, match in a new one."
    )
    gaze: Gaze | None = option(
        help="Eyes stay in the head as they are, or keep looking at the camera while it turns. Default: as "
        "the mapping says, none in a new one."
    )
    squint: float | None = option(
        type=options.FloatRange(0, 100),
        metavar="PERCENT",
        help="Narrow the eyes by this share of their opening. Default: as the mapping says, 0 in a new one.",
    )

    def applied(self, mapping: MarkerMapping) -> MarkerMapping:
        """Return the changed mapping."""
        return replace(
            mapping,
            assignment=self.assignment or mapping.assignment,
            overlap=self.overlap or mapping.overlap,
            gaze=self.gaze or mapping.gaze,
            squint=mapping.squint if self.squint is None else self.squint / 100,
        )


@dataclass(frozen=True, kw_only=True)
class _Drawing:
    """Options of a picture or a film."""

    cloud: Literal["beside", "over", "none"] | None = option(
        help="Where a picture or film shows the markers themselves. Default: beside."
    )
    camera: Literal["front", "three-quarter", "profile"] = option(default="front")
    time: float | None = option(type=options.MOMENT, metavar="SECONDS", help="For a picture: its time.")
    start: float | None = option(type=options.MOMENT, metavar="SECONDS", help="For a film: start time.")
    end: float | None = option(type=options.MOMENT, metavar="SECONDS", help="For a film: end time.")
    rate: Fraction | None = options.rate_option(
        "Frame rate of a film. Default: the capture's own, or a whole fraction of it."
    )
    size: tuple[int, int] | None = options.size_option()


@dataclass(frozen=True, kw_only=True)
class _Request:
    """What the command line asks for."""

    capture: Path
    head: Path | None
    output: Path | None = output_option(
        "OUT.png|.jpg|.mp4|.gif|.glb|.toml",
        "A picture, a film, the head with its animation, or the mapping, instead of a window.",
    )
    maps: Maps = option(
        "--map",
        default=(),
        type=MAP,
        multiple=True,
        metavar="FILE.toml|MARKER=PLACE",
        help="A saved mapping, in place of the proposed one. Or where a marker is: a feature point, "
        "Chin=2.1, or a vertex, Chin=1234; nowhere: Chin=. Repeatable.",
    )
    map_out: Path | None = further_output_option(
        "FILE.toml",
        "Write the mapping beside OUT; in the window, Ctrl+S does. Default there: the file of --map, "
        "else the capture's name with .virtual.toml.",
    )
    no_clobber: bool = options.no_clobber_option
    points: Path | None = options.model_option(
        "Feature points of HEAD (CSV, JSON, FDP). Default: a file beside HEAD with the same name, else what "
        "is found.",
        "--points",
    )
    up: UpAxis = option(default="y", help="Vertical axis of HEAD.")
    neutral: Neutral = neutral_option("The")
    tuning: _Tuning
    marker: str | None = option(metavar="NAME", help="Marker whose reach is shown in colours.")
    drawing: _Drawing
    reading: Reading = group("format", "limit")


@click.command(
    "markers",
    cls=Command,
    epilog=examples(
        "fba markers face.c3d",
        "fba markers face.c3d head.obj --points head.points.csv --map-out mapping.toml",
        "fba markers face.csv head.glb --map mapping.toml -o face.mp4",
        "fba markers face.csv -o reach.png --marker LPB",
        "fba markers face.csv scan.obj --map mapping.toml -o moved.glb",
    ),
)
@click.argument("capture", metavar="CAPTURE", type=options.FILE)
@click.argument("head", metavar="[HEAD]", required=False, type=options.ExistingPath())
@with_options
def command(request: _Request) -> None:
    """Let captured markers move any head, in a window or into a file.

    CAPTURE has markers on a face (C3D, TRC, CSV, ...). HEAD is a face model, or any mesh (OBJ, PLY, glTF);
    without it, the built-in head. Each marker moves the vertices around the one that it is paired with,
    less the farther away they are. Where the places of the markers and the feature points of the head are
    known, a mapping is proposed.

    In the window, click on a marker, then on the head where it belongs; the panel has its reach, and all
    keys. With -o, no window opens.
    """
    output, capture = request.output, request.capture
    _check_options(output, request.drawing)
    outputs = _outputs(request)
    if output is None:
        from fba_player.window.pages import check_page

        check_page("markers")
    motion = _read_capture(capture, request.reading)
    with Progress("reading", None):
        from fba.capture.virtual_markers import read_head

        head = read_head(request.head, points=request.points, up=request.up, limits=request.reading.limit)
        mapping = request.tuning.applied(_find_mapping(motion, head, request))
    marker = request.marker
    if marker is not None and marker not in (*motion.names, *mapping.markers):
        from fba.name_maps import list_names

        raise click.UsageError(
            f"--marker {marker}: the capture has no such marker; it has {list_names(motion.names)}"
        )
    if output is None:
        from fba_player.window.pages import map_markers

        saved, _ = split_maps(request.maps, "mapping")
        path = request.map_out or saved or Path(f"{capture.stem}.virtual.toml")
        editing = _edit(motion, head, mapping, request, path)
        map_markers(editing, capture.name, size=request.drawing.size or (1280, 800))
        if editing.written:
            click.echo(f"{editing.path}: {_count(editing.mapping)}")
    elif output.suffix.lower() == ".toml":
        _write_mapping(mapping, head, output, outputs)
    else:
        _write_moved(motion, head, mapping, request, output, outputs)
        if request.map_out is not None:
            _write_mapping(mapping, head, request.map_out, outputs)


def _write_moved(
    motion: MarkerMotion,
    head: MarkedHead,
    mapping: MarkerMapping,
    request: _Request,
    output: Path,
    outputs: Outputs,
) -> None:
    """Write the head that markers move: its animation as glTF, a picture or a film."""
    from fba.capture.virtual_markers import move_head

    with Progress("preparing", None):
        performance = move_head(motion, head, mapping, request.neutral)
    if output.suffix.lower() == ".glb":
        from fba.formats.gltf.moved_head import write_moved_head

        with outputs.file(output) as file:
            write_moved_head(file, performance, motion.name or request.capture.stem)
        outputs.say(f"{display_name(output)}: {len(motion)} frames, {len(performance.names)} virtual markers")
        return
    from fba_player.scene.markers_scene import MarkersScene

    scene = MarkersScene(_edit(motion, head, mapping, request, None), request.capture.name)
    scene.place_cloud(request.drawing.cloud or "beside")
    scene.shows_current = request.marker is not None
    drawing = request.drawing
    from fba_player.export.render import picture_size, render

    with outputs.file(output) as file, Progress("rendering", None) as step, usage_errors():
        render(
            scene, file, camera=drawing.camera, time=drawing.time, start=drawing.start, end=drawing.end,
            rate=drawing.rate, size=drawing.size, progress=step.show,
        )  # fmt: skip
    wide, high = picture_size(drawing.size, output)
    outputs.say(f"{display_name(output)}: {wide}x{high}")


def _check_options(output: Path | None, drawing: _Drawing) -> None:
    """Raise click.UsageError for options that the output does not take."""
    films = {"--start": drawing.start, "--end": drawing.end, "--fps": drawing.rate}
    drawn = {"--cloud": drawing.cloud, "--time": drawing.time, **films, "--size": drawing.size}
    suffix = "" if output is None else output.suffix.lower()
    if output == STANDARD:
        raise click.UsageError("--output -: give the name of a file")
    if output is not None and suffix not in (*PICTURES, *FILMS, *UNDRAWN):
        raise click.UsageError(
            f"--output {output}: name a picture ({', '.join(PICTURES)}), a film ({', '.join(FILMS)}), a head "
            "with its animation (.glb) or a mapping (.toml)"
        )
    for name, value in drawn.items():
        if value is None:
            continue
        if output is None and name != "--size":
            raise click.UsageError(f"{name} is for a picture or a film: give -o FILE.png or .mp4")
        if suffix in UNDRAWN:
            raise click.UsageError(f"{name} is for a picture or a film, not for {output}")
        if name in films and suffix in PICTURES:
            raise click.UsageError(f"{name} is for a film; a picture has a --time")
    if drawing.time is not None and suffix in FILMS:
        raise click.UsageError("--time is for a picture; a film has a --start and an --end")


def _outputs(request: _Request) -> Outputs:
    """Return the files to write; click.UsageError for names of other kinds, and for several mappings."""
    output, map_out = request.output, request.map_out
    split_maps(request.maps, "mapping")
    if map_out == STANDARD:
        raise click.UsageError("--map-out -: give the name of a file")
    if map_out is not None and map_out.suffix.lower() != ".toml":
        raise click.UsageError(
            f"--map-out {map_out}: mappings are TOML; name it {map_out.with_suffix('.toml')}"
        )
    written = [Output("--output", output)] if output is not None else []
    if output is not None and map_out is not None:
        written.append(Output("--map-out", map_out, text=True))
    inputs = [request.capture, request.head, request.points, *files_of(request.maps)]
    return Outputs(written, inputs, no_clobber=request.no_clobber)


def _read_capture(path: Path, reading: Reading) -> MarkerMotion:
    """Return the markers of a capture; click.UsageError for a file of another kind."""
    from fba.capture import MarkerMotion
    from fba.formats import format_of, formats

    reader = format_of(path, reading.format)
    motion = None
    if reader.has_markers and reader.read_face is not None:
        motion = reader.read_face(path, limits=reading.limit)
    if not isinstance(motion, MarkerMotion):
        readers = ", ".join(each.name for each in formats() if each.has_markers)
        raise click.UsageError(
            f"{path} is {reader.name.upper()}, which has no markers; these have: {readers}"
        )
    if not len(motion):
        raise ModelError(f"{path}: the capture has no frames")
    return motion


def _find_mapping(motion: MarkerMotion, head: MarkedHead, request: _Request) -> MarkerMapping:
    """Return the mapping of `--map`, or else the proposed mapping, changed by pairs.

    A mapping that cannot be proposed is an error for a file, and a warning for a window, where it is made.
    """
    from fba.capture.markers.marker_maps import change_map
    from fba.capture.virtual_markers import MarkerMapping, propose_mapping, read_mapping

    saved, pairs = split_maps(request.maps, "mapping")
    places = {name: place for name, place in pairs.items() if place and not place.isdecimal()}
    missing = [name for name in pairs if name not in motion.names]
    if missing:
        from fba.name_maps import list_names

        raise click.UsageError(
            f"--map: the capture has no marker {list_names(missing)}; it has {list_names(motion.names)}"
        )
    if saved is not None and places:
        name, place = next(iter(places.items()))
        raise click.UsageError(f"--map {name}={place}: with a saved mapping, give a vertex: {name}=1234")
    if saved is not None:
        mapping = read_mapping(saved, limits=request.reading.limit)
        mapping.check(head)
        mapping.check_names(motion.names)
    else:
        mapping = MarkerMapping()
        try:
            with option_errors("--map: "):
                changed = change_map(motion, None, places) if places else None
                mapping = propose_mapping(motion, head, changed)
        except ModelError as error:
            if request.output is not None:
                raise
            warn(str(error), stacklevel=2)
    for name, vertex in pairs.items():
        if name not in places:
            mapping = _put(mapping, head, name, vertex)
    return mapping


def _put(mapping: MarkerMapping, head: MarkedHead, name: str, vertex: str) -> MarkerMapping:
    """Return a mapping with a marker on a vertex, or without the marker for ""."""
    from fba.capture.virtual_markers import VirtualMarker
    from fba.capture.virtual_markers.lids import lid_at
    from fba.capture.virtual_markers.proposal import usual_radius

    if not vertex:
        return mapping.changed(name, None)
    old = mapping.markers.get(name)
    number = int(vertex[:18])
    if old is not None and old.vertex is not None:
        lid = old.lid and bool(lid_at(head, number))
        return mapping.changed(name, replace(old, vertex=number, lid=lid))
    radius = usual_radius(mapping, head)
    return mapping.changed(name, VirtualMarker(number, radius, radius, old is not None and old.fixed))


def _write_mapping(mapping: MarkerMapping, head: MarkedHead, path: Path, outputs: Outputs) -> None:
    from fba.capture.virtual_markers import write_mapping

    mapping.check(head)
    with outputs.file(path) as file:
        write_mapping(file, mapping.for_head(head))
    outputs.say(f"{display_name(path)}: {_count(mapping)}")


def _count(mapping: MarkerMapping) -> str:
    return f"{len(mapping.markers)} virtual markers, {len(mapping.fixed)} of them fixed"


def _edit(
    motion: MarkerMotion, head: MarkedHead, mapping: MarkerMapping, request: _Request, path: Path | None
) -> MarkerEditing:
    """Return a mapping for editing. path: where it is saved; None for pictures."""
    from fba_player.scene.marker_editing import MarkerEditing

    editing = MarkerEditing(motion, head, mapping, path, neutral=request.neutral)
    if request.marker is not None:
        editing.choose(request.marker)
    elif path is None:
        editing.shows_weights = False
    return editing
